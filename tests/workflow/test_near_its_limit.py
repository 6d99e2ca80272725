"""The fleet, `monitor trend` and the weekly report agree on machines that are near a limit."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from monitor.cli.trend_output import _change, _crosses
from monitor.records import VOLUMETRIC
from monitor.reporting.adjusting import SEE_FIRST
from monitor.reporting.health.records import State
from monitor.store import Database, machine_history, save_analysis
from monitor.uncertainty.conformity import conformity
from monitor.web.pages.fleet import machine_rows
from monitor.web.words import earliest_and_latest, how_far
from monitor.workflow.fleet.answer import FleetTableRow
from monitor.workflow.fleet.attention import Attention
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.verdict import Conformity, state_of
from monitor.workflow.history.forecast import RELIABILITY
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from tests.store.test_fleet import keep

DAYS = 60
LIMIT = 50.0
#: What the readings cannot tell, in the stored u of each run.
U = 1.0
#: What of it all runs of one machine have in common by the laser that measured them.
COMMON = 0.9
NOTHING = SimpleNamespace(suspect=())
MACHINES = (
    "a-near",
    "b-far",
    "c-out",
    "d-scatters",
    "e-stepped",
    "f-drifts",
    "g-weekly",
    "h-back",
    "i-laser",
)


def _levels(machine: str) -> np.ndarray:
    """Levels of the days."""
    day = np.arange(DAYS)
    scatter = np.random.default_rng([20261126, ord(machine[0])]).normal(size=DAYS)
    return {
        "a-near": 30.0 + 18.6 * day / (DAYS - 1) + np.append(scatter[:-1], 0.0),
        "b-far": 20.0 + 2.0 * scatter,
        "c-out": 30.0 + 36.0 * day / (DAYS - 1),
        "d-scatters": np.append(27.0 + 14.0 * scatter[:-1], 30.0),
        "e-stepped": np.where(day < 15, 45.0, 12.0) + 1.0 * scatter,
        "f-drifts": 10.0 + 14.0 * day / (DAYS - 1) + 0.5 * scatter,
        "g-weekly": 20.0 + 2.0 * scatter,
        "i-laser": 48.5 + 0.3 * scatter,
        "h-back": np.where(day < 3, 40.0, 72.0 - 10.0 * day / (DAYS - 1)),
    }[machine]


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Machines with a limit, measured three times a day, one every week; and one without a limit whose days differ
    most of all."""
    path = tmp_path_factory.mktemp("near") / "monitor.duckdb"
    rng = np.random.default_rng(26)
    with Database(path, threads=1) as db:
        for machine in MACHINES:
            runs = [(level + 0.3 * rng.normal(size=3)).tolist() for level in _levels(machine)]
            if machine == "g-weekly":
                for number in range(6):
                    keep(db, machine, runs[number : number + 1], f"{machine}-{number}")
            else:
                keep(db, machine, runs, machine)
        db.execute(
            "INSERT INTO common_part SELECT identification_id, run, 'laser', '', 'scale', 1e-6, [?] "
            "FROM identification JOIN campaign USING (campaign_id) JOIN run USING (campaign_id) "
            "WHERE machine = 'i-laser'",
            [COMMON],
        )
        db.execute(
            "UPDATE imported_campaign SET machine_description = ?", [f'{{"tolerances": {{"EXX": {LIMIT}}}}}']
        )
        keep(
            db,
            "z-no-limit",
            [(30.0 * (-1.0) ** day + rng.normal(size=3)).tolist() for day in range(DAYS)],
            "z",
        )
    return path


@pytest.fixture(scope="module")
def rows(shop: Path) -> dict[str, FleetTableRow]:
    with Database(shop, threads=1, read_only=True) as db:
        return {row.machine: row for row in fleet(db, FleetRequest(None, 0)).table}


@pytest.mark.parametrize("machine", MACHINES)
def test_in_tolerance_at_the_next_check_is_that_of_trend(
    shop: Path, rows: dict[str, FleetTableRow], machine: str
) -> None:
    with Database(shop, threads=1, read_only=True) as db:
        stated = trend(db, TrendRequest(machine)).parameters["EXX"].forecast
    row = rows[machine]
    assert row.next_check is not None
    assert stated.next_check is not None
    assert row.next_check[:10] == stated.next_check[:10]
    stated_p, of_fleet = stated.in_tolerance_at_next_check, row.in_tolerance_at_next_check
    assert stated_p is not None
    assert of_fleet is not None
    # `trend` weighs days and cuts at changes, the fleet has sums: the same class, and the same to a tenth.
    assert of_fleet == pytest.approx(stated_p, abs=0.1)
    assert (of_fleet < RELIABILITY) == (stated_p < RELIABILITY)


def test_what_all_runs_have_in_common_is_in_the_forecast(rows: dict[str, FleetTableRow]) -> None:
    """1.5 below the limit with a scatter of 0.4 and a laser known to 0.9: by the normal distribution."""
    levels = _levels("i-laser")
    line = np.polyval(np.polyfit(np.arange(DAYS), levels, 1), 2.0 * DAYS)
    expected = norm.cdf((LIMIT - line) / np.hypot(0.45, COMMON))
    assert rows["i-laser"].in_tolerance_at_next_check == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("machine", MACHINES)
def test_out_of_tolerance_is_that_of_the_weekly_report(
    shop: Path, rows: dict[str, FleetTableRow], machine: str
) -> None:
    """By JCGM 106:2012, 7, of the last run as the history has it, and by the report's own states."""
    with Database(shop, threads=1, read_only=True) as db:
        last = machine_history(db, machine).values[-1, 0]
    out = 1.0 - float(conformity([last], np.array([[U**2]]), [-LIMIT], [LIMIT]).joint)
    assert rows[machine].probability_out == pytest.approx(out, abs=1e-9)
    judged = Conformity({"EXX": out}, out, every_has_one=True)
    state = state_of(judged, (), None, NOTHING, 0.05, evaluated=True)  # type: ignore[arg-type]
    assert (rows[machine].attention is Attention.OUT) == (state is State.OUT_OF_TOLERANCE)
    assert (rows[machine].attention is Attention.MAY_BE_OUT) == (state is State.MAY_BE_OUT_OF_TOLERANCE)


def test_a_limit_that_is_near_goes_before_days_that_differ(rows: dict[str, FleetTableRow]) -> None:
    assert {
        name: row.attention for name, row in rows.items() if name not in ("b-far", "e-stepped", "g-weekly")
    } == {
        "c-out": Attention.OUT,
        "h-back": Attention.OUT,
        "a-near": Attention.MAY_BE_OUT,
        "d-scatters": Attention.DUE,
        "i-laser": Attention.DUE,
        "f-drifts": Attention.DRIFTS_OUT,
        "z-no-limit": Attention.DAYS_DIFFER,
    }
    assert list(rows)[:3] == ["c-out", "h-back", "a-near"]
    # A step of the past is not a limit that is near.
    assert {rows["b-far"].attention, rows["e-stepped"].attention} <= {
        Attention.DAYS_DIFFER,
        Attention.AS_USUAL,
    }
    near = rows["a-near"]
    assert "the last run is beyond it with " in how_far(near)
    # A last run beyond a limit within which the mean of its day lies.
    by_last_run = replace(near, attention=Attention.OUT, probability_out=0.62)
    assert how_far(by_last_run).endswith("% of its limit of 50; the last run is beyond it with 62 %")
    assert "beyond it with" not in how_far(rows["c-out"])
    (row,) = machine_rows([near], {}, {}, {})
    assert (row.urgency.word, row.worst) == ("act now", near)
    assert "in tolerance at the next check (" in how_far(rows["d-scatters"])


@pytest.mark.parametrize("machine", ["c-out", "h-back"])
def test_what_is_beyond_its_limit_is_so_since_a_day_and_reaches_none(
    shop: Path, rows: dict[str, FleetTableRow], machine: str
) -> None:
    """The line of the second comes back to the limit some day: that day is not when the limit is reached."""
    with Database(shop, threads=1, read_only=True) as db:
        stated = trend(db, TrendRequest(machine)).parameters["EXX"]
        history = machine_history(db, machine)
    values = np.abs(history.values[:, 0])
    first = history.started_at[int(np.flatnonzero(values <= LIMIT)[-1]) + 1]
    forecast = stated.forecast
    assert forecast.beyond_since is not None
    assert datetime.fromisoformat(forecast.beyond_since) == first.replace(microsecond=0)
    assert rows[machine].onset == first.isoformat()
    assert (forecast.crosses_limit_at, forecast.crosses_limit_interval) == (None, None)
    assert _crosses(stated) == f"since {first:%Y-%m-%d}"


def test_an_open_end_of_an_interval_has_words() -> None:
    assert (
        earliest_and_latest(("2026-11-10T12:00:00", None)) == " (2026-11-10 at the earliest, perhaps never)"
    )
    assert earliest_and_latest((None, "2026-11-10")) == " (2026-11-10 at the latest)"
    assert earliest_and_latest(("2026-11-10", "2027-01-02")) == " (between 2026-11-10 and 2027-01-02)"
    assert earliest_and_latest(None) == ""


def test_a_map_that_may_be_beyond_its_limit_says_so_in_the_fleet(tmp_path: Path) -> None:
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        keep(db, "M", [[1.0, 1.1, 0.9]], "M-1")
        db.execute(
            f'UPDATE imported_campaign SET machine_description = \'{{"tolerances": {{"{VOLUMETRIC}": 60.0}}}}\''
        )
        for u, attention in ((5.0, Attention.MAY_BE_OUT), (0.5, Attention.AS_USUAL)):
            document = {"worst": {"error_um": 58.0, "u_um": u}, "degrees_of_freedom": None}
            save_analysis(db, "volumetric map", document, method="guf", campaign="M-1", run=1)
            row = next(
                row for row in fleet(db, FleetRequest(None, 0)).table if row.parameter == "volumetric error"
            )
            assert row.attention is attention


def test_the_fleet_page_adjusts_nothing_by_a_model_that_does_not_explain(
    rows: dict[str, FleetTableRow],
) -> None:
    for machine in ("c-out", "a-near", "f-drifts"):
        (explained,) = machine_rows([rows[machine]], {}, {}, {})
        (doubted,) = machine_rows([rows[machine]], {}, {machine: "campaign"}, {})
        assert "adjust" in explained.next_step
        assert doubted.next_step == SEE_FIRST
        assert (doubted.attention, doubted.urgency) == (explained.attention, explained.urgency)


def test_one_step_asked_for_alone_and_with_others_has_a_bound_and_not_two_p_values(tmp_path: Path) -> None:
    with Database(tmp_path / "monitor.duckdb", threads=1) as db:
        levels = np.where(np.arange(DAYS) < 15, 40.0, 10.0)
        rng = np.random.default_rng(3)
        keep(db, "M", [(level + rng.normal(size=3)).tolist() for level in levels], "M")
        (change,) = trend(db, TrendRequest("M")).parameters["EXX"].changes
    assert change.p_value == pytest.approx(1.0 / 2000.0)
    assert change.p_at_most
    assert "p at most 0.0005" in _change("EXX", change)
