"""The volumetric error ahead: against the exact chain at extrapolated parameters, limits, refusals, the backtest."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from by_path import TESTS, load
from scipy import optimize

from monitor.cli import main
from monitor.store import Database, machine_history
from monitor.store.past.campaign_runs import gather_runs
from monitor.store.past.identified_values import gather_values
from monitor.uncertainty.volumetric import grid, middle, volumetric_error
from monitor.workflow.history.past import machine_past
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import answer_of
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.error_map import poses_of, ranges_of
from monitor.workflow.volumetric.known_errors import geometric_errors

answers = load("answers", TESTS / "answers.py")
trends = answers.trends

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
WEEKS, RUNS = 24, 3
#: What drifts before the campaign, in display units a week: squareness by µrad, scale by µm/m.
DRIFT = {"EC0Y": 0.8, "EXX": 0.5}
FACTOR = {"µm": 1e-3, "µrad": 1e-6, "µm/m": 1e-6}


@pytest.fixture(scope="module")
def path(
    tmp_path_factory: pytest.TempPathFactory, made_once: Callable[[str, Callable[[Path], object]], Path]
) -> Path:
    """A year's half of weekly campaigns that lead, with small scatter, to the example `cold-cold`."""
    made = made_once("weekly-half-year", _fill) / "m.duckdb"
    return Path(shutil.copy(made, tmp_path_factory.mktemp("volumetric") / "m.duckdb"))


def _fill(folder: Path) -> None:
    rng = np.random.default_rng(3)
    with Database(folder / "m.duckdb") as db:
        import_folders(db, ImportRequest([EXAMPLES / "cold-cold"]))
        identify(db, IdentifyRequest("cold-cold"))
        ((machine, topology_of, start),) = db.rows(
            "SELECT machine, machine_description, min(started_at) FROM campaign JOIN run USING (campaign_id) "
            "GROUP BY ALL"
        )
        found = db.rows(
            "SELECT parameter, unit, avg(value), avg(u) FROM v_parameters WHERE value IS NOT NULL "
            "GROUP BY ALL ORDER BY 1"
        )
        description = json.loads(topology_of)
        first = db.next_number("imported_campaign", "campaign_id")
        heads = pd.DataFrame(
            {"number": np.arange(first, first + WEEKS), "description": json.dumps(description)}
        )
        db.insert(
            f"INSERT INTO imported_campaign SELECT number, 'past-' || number, '{machine}', 'samba', description, "
            "'{}', '{}', '', '', TIMESTAMP '2024-01-01' FROM incoming",
            heads,
        )
        week = np.repeat(np.arange(WEEKS), RUNS)
        frame = pd.DataFrame({"number": first + week, "run": np.tile(np.arange(1, RUNS + 1), WEEKS)})
        frame["at"] = [
            start - timedelta(days=7 * int(WEEKS - w)) + timedelta(hours=float(run))
            for w, run in zip(week, frame["run"], strict=True)
        ]
        db.insert(
            'INSERT INTO run SELECT number, run, run, "at", 0, 1, false, MAP {} FROM incoming',
            frame,
        )
        names = [row[0] for row in found]
        db.insert(
            f"INSERT INTO identification SELECT number, number, 'samba', 1, 'samba', {names}::VARCHAR[], "
            f"{[row[1] for row in found]}, {[FACTOR[row[1]] for row in found]}, {RUNS}, '', "
            "TIMESTAMP '2024-01-01' FROM incoming",
            heads,
        )
        for name, unit, mean, u in found:
            past = mean - DRIFT.get(name, 0.0) * (WEEKS - week) + u * rng.normal(size=len(week))
            db.insert(
                f"INSERT INTO parameter_value SELECT number, run, '{name}', value, {u * FACTOR[unit]}, '{unit}', "
                f"{FACTOR[unit]} FROM incoming",
                frame.assign(value=past * FACTOR[unit]),
            )
        gather_values(db)
        gather_runs(db)


@pytest.fixture
def db(path: Path) -> Iterator[Database]:
    with Database(path) as opened:
        yield opened


def test_the_date_is_that_of_the_exact_chain_at_the_extrapolated_parameters(db: Database) -> None:
    found = trends(db, "HU40-T", volumetric_limit_um=216.0)
    ahead = found["volumetric_error"]
    past = machine_past(machine_history(db, "HU40-T"), [])
    assert ahead["why"] is None
    assert ahead["held"] == []
    # The other way: the whole grid through the exact chain, for parameters on their lines, and the root of the limit.
    evaluated = evaluate(db, UncertaintyRequest("cold-cold", method="guf", model_uncertainty=False))
    known, _ = geometric_errors(
        StatedUncertainty(evaluated.campaign, evaluated.model, answer_of(evaluated)), evaluated.fit
    )
    ranges, _ = ranges_of(evaluated.campaign, known.chain)
    points = grid(known.chain, ranges, 7, poses_of(known.chain, known.context.positions))
    units = {name: FACTOR[one["unit"]] for name, one in found["parameters"].items()}
    now = max(float(parameter.series.t[-1]) for parameter in past.values())

    def worst(t: float) -> float:
        lines = {name: parameter.drift.stated for name, parameter in past.items()}
        theta = [(lines[n].level_at + lines[n].slope * (t - lines[n].at)) * units[n] for n in known.names]
        error = volumetric_error(known, points, middle(known.chain, ranges), np.array(theta))
        return float(error.lengths.max()) * 1e3

    assert ahead["latest_um"] == pytest.approx(worst(now), abs=0.05)
    crossing = optimize.brentq(lambda t: worst(t) - 216.0, now, now + 2000.0)
    stated = datetime.fromisoformat(ahead["crosses_limit_at"]).timestamp() / 86400.0
    assert stated == pytest.approx(crossing, abs=3.0)
    low, high = (datetime.fromisoformat(x).timestamp() / 86400.0 for x in ahead["crosses_limit_interval"])
    assert now < low < stated < high
    # The map of the last run scatters about the line as its parameters do.
    assert ahead["latest_um"] == pytest.approx(
        float(volumetric_error(known, points, middle(known.chain, ranges)).lengths.max()) * 1e3, abs=10.0
    )
    assert 0.0 < ahead["in_tolerance_at_next_check"] <= 1.0
    assert ahead["predicted_interval_um"][0] < ahead["predicted_um"] < ahead["predicted_interval_um"][1]
    tested = ahead["backtest"]
    assert tested["made"] == 8
    assert tested["inside"] >= 6
    assert abs(tested["bias_um"]) <= tested["rms_um"] < 15.0


def test_a_limit_already_passed_is_crossed_now_and_a_far_one_never(db: Database) -> None:
    passed = trends(db, "HU40-T", volumetric_limit_um=50.0)["volumetric_error"]
    assert passed["in_tolerance_at_next_check"] == 0.0
    assert passed["recommended_interval_days"] == 0.0
    far = trends(db, "HU40-T", volumetric_limit_um=1e5)["volumetric_error"]
    assert far["crosses_limit_at"] is None
    assert far["crosses_limit_interval"] is None
    assert far["in_tolerance_at_next_check"] == 1.0


def test_without_a_limit_or_a_drift_a_sentence_says_why(db: Database) -> None:
    none = trends(db, "HU40-T")["volumetric_error"]
    assert none["why"].startswith("no forecast of the volumetric error: no limit is stated")
    short = trends(db, "HU40-T", campaigns=("cold-cold",), volumetric_limit_um=300.0)
    assert short["volumetric_error"]["why"].endswith("no parameter has a drift to extrapolate")


def test_the_command_prints_the_forecast_the_next_check_and_the_backtest(path: Path, capsys) -> None:
    assert main(["--db", str(path), "trend", "HU40-T", "--volumetric-limit", "216"]) == 0
    said = capsys.readouterr().out
    assert "limit 216 µm; reaches its limit on 20" in said
    assert "at the next check, " in said
    assert " of 8 past days, each foretold by the days before it, lay in the interval (" in said
    assert "each day forecast from the days before it: " in said
    assert main(["--db", str(path), "trend", "HU40-T", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    tested = document["parameters"]["EC0Y"]["backtest"]
    # Every day from the sixth on is foretold: 24 past weeks and the days of the campaign.
    assert tested["made"] == document["parameters"]["EC0Y"]["days"] - 5
    assert tested["share_inside"] == tested["inside"] / tested["made"] > 0.8


def test_refusals_of_the_option(path: Path, capsys) -> None:
    assert main(["--db", str(path), "trend", "HU40-T", "--volumetric-limit", "0"]) == 2
    assert "--volumetric-limit 0: a limit in µm lies above zero" in capsys.readouterr().err
    assert main(["--db", str(path), "trend", "HU40-T", "--volumetric-limit", "9", "--parameter", "EXX"]) == 2
    assert "--volumetric-limit needs all parameters" in capsys.readouterr().err
