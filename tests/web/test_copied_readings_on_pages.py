"""Pages say which readings are copies: the list of campaigns, a campaign, its model, both machines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database, import_campaign, withdraw_campaign
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A database of a campaign and the same readings of another machine."""
    path = tmp_path / "a.duckdb"
    measured = read_campaign(EXAMPLES / "r-test")
    assert isinstance(measured, Campaign)
    with Database(path, threads=1) as db:
        import_campaign(db, measured)
        copy = replace(measured, name="other", machine=replace(measured.machine, id="CENTRE-5"), files=())
        import_campaign(db, copy, ["looks odd", "and so does this"])
    return path


def test_copies_are_said_in_the_list_of_campaigns(path: Path, serve: Any) -> None:
    page = serve(path, False).client.get("/campaigns").text
    assert (
        "equals those of r-test of machine CENTRE-4 in every reading, which two measurements never do" in page
    )
    assert "2 notes" in page


@pytest.mark.slow
def test_copies_are_said_on_every_page_that_shows_their_numbers(path: Path, serve: Any) -> None:
    with Database(path, threads=1) as db:
        for name in ("r-test", "other"):
            identify(db, IdentifyRequest(name))
    client = serve(path, False).client
    for address in ("/campaign?name=r-test", "/machine?name=CENTRE-4", "/machine?name=CENTRE-5"):
        assert "in every reading, which two measurements never do" in client.get(address).text, address
    assert "2 notes of its import" in client.get("/machine?name=CENTRE-5").text
    assert "notes of its import" not in client.get("/machine?name=CENTRE-4").text


@pytest.mark.slow
def test_a_withdrawn_copy_is_said_no_more(path: Path, serve: Any) -> None:
    with Database(path, threads=1) as db:
        withdraw_campaign(db, "other", "a copy")
    assert "never do" not in serve(path, False).client.get("/campaigns").text
