"""A last run that contradicts what is stated of its readings is named, also of a machine that nothing else judges."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from monitor.cli.verbs import fleet_
from monitor.readers import read_campaign
from monitor.reporting.messages import machines_contradicting, statement_contradicted
from monitor.store import Database, import_campaign
from monitor.web.pages.fleet import machine_rows
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.history.refuted import ContradictedStatement
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.store.test_fleet import keep

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FREEDOM = 40


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        yield db


def _keep(db: Database, machine: str, name: str, times: list[float]) -> None:
    """A campaign of one day, a run for each of how many times its residuals are what is stated."""
    own = keep(db, machine, [[5.0] * len(times)], name)
    for run, of_run in enumerate(times, start=1):
        db.execute(
            "INSERT INTO identified_run VALUES (?, ?, 0.001, 3, ?, ?, [1.0], '[]')",
            [own, run, FREEDOM, of_run**2 * FREEDOM],
        )


def test_of_every_machine_the_last_run_of_its_latest_campaign_says_it(db: Database) -> None:
    _keep(db, "one-day", "a", [7.9])
    # A probe's statement may be wrong by three.
    _keep(db, "within", "b", [2.9])
    _keep(db, "before", "c", [7.9, 1.0])
    _keep(db, "again", "d-1", [7.9])
    _keep(db, "again", "d-2", [1.1])
    _keep(db, "since", "e-1", [1.0, 1.0])
    _keep(db, "since", "e-2", [1.0, 4.0])
    answer = fleet(db, FleetRequest())
    assert answer.statements_contradicted == {
        "one-day": ContradictedStatement("a", "samba", 1, pytest.approx(7.9)),
        "since": ContradictedStatement("e-2", "samba", 2, pytest.approx(4.0)),
    }
    assert answer.unexplained == {"one-day": "a", "since": "e-2"}
    page = trend(db, TrendRequest("since"))
    assert page.statement_contradicted == answer.statements_contradicted["since"]
    assert statement_contradicted("e-2", 2, 4.0) in page.notes
    assert trend(db, TrendRequest("since", campaigns=("e-1",))).statement_contradicted is None


def test_such_a_machine_comes_behind_what_asks_for_something_and_before_what_is_as_usual(
    db: Database,
) -> None:
    _keep(db, "A-usual", "a", [1.0])
    _keep(db, "B-contradicts", "b", [7.9])
    _keep(db, "C-out", "c", [1.0])
    db.execute(
        'UPDATE imported_campaign SET machine_description = \'{"tolerances": {"EXX": 4.0}}\' '
        "WHERE machine = 'C-out'"
    )
    answer = fleet(db, FleetRequest(None, 0))
    cells = fleet_._rows(answer, 0)
    assert [cell[1] for cell in cells] == ["C-out", "B-contradicts", "A-usual", "B-contradicts"]
    assert cells[1][3] == (
        "the model does not explain the latest readings: residuals 7.9 times the stated uncertainty"
    )
    # Beyond its tolerance of one day: that day says it.
    assert cells[0][3] == "out of tolerance"
    contradicted = answer.statements_contradicted
    rows = {
        row.machine: row for row in machine_rows(answer.table, {}, answer.unexplained, {}, {}, contradicted)
    }
    assert rows["B-contradicts"].urgency.word == "look"
    assert rows["B-contradicts"].residuals == "residuals 7.9 times the stated uncertainty"
    assert rows["A-usual"].urgency.word == "not judged"
    assert machines_contradicting({"B": ("b", 7.9), "C": ("c", 3.4)}, 1) == (
        "the latest readings contradict what is stated of them: B (b: residuals 7.9 times the stated uncertainty) and "
        "1 more; a statement, a reading or the model is wrong; type `monitor explain b`"
    )


@pytest.mark.slow
def test_an_r_test_whose_statement_is_eight_times_too_small(db: Database, tmp_path: Path) -> None:
    folder = tmp_path / "r-test"
    folder.mkdir()
    for file in (EXAMPLES / "r-test").iterdir():
        text = file.read_text(encoding="utf-8")
        (folder / file.name).write_text(
            text.replace("standard_uncertainty_um = 0.5", "standard_uncertainty_um = 0.0625"),
            encoding="utf-8",
        )
    for folder_of, times in ((EXAMPLES / "r-test", None), (folder, 8.56)):
        with Database(tmp_path / f"{times}.duckdb", threads=1) as own:
            import_campaign(own, read_campaign(folder_of))
            identify(own, IdentifyRequest("r-test"))
            contradicted = fleet(own, FleetRequest()).statements_contradicted
            assert (contradicted is None) == (times is None)
            if contradicted is not None:
                assert contradicted["CENTRE-4"].times == pytest.approx(times, rel=0.02)
