"""The first page while numbers are computed, and with a day that is none."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from monitor.progress import listening
from monitor.store import Database
from monitor.web.pages.fleet import _Sums, _with_unnumbered
from monitor.web.words import aligned, as_fine_as
from monitor.workflow.identify.every import IdentifyAllRequest, identify_all
from monitor.workflow.query import TableAnswer
from tests.store.test_fleet import keep
from tests.web.conftest import Served


def test_machines_stay_on_the_page_while_their_first_numbers_are_computed() -> None:
    columns = ("machine", "location", "campaigns", "latest_run_at")
    machines = TableAnswer(
        columns, ("",) * 4, {}, (("A", "hall 1", 2, "2026-01-05"), ("B", None, 0, None)), False
    )
    rows = _with_unnumbered(_Sums(waiting=SimpleNamespace()), machines)  # type: ignore[arg-type]
    assert [(row.machine, row.next_step) for row in rows] == [
        ("A", "its numbers are being computed"),
        ("B", "measure it, and import the campaign"),
    ]


def test_identifying_every_campaign_tells_the_share_that_is_done(tmp_path: Path) -> None:
    shares: list[float] = []
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        for campaign in ("a-1", "a-2", "a-3", "a-4"):
            keep(db, "A", [[1.0, 1.1, 0.9]], campaign)
        with listening(shares.append):
            # None has readings: each is refused, and counts.
            assert len(identify_all(db, IdentifyAllRequest()).refused) == 4
    assert shares[-1] == 1.0
    assert {0.25, 0.5, 0.75} <= set(shares)


def test_a_day_that_is_none_leaves_the_fleet(local: Served) -> None:
    page = local.client.get("/", params={"since": "abc"})
    assert page.status_code == 400
    assert "not &#39;abc&#39;: the machines of every day are shown" in page.text
    assert '<a href="/machine?name=' in page.text


def test_a_column_keeps_the_zeros_at_its_ends() -> None:
    assert [aligned(value) for value in (41.0, 22.3, 0.5, 4.0, 123.0, -41.0, 1234.0)] == [
        "41.0", "22.3", "0.500", "4.00", "123", "−41.0", "1234",
    ]  # fmt: skip
    assert [aligned(value, 4) for value in (22.27, 22.0)] == ["22.27", "22.00"]
    assert (as_fine_as(0.0853, 2.4), as_fine_as(-12.346, 0.21), as_fine_as(1.5, None)) == (
        "0.1",
        "−12.35",
        "1.5",
    )
