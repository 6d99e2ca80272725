"""The first page where campaigns of a machine are of the same hours: which to choose, not what to compare."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, import_campaign
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGNS = ("five-days", "hidden-spindle-growth")


def complete(served: Any, address: str) -> str:
    """A page once nothing on it is being computed."""
    for ticket in served.client.app._app.state.desk.under_way():
        ticket.future.result(120.0)
    page = served.client.get(address)
    assert page.status_code == 200
    text: str = page.text
    return complete(served, address) if 'class="waiting"' in text else text


def test_the_first_page_asks_for_the_campaign_that_counts(tmp_path: Path, serve: Any) -> None:
    path = tmp_path / "monitor.duckdb"
    with Database(path, threads=1) as db:
        for name in CAMPAIGNS:
            measured = read_campaign(EXAMPLES / name)
            assert isinstance(measured, Campaign)
            import_campaign(db, measured)
            identify(db, IdentifyRequest(name))
    served = serve(path, False)
    first = complete(served, "/")
    (step,) = re.findall(r'<td data-title="What to do next">(.*?)</td>', first)
    assert "hold runs of the same hours, which one machine cannot have made" in step
    for wrong in ("compare the days", "look for what wears", "ask what happened", "nothing to do"):
        assert wrong not in step
    links = re.findall(r'<a href="([^"]+)">([^<]+)</a>', step)
    assert tuple(name for _, name in links[:2]) == CAMPAIGNS
    # The link leads to the numbers of that campaign alone.
    alone = complete(served, links[0][0].replace("&amp;", "&"))
    assert "4 runs of 2026-03-09" in alone
    assert "hold runs of the same hours" not in alone
