"""The sheet ``changes`` of a workbook has what ``trend`` computes, asked or not, with its times as dates in UTC."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from by_path import load

from monitor.cli import main
from monitor.exceptions import InputError, NotFoundError
from monitor.store import Database
from monitor.workflow.events import EventRequest, event
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.keeping import ExportRequest, export
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

histories = load("test_trends", Path(__file__).with_name("test_trends.py"))
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
HEAD = ("machine", "at / UTC", "kind", "parameter", "size", "u", "unit of size and u", "p", "what")


CAMPAIGNS = ("hot-cold", "five-days", "cold-cold")


@pytest.fixture
def changed(tmp_path: Path) -> Iterator[Database]:
    """A machine that changed, nothing of it identified."""
    with Database(tmp_path / "changed.duckdb") as opened:
        import_folders(opened, ImportRequest([EXAMPLES / name for name in CAMPAIGNS]))
        yield opened


def rows(path: Path) -> list[dict[str, Any]]:
    head, *body = openpyxl.load_workbook(path)["changes"].iter_rows(values_only=True)
    assert head == HEAD
    return [dict(zip(HEAD, row, strict=True)) for row in body]


def test_the_sheet_is_computed_and_says_what_it_lacks(
    changed: Database, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was empty without a word before the first ``trend`` of a machine, and its times were text of the shop's
    clock."""
    answer = export(changed, ExportRequest(tmp_path / "before.xlsx", "xlsx"))
    (row,) = rows(tmp_path / "before.xlsx")
    assert (row["machine"], row["kind"], row["at / UTC"]) == ("HU40-T", "not searched", None)
    assert "not identified by the model that HU40-T is followed by" in row["what"]
    assert answer.notes == (
        "parameters, parameters long, changes: without cold-cold, five-days, hot-cold, not identified yet; "
        "type `monitor identify`",
    )
    alone = export(changed, ExportRequest(tmp_path / "alone.xlsx", "xlsx", ("runs", "parameters"), "HU40-T"))
    assert alone.notes == (
        "parameters: without cold-cold, five-days, hot-cold, not identified yet; type `monitor identify`",
    )
    assert export(changed, ExportRequest(tmp_path / "runs.xlsx", "xlsx", ("runs",))).notes == ()

    for campaign in CAMPAIGNS:
        identify(changed, IdentifyRequest(campaign))
    at = datetime(2026, 3, 4, 12, tzinfo=UTC)
    event(changed, EventRequest("HU40-T", "belt looked at", at))
    answer = export(changed, ExportRequest(tmp_path / "after.xlsx", "xlsx", ("changes",)))
    assert answer.notes == ()
    written = rows(tmp_path / "after.xlsx")
    followed = trend(changed, TrendRequest("HU40-T"))
    changes = [
        (
            change.kind,
            name,
            change.size,
            change.u,
            change.unit,
            change.p_value,
            datetime.fromisoformat(change.at),
        )
        for name, parameter in followed.parameters.items()
        for change in (*parameter.changes, *parameter.drifts)
        if change.at is not None
    ]
    assert changes
    # The shop's clock is five hours behind.
    assert {moment.utcoffset().total_seconds() for *_, moment in changes} == {-5 * 3600.0}  # type: ignore[union-attr]
    computed = [row for row in written if row["parameter"] is not None]
    assert sorted((row["parameter"], row["kind"]) for row in computed) == sorted(
        (name, kind) for kind, name, *_ in changes
    )
    for kind, name, size, u, unit, p, moment in changes:
        (row,) = [row for row in computed if (row["parameter"], row["kind"]) == (name, kind)]
        assert isinstance(row["at / UTC"], datetime)
        assert abs((row["at / UTC"] - moment.astimezone(UTC).replace(tzinfo=None)).total_seconds()) < 1e-3
        numbers = (row["size"], row["u"], row["p"])
        assert numbers == pytest.approx((size, u, p), rel=1e-14)
        assert row["unit of size and u"] == unit
        assert "as `monitor trend` does" in row["what"]
    (recorded,) = [row for row in written if row["kind"] == "event: note"]
    assert (recorded["at / UTC"], recorded["what"]) == (datetime(2026, 3, 4, 12), "belt looked at")

    path = changed.path
    changed.close()
    assert main(["--db", str(path), "export", str(tmp_path / "cli.xlsx"), "--machine", "HU40-T"]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'cli.xlsx'}\n"
    assert rows(tmp_path / "cli.xlsx") == written


def test_nothing_is_computed_for_what_cannot_be_written(db: Database, tmp_path: Path) -> None:
    (tmp_path / "there.xlsx").touch()
    with pytest.raises(InputError, match="is there already and is not written over"):
        export(db, ExportRequest(tmp_path / "there.xlsx", "xlsx"))
    with pytest.raises(NotFoundError, match="there is no machine 'HU40'"):
        export(db, ExportRequest(tmp_path / "new.xlsx", "xlsx", machine="HU40"))
    assert not (tmp_path / "new.xlsx").exists()


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("repiar", "--kind repiar: did you mean 'repair'?"),
        ("Repair", "did you mean 'repair'"),
        ("Note", "did you mean 'note'"),
        ("crahs", "did you mean 'crash'"),
        ("probes", "did you mean 'probe'"),
    ],
)
def test_a_misspelt_kind_is_not_recorded(kind: str, said: str) -> None:
    """It split the history under a name that nobody looks for."""
    with pytest.raises(InputError, match=said.replace("?", r"\?")):
        EventRequest("HU40-T", "belt", datetime(2026, 3, 4, tzinfo=UTC), kind)


@pytest.mark.parametrize("kind", ["note", "repair", "relocation", "earthquake", "software", "Umzug"])
def test_any_other_kind_is_taken(kind: str) -> None:
    assert EventRequest("HU40-T", "belt", datetime(2026, 3, 4, tzinfo=UTC), kind).kind == kind


def test_an_event_that_is_recorded_already_is_not_recorded_again(db: Database) -> None:
    at = datetime(2026, 3, 4, 7, tzinfo=UTC)
    event(db, EventRequest("HU40-T", "B axis encoder changed", at, "repair"))
    same = datetime.fromisoformat("2026-03-04T02:00:00-05:00")
    with pytest.raises(
        InputError, match=r"this repair of HU40-T is recorded already, as event 1 of 2026-03-04 07:00 UTC"
    ):
        event(db, EventRequest("HU40-T", " b axis encoder changed", same, "repair"))
    # Another kind, another moment or other words are another event.
    event(db, EventRequest("HU40-T", "B axis encoder changed", at, "crash"))
    event(db, EventRequest("HU40-T", "belt changed", at, "repair"))
    recorded = event(db, EventRequest("HU40-T", "belt changed", at.replace(hour=8), "repair")).events
    assert len(recorded) == 4


def test_a_step_at_an_event_and_a_slope_are_those_of_trend(tmp_path: Path) -> None:
    """The sheet had the event without a size and denied any change, and a slope with a u as of independent days."""
    rng = np.random.default_rng(7)
    week = np.arange(histories.WEEKS)[:, np.newaxis]
    at = histories.START + timedelta(weeks=30, days=-3)
    runs = (histories.WEEKS, histories.RUNS)
    # Weeks resemble each other: a random walk that forgets, whose slope is less certain than by independent weeks.
    days = np.zeros(histories.WEEKS)
    for index in range(1, histories.WEEKS):
        days[index] = 0.6 * days[index - 1] + 0.5 * rng.normal()
    noise = 0.3 * rng.normal(size=runs)
    with Database(tmp_path / "m.duckdb", threads=1) as db:
        histories.add_machine(db, "STEPPED", {"EX0C": 12.0 * (week >= 30) + noise})
        histories.add_machine(db, "DRIFTS", {"EXX": 1.0 * week + days[:, np.newaxis] + noise})
        event(db, EventRequest("STEPPED", "ran into the vice", at.replace(tzinfo=UTC), "crash"))
        export(db, ExportRequest(tmp_path / "m.xlsx", "xlsx", ("changes",)))
        (step,) = trend(db, TrendRequest("STEPPED")).parameters["EX0C"].event_steps
        drifting = trend(db, TrendRequest("DRIFTS")).parameters["EXX"]
    written = rows(tmp_path / "m.xlsx")
    stepped = [row for row in written if row["machine"] == "STEPPED"]
    assert {row["kind"] for row in stepped} == {"event: crash", "step at event: crash"}
    (row,) = [row for row in stepped if row["parameter"] == "EX0C"]
    assert row["at / UTC"] == at
    assert (row["size"], row["u"], row["p"]) == pytest.approx((step.size, step.u, step.p_value), rel=1e-14)
    assert step.decided
    assert abs(row["size"] - 12.0) < 4.0 * row["u"]
    assert row["what"].startswith("EX0C stepped by +1")
    assert "at the event 'ran into the vice'" in row["what"]

    (found,) = drifting.drifts
    stated = (drifting.drift.slope_per_year, drifting.drift.u_slope, drifting.drift.p_value)
    assert drifting.drift.resemblance is not None
    assert drifting.drift.resemblance.widening > 1.1
    assert (found.kind, found.unit, found.p_at_most) == ("trend", "µm/year", None)
    assert (found.size, found.u, found.p_value) == stated
    (row,) = [row for row in written if row["machine"] == "DRIFTS"]
    assert (row["kind"], row["size"], row["u"], row["p"]) == ("trend", *map(pytest.approx, stated))
    assert row["what"] == (
        "the values drift from here on: size is the slope; computed from the runs, as `monitor trend` does"
    )


def test_a_slope_that_may_be_a_season_is_called_so(tmp_path: Path) -> None:
    """Four months of a wave of a year: `trend` says that drift or season cannot be told apart, the sheet said drift."""
    rng = np.random.default_rng(3)
    week = np.arange(18)[:, np.newaxis]
    wave = -6.0 * np.cos(2.0 * np.pi * week / 52.18) + 0.3 * rng.normal(size=(18, histories.RUNS))
    with Database(tmp_path / "m.duckdb", threads=1) as db:
        histories.add_machine(db, "SEASON", {"EXX": wave})
        export(db, ExportRequest(tmp_path / "m.xlsx", "xlsx", ("changes",)))
        drift = trend(db, TrendRequest("SEASON")).parameters["EXX"].drift
    (row,) = rows(tmp_path / "m.xlsx")
    assert row["what"].startswith(
        "the values drift from here on: size is the slope; drift or season cannot be told"
    )
    assert (row["size"], row["u"]) == pytest.approx((drift.slope_per_year, drift.u_slope), rel=1e-14)
