"""One past of a machine: trend page, health report and fleet table state the same of the same runs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from by_path import load
from scipy import stats

from monitor.readers import read_campaign
from monitor.store import Database, import_campaign, machine_history
from monitor.store.events import record_event
from monitor.workflow.fleet.answer import FleetTableRow
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.report import report, stored_health
from monitor.workflow.health.request import ReportRequest
from monitor.workflow.health.weeks import week_named
from monitor.workflow.history.changes import FALSE_ALARM, SEED
from monitor.workflow.history.past import machine_past
from monitor.workflow.history.weekly_looks import weekly_notices
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
DAY_S = 86400.0
MADE = datetime.fromisoformat("2026-04-06T06:00:00+00:00")

# A half year of weekly campaigns that lead to the example `cold-cold`.
drifting = load("test_trend_volumetric", Path(__file__).with_name("test_trend_volumetric.py"))
path = drifting.path
synthetic = load("test_trends", Path(__file__).with_name("test_trends.py"))


@pytest.fixture(scope="module")
def stepped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """The example with the reset of the B axis."""
    with Database(tmp_path_factory.mktemp("one-past") / "m.duckdb", threads=1) as db:
        import_campaign(db, read_campaign(EXAMPLES / "five-days"))
        identify(db, IdentifyRequest("five-days"))
        yield db


def reported(db: Database, week: str, out: Path, pdf_unread):
    with pdf_unread():
        answer = report(db, ReportRequest(week, out=out, made_at=MADE))
    # Of weekly looks it says what page and fleet table say of that week.
    page = trend(db, TrendRequest("HU40-T", weekly_looks=True)).weekly_looks
    table = fleet(db, FleetRequest(top=1, weekly_looks=True)).weekly_looks
    assert page == table
    assert answer.weekly_looks == weekly_notices(db, week_named(week)).of_machines({"HU40-T"}, week)
    assert answer.weekly_looks.notices == page.of_machines({"HU40-T"}, week).notices
    ((number,),) = db.rows("SELECT max(analysis_id) FROM v_analyses WHERE kind = 'health'")
    return stored_health(db, number)


@pytest.mark.slow
def test_the_reset_of_the_b_axis_is_one_change_for_page_and_report(
    stepped: Database, tmp_path: Path, pdf_unread
) -> None:
    page = trend(stepped, TrendRequest("HU40-T"))
    assert (page.false_alarm, page.seed) == (FALSE_ALARM, SEED) == (0.01, 20260302)
    # The last runs were in week 11: a report of week 10 has not seen them yet.
    health = reported(stepped, "2026-W11", tmp_path, pdf_unread)
    past = machine_past(machine_history(stepped, "HU40-T", model="samba"), [])
    on_page = {name: parameter.changes for name, parameter in page.parameters.items() if parameter.changes}
    assert set(on_page) == {"EB0C"}
    (change,) = on_page["EB0C"]
    (noted,) = [noted for noted in health.changes if noted.after is not None]
    (found,) = past["EB0C"].search.changes
    # The same p-value, size and uncertainty, to the last bit; the report rounds what it says in words.
    assert change.p_value == noted.p_value == found.p_value < FALSE_ALARM
    assert (change.size, change.u) == (found.size, found.u)
    assert noted.what == "EB0C stepped by +15.10 µrad (u = 0.83 µrad)"
    assert change.at is not None
    assert change.at[:19] == f"{noted.at:%Y-%m-%dT%H:%M:%S}"
    assert change.interval[0] is not None
    assert noted.after is not None
    assert change.interval[0][:19] == f"{noted.after:%Y-%m-%dT%H:%M:%S}"
    (parameter,) = [one for one in health.parameters if one.name == "EB0C"]
    assert [f"{at:%Y-%m-%dT%H:%M:%S}" for at in parameter.changed_at] == [change.at[:19]]
    # Neither states a slope a year of five days.
    assert page.parameters["EB0C"].drift.slope_per_year is None
    assert parameter.drift is None


def test_last_values_are_those_of_the_last_day(stepped: Database, tmp_path: Path, pdf_unread) -> None:
    page = trend(stepped, TrendRequest("HU40-T"))
    table = {row.parameter: row for row in fleet(stepped, FleetRequest(top=0)).table}
    health = reported(stepped, "2026-W11", tmp_path, pdf_unread)
    history = machine_history(stepped, "HU40-T")
    for name, parameter in page.parameters.items():
        assert table[name].latest == pytest.approx(parameter.mean.latest, rel=1e-12, abs=1e-12)
        assert table[name].unit == parameter.unit
        assert table[name].slope_per_year is None
    for stated in health.parameters:
        column = history.parameters.index(stated.name)
        assert stated.history.values == tuple(history.values[:, column].tolist())
        # The report's estimate is that of its last run.
        assert stated.estimate == pytest.approx(stated.history.values[-1], rel=1e-9)


@pytest.mark.slow
def test_a_drift_of_months_is_one_line(path: Path, tmp_path: Path, pdf_unread) -> None:
    with Database(path, threads=1) as db:
        # The past weeks were written by SQL: that each of their runs was identified is written, too.
        db.execute(
            "INSERT INTO identified_run SELECT DISTINCT identification_id, run, 1e-3, 1, 1, 1.0, []::DOUBLE[], '[]' "
            "FROM parameter_value ANTI JOIN identified_run USING (identification_id, run)"
        )
        # Limits that the drifts reach in one and a half years: further ahead than the history is long.
        limits = {
            name: abs(parameter.mean.latest) + 1.5 * abs(parameter.drift.slope_per_year)
            for name, parameter in trend(db, TrendRequest("HU40-T")).parameters.items()
            if parameter.drift.p_value is not None and parameter.drift.p_value < 1e-4
        }
        db.execute(
            "UPDATE imported_campaign SET machine_description = json_merge_patch(machine_description, ?)",
            [json.dumps({"tolerances": limits})],
        )
        page = trend(db, TrendRequest("HU40-T"))
        ((last,),) = db.rows("SELECT max(started_at_local) FROM v_runs")
        week = f"{last.isocalendar().year}-W{last.isocalendar().week:02d}"
        health = reported(db, week, tmp_path, pdf_unread)
    stated = {parameter.name: parameter for parameter in health.parameters}
    compared = dated = 0
    for name, parameter in page.parameters.items():
        drift, of_report = parameter.drift, stated[name].drift
        assert [change.at[:19] for change in parameter.changes if change.at] == [
            f"{at:%Y-%m-%dT%H:%M:%S}" for at in stated[name].changed_at
        ]
        if drift.slope_per_year is None:
            assert of_report is None
            continue
        assert of_report is not None
        assert (of_report.per_year, of_report.u_per_year) == (drift.slope_per_year, drift.u_slope)
        assert of_report.between == drift.slope_interval
        assert of_report.p_value == drift.p_value
        # The day at the limit and the ends of its interval, which is beyond the history that both read.
        ahead = parameter.forecast
        dates = (ahead.crosses_limit_at, *(ahead.crosses_limit_interval or (None, None)))
        assert [None if at is None else at[:10] for at in dates] == [
            None if at is None else f"{at}" for at in (of_report.crosses_at, *of_report.crosses_between)
        ]
        dated += ahead.crosses_limit_at is not None
        compared += 1
    assert compared > 3
    # Their calibrations were not stored with them: the u of all of them counts, and only the fastest has a date.
    assert dated > 0
    # Both recommend the same next check: the first parameter that may be out of tolerance then.
    intervals = {
        name: parameter.forecast.recommended_interval_days
        for name, parameter in page.parameters.items()
        if parameter.forecast.recommended_interval_days is not None
    }
    soonest = min(intervals, key=intervals.__getitem__)
    ends = last + timedelta(days=intervals[soonest])
    assert f"{ends.date()}" in health.next_check


def test_fleet_and_page_fit_the_same_line_where_days_are_alike(tmp_path: Path) -> None:
    """Days of as many runs, of one uncertainty, and no change: there the two definitions of the drift are one."""
    rng = np.random.default_rng(8)
    week = np.arange(40)[:, np.newaxis]
    values = {
        "EX0B": 5.0 + 0.2 * week + rng.normal(size=(40, 1)) + 0.5 * rng.normal(size=(40, 4)),
        "EX0C": rng.normal(size=(40, 1)) + 0.5 * rng.normal(size=(40, 4)),
    }
    with Database(tmp_path / "alike.duckdb") as db:
        synthetic.add_machine(db, "M", values)
        page = trend(db, TrendRequest("M"))
        table = {row.parameter: row for row in fleet(db, FleetRequest(top=0)).table}
    for name, parameter in page.parameters.items():
        row, drift = table[name], parameter.drift
        assert parameter.changes == ()
        assert row.slope_per_year == pytest.approx(drift.slope_per_year, rel=1e-6)
        assert row.u_slope == pytest.approx(drift.u_slope, rel=1e-3)
        assert row.drift_p == pytest.approx(drift.p_value, rel=1e-2)
        assert row.latest == pytest.approx(parameter.mean.latest, rel=1e-12)
    # The same day at the limit: ± 20 µm, from the line of the days on, not from the scatter of the last of them.
    row, ahead = table["EX0B"], page.parameters["EX0B"].forecast
    assert ahead.crosses_limit_at is not None
    assert row.latest_at is not None
    assert row.years_to_limit is not None
    crossing, latest = (datetime.fromisoformat(at) for at in (ahead.crosses_limit_at, row.latest_at))
    assert crossing.timestamp() / DAY_S == pytest.approx(
        latest.timestamp() / DAY_S + row.years_to_limit * 365.25, abs=1.0
    )


def _touched_at(db: Database, degrees: np.ndarray) -> None:
    """Two touches a run, in the order of the runs, whose channel is half a kelvin above and below ``degrees``."""
    runs = db.rows("SELECT campaign_id, run FROM run ORDER BY ALL")
    frame = pd.DataFrame(runs, columns=["number", "run"]).assign(degc=degrees.ravel())
    for touch, away in ((1, 0.5), (2, -0.5)):
        db.insert(
            f"INSERT INTO probing SELECT number, {touch}, run, {touch}, 0.0, '', MAP {{}}, "
            f"MAP {{'B_axis_degC': degc + {away}}} FROM incoming",
            frame,
        )


@pytest.mark.parametrize(
    ("source", "weeks"),
    [
        ("runs", 12),
        ("touches", 40),
        ("one run without", 70),
        *(
            pytest.param(source, weeks, marks=pytest.mark.all_seeds)
            for source, weeks in (
                ("runs", 40),
                ("runs", 70),
                ("touches", 12),
                ("touches", 70),
                ("one run without", 12),
                ("one run without", 40),
            )
        ),
    ],
)
@pytest.mark.slow
def test_fleet_and_page_fit_the_same_temperature_beside_the_line(
    tmp_path: Path, weeks: int, source: str
) -> None:
    """A recorded temperature is in the null of both, whether of the runs or of the touches, and since an event."""
    rng = np.random.default_rng(weeks)
    week = np.arange(weeks)[:, np.newaxis]
    degrees = (21.0 + 2.0 * np.sin(week / 9.0) + 0.5 * rng.normal(size=(weeks, 1))) * np.ones((1, 4))
    values = {
        "EX0B": 1.5 * (degrees - 20.0) + 0.5 * rng.normal(size=(weeks, 4)),
        "EX0C": 0.1 * week + 1.5 * (degrees - 20.0) + 0.5 * rng.normal(size=(weeks, 4)),
    }
    with Database(tmp_path / "warm.duckdb") as db:
        synthetic.add_machine(db, "M", values, degrees)
        if source != "runs":
            # A run without a temperature of its own; touches have one for every run, or there is none for all.
            without = "campaign_id > 0" if source == "touches" else "campaign_id = 3 AND run = 2"
            db.execute(f"UPDATE run SET conditions = MAP {{}} WHERE {without}")
            db.execute("DELETE FROM campaign_runs")
            synthetic.gather_runs(db)
        if source == "touches":
            _touched_at(db, degrees)
        tables = {}
        for kind in ("whole", "since"):
            if kind == "since":
                third = synthetic.START + timedelta(weeks=weeks // 3, days=-1)
                record_event(db, "M", third.replace(tzinfo=UTC), "repair", "new scales")
            page = trend(db, TrendRequest("M"))
            tables[kind] = page, {row.parameter: row for row in fleet(db, FleetRequest(top=0)).table}
    thermometer = {"runs": "ambient_degC", "touches": "B_axis_degC", "one run without": None}[source]
    for kind, (page, table) in tables.items():
        # The third campaign lies before the event.
        beside = "ambient_degC" if kind == "since" and thermometer is None else thermometer
        for name, parameter in page.parameters.items():
            row, drift = table[name], parameter.drift
            if parameter.changes:
                continue
            assert (row.temperature, drift.temperature) == (beside, beside)
            # With the wave of a year the fleet's line is that of the blocks.
            near = 1.5 * drift.u_slope if weeks > 52 else 1e-6
            assert row.slope_per_year == pytest.approx(drift.slope_per_year, rel=1e-6, abs=near)
            assert row.u_slope == pytest.approx(drift.u_slope, rel=2e-3)
        assert any(not parameter.changes for parameter in page.parameters.values())


@pytest.mark.slow
def test_a_machine_that_follows_its_temperature_does_not_drift_in_the_fleet(tmp_path: Path) -> None:
    """Thirty machines follow a season of two kelvin over 26 weeks, with and without a thermometer."""
    rng = np.random.default_rng(4)
    weeks, machines = 26, 30
    with Database(tmp_path / "season.duckdb") as db:
        for i in range(machines):
            phase = rng.uniform(0.0, 2.0 * np.pi)
            degrees = 20.0 + 2.0 * np.cos(2.0 * np.pi * np.arange(weeks)[:, np.newaxis] / 52.0 + phase)
            degrees = (degrees + 0.5 * rng.normal(size=(weeks, 1))) * np.ones((1, 4))
            values = 2.0 * (degrees - 20.0) + rng.normal(size=(weeks, 1)) + rng.normal(size=(weeks, 4))
            synthetic.add_machine(db, f"M{i}", {"EXX": values}, degrees)
        with_it = fleet(db, FleetRequest(top=0)).table
        db.execute("UPDATE run SET conditions = MAP {}")
        without = fleet(db, FleetRequest(top=0)).table

    def called(rows: tuple[FleetTableRow, ...]) -> int:
        return sum(row.drift_p is not None and row.drift_p < 0.05 and not row.season_not_told for row in rows)

    # Without one the season may be all of a slope: then it is said to move, and not to drift.
    assert called(without) <= 4
    assert sum(row.drift_p is not None and row.drift_p < 0.05 for row in without) >= 6
    # 1.5 of 30 expected; more than 5 in 0.3 % of such samples.
    assert called(with_it) <= 5


def _following(rng: np.random.Generator, weeks: int, correlation: float) -> np.ndarray:
    """Weekly values, each like the one before, of unit variance."""
    values = rng.normal(size=weeks)
    for i in range(1, weeks):
        values[i] = correlation * values[i - 1] + np.sqrt(1.0 - correlation**2) * values[i]
    return values


def test_the_ranking_and_the_recommended_interval_rest_on_days_that_follow_each_other(tmp_path: Path) -> None:
    """Ten machines wander without a drift, one drifts: a line through independent days calls half of them."""
    weeks, plain = 40, 0
    rng = np.random.default_rng(31)
    with Database(tmp_path / "following.duckdb") as db:
        wandering = {}
        for i in range(10):
            days = 2.0 * _following(rng, weeks, 0.8)[:, np.newaxis]
            wandering[f"W{i}"] = days + 0.3 * rng.normal(size=(weeks, 4))
            line = stats.linregress(7.0 * np.arange(weeks), wandering[f"W{i}"].mean(axis=1))
            plain += line.pvalue < 0.05
            synthetic.add_machine(db, f"W{i}", {"EXX": wandering[f"W{i}"]})
        drifting = 0.3 * np.arange(weeks)[:, np.newaxis] + rng.normal(size=(weeks, 4))
        synthetic.add_machine(db, "D", {"EXX": drifting})
        # The same values of the worst wanderer in an order that says nothing: there days are independent.
        worst = max(
            wandering, key=lambda name: abs(np.polyfit(range(weeks), wandering[name].mean(axis=1), 1)[0])
        )
        synthetic.add_machine(db, "S", {"EXX": wandering[worst][rng.permutation(weeks)]})
        table = {row.machine: row for row in fleet(db, FleetRequest(top=0)).table}
        pages = {name: trend(db, TrendRequest(name)).parameters["EXX"] for name in (worst, "S")}
    assert plain >= 4
    assert "drift" in table["D"].attention
    called = [name for name in wandering if "drift" in table[name].attention]
    assert len(called) <= 1
    # The interval of the slope, from which the recommended interval is taken, is that of days that follow each other.
    assert table[worst].slope_widening > 1.5
    soon, late = (pages[name].forecast.recommended_interval_days for name in (worst, "S"))
    assert soon < 0.7 * late


def test_one_check_run_after_days_of_many_does_not_stand_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(5)
    gather_values, gather_runs = synthetic.gather_values, synthetic.gather_runs
    monkeypatch.setattr(synthetic, "gather_values", lambda db: None)
    monkeypatch.setattr(synthetic, "gather_runs", lambda db: None)
    with Database(tmp_path / "check.duckdb") as db:
        for i in range(12):
            values = {name: rng.normal(size=(9, 10)) for name in ("EXX", "EYY", "EZZ")}
            synthetic.add_machine(db, f"M{i}", values)
        # Of the last campaign of each machine one run is left.
        last = "(SELECT max(campaign_id) FROM imported_campaign GROUP BY machine)"
        db.execute(f"DELETE FROM parameter_value WHERE identification_id IN {last} AND run > 1")
        db.execute(f"DELETE FROM run WHERE campaign_id IN {last} AND run > 1")
        db.execute(f"UPDATE identification SET run_count = 1 WHERE identification_id IN {last}")
        gather_values(db)
        gather_runs(db)
        rows = fleet(db, FleetRequest(top=0)).table
    assert len(rows) == 36
    assert sum(row.attention == "the latest day stands out" for row in rows) <= 1


@pytest.mark.slow
def test_a_report_of_an_earlier_week_knows_what_was_known_then(
    stepped: Database, tmp_path: Path, pdf_unread
) -> None:
    health = reported(stepped, "2026-W10", tmp_path, pdf_unread)
    history = machine_history(stepped, "HU40-T", model="samba")
    before = [at.replace(tzinfo=None) < datetime(2026, 3, 9) for at in history.started_at]
    past = machine_past(history.part(np.array(before)), [])
    (noted,) = [noted for noted in health.changes if noted.after is not None]
    (change,) = past["EB0C"].search.changes
    assert len(before) > sum(before)
    assert noted.p_value == change.p_value < FALSE_ALARM
