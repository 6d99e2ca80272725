"""Between *add* and *identify*: whose numbers the first page and that of the machine show, and what they say of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, import_campaign, save_model
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
CAMPAIGN, EFFECT = "hidden-spindle-growth", "EZC1:const@warmup"
SAID = "are of samba@1, the newest version that all its campaigns have. samba@2 is newer"


def _complete(served: Any, address: str) -> str:
    """A page once nothing on it is being computed."""
    for ticket in served.client.app._app.state.desk.under_way():
        ticket.future.result(120.0)
    page = served.client.get(address)
    assert page.status_code == 200
    text: str = page.text
    return _complete(served, address) if 'class="waiting"' in text else text


def test_numbers_stay_until_the_newer_version_has_some(tmp_path: Path, serve: Any) -> None:
    path = tmp_path / "monitor.duckdb"
    with Database(path, threads=1) as db:
        measured = read_campaign(EXAMPLES / CAMPAIGN)
        assert isinstance(measured, Campaign)
        import_campaign(db, measured)
        identify(db, IdentifyRequest(CAMPAIGN))
        save_model(db, "samba", (EFFECT,), parent=("samba", 1))
    served = serve(path, False)
    first = _complete(served, "/")
    assert SAID in first
    assert "identify every campaign</button>" in first
    assert "no numbers yet" not in first
    # The page of the machine identifies by the newest version; until then nothing of both stands side by side.
    machine = served.client.get("/machine?name=HU40-T").text
    assert 'class="waiting"' in machine or EFFECT in machine
    assert EFFECT in _complete(served, "/machine?name=HU40-T&every=1")
    assert SAID not in _complete(served, "/")
