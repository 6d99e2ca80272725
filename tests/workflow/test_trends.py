"""The long view: a drift with its forecast, changes and events that split it, little history said in words."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from by_path import TESTS, load
from scipy.optimize import curve_fit

from monitor.cli import main
from monitor.cli.trend_output import out_of_tolerance, say
from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.readers import read_campaign
from monitor.reporting.messages import attention_words
from monitor.statistics import find_changes
from monitor.store import (
    Database,
    import_campaign,
    load_analysis,
    load_identification,
    machine_history,
    record_event,
)
from monitor.store.past.campaign_runs import gather_runs
from monitor.store.past.identified_values import gather_values
from monitor.workflow.health.forecast import stated_drift
from monitor.workflow.history.changes import search_changes
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.forecast import drift_forecast
from monitor.workflow.history.season import SlopeVerdict
from monitor.workflow.history.series import Series
from monitor.workflow.run_statistics.columns import group_labels
from monitor.workflow.run_statistics.request import StatisticsRequest
from monitor.workflow.run_statistics.statistics import stats
from monitor.workflow.selections.request import SelectionRequest, SideBySideRequest
from monitor.workflow.selections.select import select
from monitor.workflow.selections.side_by_side import side_by_side
from monitor.workflow.trend.figures import headline
from monitor.workflow.trend.parameter import drift_statement
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

answers = load("answers", TESTS / "answers.py")
fleet = answers.fleet
trends = answers.trends

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
START = datetime(2024, 1, 1, 8)
WEEKS, RUNS = 40, 4


def add_machine(
    db: Database,
    machine: str,
    values: dict[str, np.ndarray],
    ambient: np.ndarray | None = None,
    limit: float = 20.0,
):
    """Weekly campaigns of four runs: ``values`` name to (weeks, runs) in µm."""
    weeks, runs = next(iter(values.values())).shape
    db.execute(
        "INSERT INTO registered_machine SELECT count(*) + 1, ?, 'w C B X b Z Y (C1) t', TIMESTAMP '2024-01-01' "
        "FROM registered_machine",
        [machine],
    )
    first = db.next_number("imported_campaign", "campaign_id")
    description = json.dumps({"id": machine, "tolerances": dict.fromkeys(values, limit)})
    number = np.repeat(np.arange(first, first + weeks), runs)
    run = np.tile(np.arange(1, runs + 1), weeks)
    week = np.repeat(np.arange(weeks), runs)
    frame = pd.DataFrame({"number": number, "run": run})
    frame["at"] = [START + timedelta(days=7 * int(w), hours=float(r)) for w, r in zip(week, run, strict=True)]
    frame["ambient"] = np.full(len(number), 20.0) if ambient is None else ambient.ravel()
    heads = pd.DataFrame({"number": np.arange(first, first + weeks)})
    db.insert(
        f"INSERT INTO imported_campaign SELECT number, '{machine}-' || (number - {first}), '{machine}', 'samba', "
        f"'{description}', "
        "'{}', '{}', '', '', TIMESTAMP '2024-01-01' FROM incoming",
        heads,
    )
    db.insert(
        "INSERT INTO run SELECT number, run, run, \"at\", 0, 1, false, MAP {'ambient_degC': ambient} FROM incoming",
        frame,
    )
    db.insert(
        f"INSERT INTO identification SELECT number, number, 'samba', 1, 'samba', {list(values)}::VARCHAR[], "
        f"{['µm'] * len(values)}, {[1e-3] * len(values)}, {runs}, '', TIMESTAMP '2024-01-01' FROM incoming",
        heads,
    )
    for name, matrix in values.items():
        own = frame.assign(value=matrix.ravel() * 1e-3)
        db.insert(
            f"INSERT INTO parameter_value SELECT number, run, '{name}', value, 0.5e-3, 'µm', 1e-3 FROM incoming",
            own,
        )
    gather_values(db)
    gather_runs(db)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A machine with a drift, a step, nothing, and a dependence; its database."""
    rng = np.random.default_rng(11)
    week = np.arange(WEEKS)[:, np.newaxis]

    def noise() -> np.ndarray:
        return 0.3 * rng.normal(size=(WEEKS, 1)) + 0.5 * rng.normal(size=(WEEKS, RUNS))

    ambient = 20.0 + 2.0 * rng.normal(size=(WEEKS, RUNS))
    values = {
        "EX0B": 5.0 + 0.2 * week + noise(),
        "EX0C": noise() + 6.0 * (week >= 25),
        "EY0C": noise(),
        "EZ0B": 0.8 * (ambient - 20.0) + noise(),
    }
    with Database(tmp_path_factory.mktemp("trends") / "m.duckdb") as db:
        add_machine(db, "M", values, ambient)
        add_machine(db, "small", {"EX0B": np.array([[1.0, 1.1, 0.9]])})
        yield db


def test_drift_is_found_with_its_slope_and_the_date_it_crosses_the_limit(made: Database) -> None:
    found = trends(made, "M")["parameters"]["EX0B"]
    per_year = 0.2 / 7 * 365.25
    assert found["slope_interval"][0] < per_year < found["slope_interval"][1]
    assert found["robust_interval"][0] < per_year < found["robust_interval"][1]
    assert found["p_value"] < 1e-6
    assert found["monotone_p"] < 1e-3
    assert found["changes"] == []
    # 5 + 0.2 w reaches 20 in week 75.
    crossing = datetime.fromisoformat(found["crosses_limit_at"]).replace(tzinfo=None)
    assert abs((crossing - START).days / 7 - 75) < 3
    low, high = (datetime.fromisoformat(x).replace(tzinfo=None) for x in found["crosses_limit_interval"])
    assert low < START + timedelta(weeks=75) < high
    assert found["in_tolerance_at_next_check"] > 0.99
    assert 150 < found["recommended_interval_days"] < 36 * 7
    assert "prediction interval of the drift" in found["recommended_by"]


def test_a_change_is_found_at_its_date_and_not_fitted_as_a_trend(made: Database) -> None:
    found = trends(made, "M")["parameters"]["EX0C"]
    assert [change["kind"] for change in found["changes"]] == ["step"]
    change = found["changes"][0]
    assert change["at"].startswith((START + timedelta(weeks=25)).date().isoformat())
    assert abs(change["size"] - 6.0) < 4 * change["u"]
    assert change["unit"] == "µm"
    assert found["since"] >= change["at"][:10]
    assert abs(found["slope_per_year"]) < 4 * found["u_slope"]
    assert found["control"]["shewhart"]["state"] == "alarm"
    assert found["control"]["cusum"]["state"] == "alarm"


def test_the_latest_mean_has_its_uncertainty_and_its_runs(made: Database) -> None:
    found = trends(made, "M")["parameters"]["EX0B"]
    history = machine_history(made, "M")
    values = history.values[-4:, history.parameters.index("EX0B")]
    assert found["latest_runs"] == 4
    assert found["latest"] == pytest.approx(values.mean())
    by_day = history.values[:, history.parameters.index("EX0B")].reshape(-1, 4)
    assert found["latest_u"] == pytest.approx(np.sqrt(by_day.var(axis=1, ddof=1).mean() / 4))
    assert found["latest_degrees_of_freedom"] == 3 * len(by_day)


def test_a_quiet_parameter_raises_nothing_and_a_dependence_has_its_unit(made: Database) -> None:
    document = trends(made, "M")
    quiet = document["parameters"]["EY0C"]
    assert quiet["changes"] == []
    assert quiet["q_value"] > 0.05
    assert quiet["control"]["shewhart"]["state"] == "in control"
    warm = document["parameters"]["EZ0B"]["conditions"][0]
    assert (warm["channel"], warm["unit"]) == ("ambient_degC", "µm/K")
    assert abs(warm["coefficient"] - 0.8) < 3 * warm["u"]
    assert warm["q_value"] < 1e-6
    assert document["control"]["points"] == "days"
    assert document["control"]["vector"]["t_squared"]["state"] == "alarm"
    assert load_analysis(made, "trend", machine="M").document == document


def test_too_little_history_is_a_sentence_for_each_item_and_no_number(made: Database) -> None:
    found = trends(made, "small")["parameters"]["EX0B"]
    assert found["slope_per_year"] is None
    assert found["crosses_limit_at"] is None
    assert found["why"] == "1 day of history is too short for a slope a year; at least 30 are needed"
    assert found["why_no_changes"].startswith("no search for changes: too few runs (3); at least 6")
    assert found["why_no_cycles"].startswith("no cycles: a daily one needs")
    assert found["why_no_warm_up"].startswith("no warm-up:")
    assert found["why_no_forecast"] == "no forecast: there is no drift to extrapolate"
    assert found["control"]["why"].startswith("no chart: values has 3")


def test_an_event_splits_the_history_and_is_no_finding(made: Database) -> None:
    rng = np.random.default_rng(4)
    add_machine(
        made, "split", {"EX0B": rng.normal(size=(20, 2)) + 9.0 * (np.arange(20) >= 10)[:, np.newaxis]}
    )
    at = (START + timedelta(days=67)).replace(tzinfo=UTC)
    assert len(trends(made, "split")["parameters"]["EX0B"]["changes"]) == 1
    record_event(made, "split", at, "note", "ball screw inspected")
    assert len(trends(made, "split")["parameters"]["EX0B"]["changes"]) == 1
    record_event(made, "split", at, "repair", "ball screw changed")
    document = trends(made, "split")
    found = document["parameters"]["EX0B"]
    assert found["changes"] == []
    assert found["days"] == 10
    at_once = sorted((one["kind"], one["description"]) for one in document["events"])
    assert at_once == [("note", "ball screw inspected"), ("repair", "ball screw changed")]
    assert {one["at"] for one in document["events"]} == {at.isoformat()}


def test_an_event_of_midnight_has_the_day_of_the_shop(made: Database) -> None:
    """Midnight of the 5th at +01:00 stood on the page of the machine as the 4th, the day of UTC."""
    add_machine(made, "midnight", {"EX0B": np.random.default_rng(4).normal(size=(20, 2))})
    at = datetime(2026, 3, 5, tzinfo=timezone(timedelta(hours=1)))
    record_event(made, "midnight", at, "crash", "spindle hit the vice")
    assert [event["at"] for event in trends(made, "midnight")["events"]] == ["2026-03-05T00:00:00+01:00"]


def test_charts_begin_anew_at_a_recorded_event_and_see_what_comes_after_it(made: Database) -> None:
    """The step that an event explains stood as an alarm of all charts beside a drift that was as usual."""
    week, rng = np.arange(60)[:, np.newaxis], np.random.default_rng(8)
    scatter = rng.normal(size=(60, 2))
    add_machine(
        made,
        "mended",
        {"EX0B": scatter + 9.0 * (week >= 20), "EX0C": scatter + 9.0 * (week >= 20) + 9.0 * (week >= 50)},
    )
    before = trends(made, "mended")
    charts = ("shewhart", "ewma", "cusum")
    for found in before["parameters"].values():
        assert {found["control"][name]["state"] for name in charts} == {"alarm"}
    at = (START + timedelta(days=7 * 20 - 3)).replace(tzinfo=UTC)
    record_event(made, "mended", at, "repair", "ball screw changed")
    # One behind the last run begins nothing.
    record_event(made, "mended", at + timedelta(days=600), "crash", "spindle hit the vice")
    document = trends(made, "mended")
    assert (
        document["control"]["reference_from"]
        == (START + timedelta(days=7 * 20, hours=1.5)).isoformat() + "+00:00"
    )
    # A third of the forty weeks since the event.
    assert document["control"]["reference_points"] == 13
    usual, stepped = (document["parameters"][name]["control"] for name in ("EX0B", "EX0C"))
    assert [usual[name]["state"] for name in charts] == ["in control"] * 3
    assert usual["centre"] == pytest.approx(9.0, abs=1.0)
    assert usual["shewhart"]["lower"] > 0.0
    assert {stepped[name]["state"] for name in charts} == {"alarm"}
    # Who names a period means that one, whatever happened since.
    named = trends(made, "mended", reference=(START.replace(tzinfo=UTC), at))
    assert named["parameters"]["EX0B"]["control"]["centre"] == pytest.approx(0.0, abs=0.5)
    assert named["parameters"]["EX0B"]["control"]["shewhart"]["state"] == "alarm"


def test_a_few_days_since_an_event_are_all_the_reference(made: Database) -> None:
    add_machine(made, "lately", {"EX0B": np.random.default_rng(2).normal(size=(40, 2))})
    record_event(
        made, "lately", (START + timedelta(days=7 * 34 - 3)).replace(tzinfo=UTC), "repair", "belt changed"
    )
    document = trends(made, "lately")
    why = document["parameters"]["EX0B"]["control"]["why"]
    assert why == "no chart: all 6 days since the last event are the reference period"
    assert document["control"]["reference_points"] == 6


def test_choices_and_their_refusals(made: Database) -> None:
    since = START.replace(tzinfo=UTC) + timedelta(weeks=30)
    one = trends(made, "M", parameter="EX0B", since=since)
    assert list(one["parameters"]) == ["EX0B"]
    assert one["runs"] == 10 * RUNS
    with pytest.raises(NotFoundError, match="has no parameter 'EQQ'; it has EX0B, EX0C, EY0C, EZ0B"):
        trends(made, "M", parameter="EQQ")
    with pytest.raises(InputError, match="--next-check 2024-01-01 lies before the last run"):
        trends(made, "M", next_check=START.replace(tzinfo=UTC))
    with pytest.raises(NotFoundError, match="there is no machine 'N'"):
        trends(made, "N")


def test_a_parameter_asked_for_alone_changed_with_the_same_probability(made: Database) -> None:
    """The p-value of a change and the threshold it passes pay for all parameters of the machine, whoever asks."""
    every = trends(made, "M")["parameters"]
    assert any(parameter["changes"] for parameter in every.values())
    for name, parameter in every.items():
        alone = trends(made, "M", parameter=name)["parameters"][name]
        assert alone["changes"] == parameter["changes"]
        assert alone["event_steps"] == parameter["event_steps"]


def test_figures_are_drawn(made: Database, tmp_path: Path) -> None:
    files = trends(made, "M", parameter="EX0C", figures=tmp_path / "figures")["figures"]
    assert [Path(file).name for file in files] == ["trend-EX0C.svg", "trend-EX0C.png"]
    assert all(Path(file).stat().st_size > 5000 for file in files)


def test_fleet_ranks_what_needs_attention(made: Database) -> None:
    found = fleet(made, top=0)
    table = {(row["machine"], row["parameter"]): row for row in found["table"]}
    assert found["table"][0]["rank"] == 1
    assert table["M", "EX0B"]["attention"] == "drifts out of tolerance within a year"
    assert table["M", "EX0B"]["rank"] <= 2
    assert abs(table["M", "EX0B"]["slope_per_year"] - 0.2 / 7 * 365.25) < 4 * table["M", "EX0B"]["u_slope"]
    assert table["M", "EY0C"]["attention"] == "as usual"
    assert table["M", "EX0B"]["n"] == WEEKS * RUNS
    assert table["M", "EX0B"]["since"] is None
    assert table["small", "EX0B"]["attention"] == "one day only, nothing to compare it with"
    assert sum(found["attention"].values()) == found["rows"] == len(found["table"])
    assert len(fleet(made, top=2)["table"]) == 2


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The examples of figure 4.6 and of the reset."""
    with Database(tmp_path_factory.mktemp("selections") / "m.duckdb") as db:
        for name in ("hot-cold", "cold-cold", "five-days"):
            import_campaign(db, read_campaign(EXAMPLES / name))
        select(db, SelectionRequest("hot-cold", "hot-cold-star", "hours >= 6"))
        yield db


def test_los_2017_figure_4_6_without_its_first_hours_the_hot_machine_is_like_the_cold(
    campaigns: Database,
) -> None:
    found = side_by_side(campaigns, SideBySideRequest(("hot-cold", "hot-cold-star", "cold-cold"))).selections
    assert [one.runs for one in found.values()] == [44, 33, 44]
    # The thesis states k_q = 2.9 for its eleven parameters.
    assert all(one.k_q_with_degrees_of_freedom == pytest.approx(2.9, abs=0.1) for one in found.values())
    hot, star, cold = (found[name].expanded for name in ("hot-cold", "hot-cold-star", "cold-cold"))
    # What a calibration with these readings states: so few runs ask for a larger factor.
    own = uncertainty(
        campaigns,
        UncertaintyRequest("hot-cold", method="guf", select="hot-cold-star", model_uncertainty=False),
    )
    assert star == pytest.approx(own.guf.expanded, rel=1e-12)
    assert 2.9 < found["hot-cold-star"].k_q_with_degrees_of_freedom < 3.0
    for name in ("EXX", "EYY", "EZZ", "EX0C"):
        assert hot[name] > 1.2 * star[name]
        assert hot[name] > 1.2 * cold[name]
    # "least impact on EC0Y".
    assert hot["EC0Y"] < 1.3 * cold["EC0Y"]


def test_a_selection_is_a_group_and_feeds_the_uncertainty(campaigns: Database) -> None:
    within = stats(campaigns, StatisticsRequest("hot-cold", select="hot-cold-star"))
    assert within.groups == {"1": 33}
    assert within.vector.manova.why == "the runs form 1 group (1); at least 2 are needed"
    apart = stats(campaigns, StatisticsRequest("hot-cold", by="hot-cold-star"))
    assert apart.groups == {"hot-cold-star": 33, "not hot-cold-star": 11}
    # Eleven runs of a machine that warms up scatter more: the classical p-value does not hold, the larger of two does.
    assert apart.parameters["EYY"].anova_p < 1e-4
    assert apart.parameters["EYY"].anova_q < 0.01
    assert "has 11 runs for 11 parameters" in apart.vector.box_m.why
    own = uncertainty(
        campaigns,
        UncertaintyRequest("hot-cold", method="guf", select="hot-cold-star", model_uncertainty=False),
    )
    assert own.input_covariance.startswith("selection hot-cold-star: ")
    whole = uncertainty(campaigns, UncertaintyRequest("hot-cold", method="guf", model_uncertainty=False))
    assert own.guf.u["EYY"] < 0.8 * whole.guf.u["EYY"]
    with pytest.raises(InputError, match="followed another plan than hot-cold"):
        uncertainty(campaigns, UncertaintyRequest("hot-cold", method="guf", select="five-days"))
    with pytest.raises(InputError, match="--name cold-cold: a campaign has that name"):
        select(campaigns, SelectionRequest("hot-cold", "cold-cold", "hours > 6"))
    with pytest.raises(InputError, match="--name day: runs are grouped by a column of that name"):
        select(campaigns, SelectionRequest("hot-cold", "day", "hours > 6"))
    # Channels recorded with each probing are conditions of the runs here as in `stats`.
    warm = select(campaigns, SelectionRequest("five-days", "warm-axis", "x_axis_degC > 22")).runs
    assert (
        len(warm)
        == sum(stats(campaigns, StatisticsRequest("five-days", where="x_axis_degC > 22")).groups.values())
        == 13
    )
    with pytest.raises(InputError, match="no run of campaign hot-cold meets it"):
        select(campaigns, SelectionRequest("hot-cold", "late", "hours > 99"))


def test_a_condition_that_never_varies_makes_no_groups() -> None:
    with pytest.raises(DataError, match="--by oil_degC: it is 20 in every run; there is nothing to group by"):
        group_labels({"oil_degC": np.full(4, 20.0)}, "oil_degC")


def test_five_days_components_histogram_and_the_vector(campaigns: Database) -> None:
    found = stats(campaigns, StatisticsRequest("five-days"))
    parts = found.parameters["EB0C"].components
    assert parts.between > 3 * parts.within
    assert parts.between_interval[0] < parts.between < parts.between_interval[1]
    assert 0.0 < found.parameters["EB0C"].normality_p <= 1.0
    assert found.vector.box_m.why.startswith("group 1 has 4 runs for 13 parameters")
    assert found.vector.manova.p_value < 1e-3
    fourth = found.correlation_by_group["4"]
    assert fourth.degrees_of_freedom == 3
    runs = load_identification(campaigns, "five-days", "samba", 1)
    values = np.array([one.estimate for one in runs.runs if one.run in (13, 14, 15, 16)])
    assert found.parameter_order == tuple(runs.parameters)
    assert fourth.correlation == pytest.approx(np.corrcoef(values.T), abs=1e-9)
    assert len(found.coordinates.u_by_day_um["4"]) == 186
    bins = found.coordinates.histograms["anova"]
    assert sum(bins.counts) == found.coordinates.n == 186
    assert bins.counts[0] > 5 * bins.expected


def test_the_reset_of_the_b_axis_is_found_by_its_date(campaigns: Database) -> None:
    since = datetime.fromisoformat("2026-03-01T00:00:00-05:00")
    found = trends(campaigns, "HU40-T", since=since)["parameters"]
    steps = {
        name: [change["at"][:10] for change in one["changes"]]
        for name, one in found.items()
        if one["changes"]
    }
    assert steps["EB0C"] == ["2026-03-05"]
    assert found["EB0C"]["why"].startswith("4 days of history since the last change or event are too short")
    assert found["EYY"]["slope_per_year"] is None
    assert found["EYY"]["why"] == "7 days of history are too short for a slope a year; at least 30 are needed"
    assert found["EYY"]["warm_up"] is None
    hot = trends(campaigns, "HU40-T")["parameters"]["EYY"]["warm_up"]
    assert 1.0 < hot["tau_h"] < 4.0
    assert hot["stable_interval_h"][0] < hot["stable_after_h"] < hot["stable_interval_h"][1]
    assert set(steps) == {"EB0C"}


def test_campaigns_of_the_same_hours_are_named_and_one_can_be_chosen(tmp_path: Path) -> None:
    with Database(tmp_path / "same.duckdb") as db:
        for name in ("five-days", "nothing-hidden", "hot-cold"):
            import_campaign(db, read_campaign(EXAMPLES / name))
        (note,) = trends(db, "HU40-T")["notes"]
        assert note.startswith("campaigns five-days and nothing-hidden hold runs of the same hours")
        alone = trends(db, "HU40-T", campaigns=("five-days", "hot-cold"))
        assert alone["notes"] == []
        assert alone["campaigns"] == ["hot-cold", "five-days"]
        with pytest.raises(NotFoundError, match="holds no campaign 'cold'; it holds"):
            trends(db, "HU40-T", campaigns=("cold",))


def test_no_run_and_one_run_are_sentences_with_exit_status_0(made: Database, tmp_path: Path, capsys) -> None:
    later = datetime(2030, 1, 1, tzinfo=UTC)
    nothing = trends(made, "M", parameter="EX0B", since=later)
    assert nothing["why"] == "machine M has no identified run since 2030-01-01"
    assert nothing["parameters"] == {}
    path = tmp_path / "one.duckdb"
    with Database(path) as db:
        add_machine(db, "single", {"EX0B": np.array([[1.0]])})
    assert main(["--db", str(path), "trend", "single"]) == 0
    (said,) = capsys.readouterr().out.splitlines()
    assert said == "single: 1 run of 1 campaign, of 2024-01-01 09:00; a history begins with the second run"


def test_conditions_are_stated_by_their_rate_over_all_parameters(made: Database) -> None:
    """Benjamini and Hochberg over the conditions of the machine, as written in their paper: q = min over k >= i of
    p_k m / k; of one parameter alone q was its p-value."""
    parameters = trends(made, "M")["parameters"].values()
    effects = sorted((e for each in parameters for e in each["conditions"]), key=lambda e: e["p_value"])
    m = len(effects)
    assert m == 4
    for i, effect in enumerate(effects):
        q = min(effects[k]["p_value"] * m / (k + 1) for k in range(i, m))
        assert effect["q_value"] == pytest.approx(q, rel=1e-12)
    assert any(effect["q_value"] > 1.1 * effect["p_value"] for effect in effects)


def test_findings_beyond_any_doubt_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A q-value of exactly zero is the smallest, not a missing one."""
    rng = np.random.default_rng(3)
    ambient = 20.0 + rng.normal(size=(60, 6))
    with Database(tmp_path / "sure.duckdb") as db:
        values = {"EX0B": 900.0 * (ambient - 20.0), "EY0C": np.zeros_like(ambient)}
        add_machine(
            db, "sure", {name: x + 1e-3 * rng.normal(size=x.shape) for name, x in values.items()}, ambient
        )
        (found,) = trends(db, "sure")["parameters"]["EX0B"]["conditions"]
    assert found["q_value"] == 0.0
    assert main(["--db", str(tmp_path / "sure.duckdb"), "trend", "sure"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"EX0B: (900\.0|899\.9)\d* µm/K \(u = ", said)


def test_charts_of_the_vector_and_what_they_are_compared_with_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "charts.duckdb"
    rng = np.random.default_rng(6)
    values = {name: rng.normal(size=(30, RUNS)) for name in ("EX0B", "EX0C")}
    values["EX0C"][-1] += 50.0
    with Database(path) as db:
        add_machine(db, "C", values)
    assert main(["--db", str(path), "trend", "C"]) == 0
    said = capsys.readouterr().out
    assert (
        "charts: reference period 2024-01-01 to 2024-03-04, 10 days; a false alarm once in 370 days" in said
    )
    assert "T² of 2 parameters together: alarm, mostly of EX0C, EX0B (" in said
    assert "MEWMA of 2 parameters together: alarm, mostly of EX0C, EX0B (" in said
    assert main(["--db", str(path), "trend", "C", "--reference", "2030-01-01..2031-01-01"]) == 0
    said = capsys.readouterr().out
    assert "no chart: no run of the history lies in the reference period" in said


def test_a_parameter_that_never_varies_has_no_drift_and_no_part_in_the_vector(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(2)
    values = {name: rng.normal(size=(30, RUNS)) for name in ("EX0C", "EY0C")} | {
        "EX0B": np.full((30, RUNS), 3.0)
    }
    with Database(tmp_path / "still.duckdb") as db:
        add_machine(db, "S", values)
        document = trends(db, "S")
        table = {row["parameter"]: row for row in fleet(db)["table"]}
    assert document["parameters"]["EX0B"]["slope_per_year"] is None
    assert document["parameters"]["EX0B"]["why"] == "no drift of EX0B: it has the same value in every run"
    assert document["control"]["vector"]["parameters"] == ["EX0C", "EY0C"]
    assert table["EX0B"]["attention"] == "as usual"
    assert main(["--db", str(tmp_path / "still.duckdb"), "trend", "S", "--parameter", "EX0C"]) == 0
    said = capsys.readouterr().out
    assert "together" not in said
    # No longer than the 29 weeks that were seen.
    assert int(re.findall(r"check within (\d+) days, for EX0C", said)[0]) == 203
    assert "its drift was seen over 203 days only" in said


@pytest.mark.parametrize(("latest", "lines"), [(-45.03, 1), (19.9, 0)])
def test_what_is_beyond_its_limit_is_said_whatever_is_foretold(latest: float, lines: int) -> None:
    parameter = SimpleNamespace(
        mean=SimpleNamespace(latest=latest, latest_u=0.51), forecast=SimpleNamespace(limit=20.0), unit="µrad"
    )
    said = list(out_of_tolerance("EC0Y", parameter))
    assert said == [f"out of tolerance: EC0Y, {latest:.2f} µrad in the latest runs, limit 20 µrad"][:lines]


def test_a_headline_states_the_uncertainty_by_name_and_no_power_of_ten() -> None:
    step = SimpleNamespace(size=12345.6, u=950.0, unit="µrad", at="2026-03-05T08:00:00")
    line = headline("EB0C", SimpleNamespace(changes=[step]))
    assert line == "EB0C: changed by +12350 µrad (u = 950 µrad) on 2026-03-05"
    drift = SimpleNamespace(slope_per_year=-2960.0, u_slope=166.0, p_value=0.5, verdict=None)
    slope = SimpleNamespace(changes=[], drift=drift, unit="µm")
    assert headline("EXX", slope) == "EXX: −2960 µm a year (u = 170 µm a year), no drift seen"


def test_a_steep_slope_of_two_months_is_told_and_not_called_a_drift(tmp_path: Path) -> None:
    """Sixty days, thirty scatters: whatever it is, it is said by trend, figure, report and fleet, and forecast."""
    rng = np.random.default_rng(3)
    t = np.arange(60.0)
    steady = np.zeros(60, dtype=np.bool_)
    values = 0.5 * t + rng.normal(size=60)
    series = Series("EXX", "µm", values, np.ones(60), t, np.arange(60), np.zeros(60), steady, timedelta())
    piece = PieceDrift(series, -np.inf)
    said = drift_statement(piece)
    assert said.verdict is SlopeVerdict.DRIFT_OR_SEASON
    assert said.p_value < 1e-6
    assert said.season_p > 0.05
    assert said.slope_interval[0] < 0.0
    title = headline("EXX", SimpleNamespace(changes=[], drift=said, unit="µm"))
    assert title.endswith("; drift or season cannot be told apart")
    drift = stated_drift(piece, drift_forecast(piece, 40.0))
    assert drift.season_not_told
    assert drift.crosses_at is not None
    row = "drifts out of tolerance within a year"
    assert attention_words(row, None) == row
    assert "drifts" not in attention_words(row, True)
    assert attention_words("as usual", True) == "as usual"
    # A recorded temperature that has nothing to do with it answers for the season.
    warm = replace(series, temperature=rng.normal(size=60), thermometer="ambient_degC")
    assert drift_statement(PieceDrift(warm, -np.inf)).verdict is SlopeVerdict.DRIFT


def test_parameters_that_were_measured_together_share_one_search(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(12)
    days = np.repeat(np.arange(20), 3)
    t = 7.0 * days + np.tile([0.3, 0.4, 0.5], 20)
    weighs = rng.uniform(0.5, 2.0, 60)

    def series(name: str, u: np.ndarray) -> Series:
        steady = np.zeros(60, dtype=np.bool_)
        return Series(name, "µm", rng.normal(size=60), u, t, days, t % 1.0 * 24.0, steady, timedelta())

    every = [series("A", 0.3 * weighs), series("B", 0.07 * weighs), series("C", np.full(60, 0.1))]
    asked = []

    def counted(values, *args, **options):
        asked.append((sorted(values), {name: u.tobytes() for name, u in options["u"].items()}))
        return find_changes(values, *args, **options)

    monkeypatch.setattr("monitor.workflow.history.changes.find_changes", counted)
    found = search_changes(every, [], false_alarm=0.05, seed=1)
    ((names, weights),) = asked
    assert names == ["A", "B", "C"]
    # Runs that weigh alike are simulated once; those of C all weigh the same.
    assert sorted(weights) == ["A", "B"]
    assert weights["A"] == weights["B"]
    assert list(found) == ["A", "B", "C"]


def test_a_change_that_passes_again_is_said_with_its_size_and_time_constant(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Against a fit of an exponential by scipy; ``trend`` said nothing of it, and the weekly report neither."""
    rng = np.random.default_rng(401)
    week = np.arange(WEEKS)[:, np.newaxis]
    values = {
        "EX0B": 3.0 + 8.0 * np.exp(-week / 4.0) + 0.5 * rng.normal(size=(WEEKS, RUNS)),
        "EY0C": -2.0 - 8.0 * np.exp(-week / 4.0) + 0.5 * rng.normal(size=(WEEKS, RUNS)),
        "EZ0B": 0.5 * rng.normal(size=(WEEKS, RUNS)),
    }
    path = tmp_path / "m.duckdb"
    with Database(path) as db:
        add_machine(db, "M", values)
        answer = trends(db, "M")
    for name, sign, side in (("EX0B", 1.0, "above"), ("EY0C", -1.0, "below")):
        ((change,), changes) = answer["parameters"][name]["drifts"], answer["parameters"][name]["changes"]
        assert (change["kind"], changes) == ("transient", [])
        fit, covariance = curve_fit(
            lambda t, level, size, tau: level + size * np.exp(-t / tau),
            np.repeat(7.0 * np.arange(WEEKS), RUNS),
            values[name].ravel(),
            (0.0, sign, 30.0),
        )
        # The time constant is the nearest of five that are tried, and the size goes with it.
        assert 0.6 < change["time_constant_days"] / fit[2] < 1.7
        assert abs(change["size"] - fit[1]) < 4.0 * np.hypot(change["u"], np.sqrt(covariance[1, 1]))
        assert main(["--db", str(path), "trend", "M", "--parameter", name]) == 0
        out = capsys.readouterr().out
        assert re.search(
            rf"^from 2024-01-01 \d\d:\d\d on: {name} began [\d.]+ µm \(u = 0\.\d+ µm\) {side} where",
            out,
            re.M,
        )
        assert f"with a time constant of about {change['time_constant_days']:.2g} days (a transient" in out
    assert answer["parameters"]["EZ0B"]["drifts"] == []


def test_a_drift_has_one_slope_with_one_uncertainty(made: Any) -> None:
    """The list of drifts had that of the search, which takes days as independent."""
    document = trends(made, "M")["parameters"]["EX0B"]
    (drift,) = [change for change in document["drifts"] if change["kind"] == "trend"]
    stated = (document["slope_per_year"], document["u_slope"], document["p_value"])
    assert (drift["size"], drift["u"], drift["p_value"]) == pytest.approx(stated)
    # 0.2 µm a week.
    assert drift["size"] == pytest.approx(0.2 * 365.25 / 7.0, abs=4.0 * drift["u"])


def test_what_is_out_of_tolerance_is_the_first_line(
    made: Database, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = trend(made, TrendRequest("M"))
    found = answer.parameters["EX0C"]
    limited = replace(found, forecast=replace(found.forecast, limit=0.5 * abs(found.mean.latest)))
    say(replace(answer, parameters={**answer.parameters, "EX0C": limited}, notes=("a note",)))
    first, *others = capsys.readouterr().out.splitlines()
    assert first.startswith("out of tolerance: EX0C, ")
    assert not any(line.startswith("out of tolerance: EX0C") for line in others)
