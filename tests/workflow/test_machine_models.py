"""A model per machine: chosen with a reason, taken by every verb, its added effects parameters with a history."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from by_path import load, simulator
from scipy import stats

from monitor.exceptions import CampaignError, EffectError, InputError, NotFoundError
from monitor.reporting.health.records import MachineHealth, State
from monitor.store import Database, import_campaign, load_campaign, machine_runs, verify_audit
from monitor.store.past.history import latest_tolerances
from monitor.workflow.fleet.fleet import fleet
from monitor.workflow.fleet.request import FleetRequest
from monitor.workflow.health.machine import machine_health, named_machines, read_week
from monitor.workflow.health.request import ReportOptions
from monitor.workflow.health.task import computed
from monitor.workflow.health.weeks import week_of
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportRequest, import_folders
from monitor.workflow.model.change import add_effect, affected
from monitor.workflow.model.request import AddEffectRequest, UseModelRequest
from monitor.workflow.model.use import use_model
from monitor.workflow.models import resolve, resolve_for
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import trend

MONTHS = 9
#: µm of backlash in the first month and more in each that follows; half of it is the amplitude of EXX:reversal.
FIRST_UM, MORE_UM = 2.0, 0.8
BACKLASH = "EXX:reversal"
#: Reached in the seventh month.
LIMIT_UM = 7.0
WHY = "backlash of X noticed in May"


@pytest.fixture(scope="module")
def worn(tmp_path_factory):
    """A machine measured on two days a month, whose backlash grows, and another on which nothing happens."""
    virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery" / "virtual.py")
    sim = simulator()
    db = Database(tmp_path_factory.mktemp("worn") / "monitor.duckdb")
    for month in range(MONTHS):
        backlash = sim.Effect(BACKLASH, coefficients=(FIRST_UM + MORE_UM * month) * 1e-3)
        campaign, _ = virtual.virtual(100 + month, [backlash], days=2, runs_per_day=2, runs=4)
        runs = tuple(
            replace(run, started_at=run.started_at + timedelta(days=30 * month)) for run in campaign.runs
        )
        import_campaign(db, replace(campaign, name=f"month-{month + 1}", runs=runs))
    other, _ = virtual.virtual(99, days=1, runs_per_day=3, runs=3)
    limited = replace(other.machine, id="W", tolerances={BACKLASH: LIMIT_UM})
    import_campaign(db, replace(other, name="other", machine=limited))
    add_effect(db, AddEffectRequest(BACKLASH, "samba", "with-backlash", campaign="month-1"))
    yield db
    db.close()


@pytest.mark.slow
def test_the_backlash_that_grows_is_a_trend_of_the_machine_that_has_the_model(worn):
    assert BACKLASH not in trend(worn, TrendRequest("V")).parameters
    answer = use_model(worn, UseModelRequest("with-backlash", "V", WHY))
    assert (answer.before, answer.model, answer.failed) == ("samba", "with-backlash", {})
    assert answer.identified == tuple(f"month-{month + 1}" for month in range(MONTHS))
    followed = trend(worn, TrendRequest("V")).parameters
    drift = followed[BACKLASH].drift
    # The truth: 0.8 µm in 30 days; the effect is the sign of the last travel times the coefficient.
    assert drift.slope_per_year == pytest.approx(MORE_UM / 30.0 * 365.25, abs=3.0 * drift.u_slope)
    assert followed[BACKLASH].q_value < 1e-3
    rows = {row.parameter: row for row in fleet(worn, FleetRequest(top=0)).table if row.machine == "V"}
    assert rows[BACKLASH].attention in ("drifts", "drifts out of tolerance within a year")
    assert rows[BACKLASH].slope_per_year == pytest.approx(MORE_UM / 30.0 * 365.25, rel=0.1)
    assert verify_audit(worn).ok


def test_the_other_machine_keeps_the_methods_own_model(worn):
    use_model(worn, UseModelRequest("with-backlash", "V", WHY))
    assert resolve_for(worn, None, "samba", "V").name == "with-backlash"
    assert resolve_for(worn, None, "samba", "W").name == "samba"
    assert resolve_for(worn, "samba", "samba", "V").name == "samba"
    identify(worn, IdentifyRequest("other"))
    assert {row.parameter for row in fleet(worn, FleetRequest(top=0)).table if row.machine == "W"}.isdisjoint(
        {BACKLASH}
    )


def test_what_each_run_says_of_an_effect_has_the_campaigns_value_for_its_mean(worn):
    """Against least squares of each run alone, by numpy, of the linearised problem."""
    from monitor.methods import campaign_method
    from monitor.methods.chain.problem import solve_problem
    from monitor.methods.chain.shared_effects import followed_effects
    from monitor.methods.model import Model
    from monitor.store import load_campaign

    campaign = load_campaign(worn, "month-3")
    problem = campaign_method(campaign).problem_of(campaign, Model("m", added=(BACKLASH,)))
    solution = solve_problem(problem)
    followed = followed_effects(problem, solution)
    at = solution.last
    for run in range(len(problem.runs)):
        columns = np.concatenate([at.local[run], at.common[run]], axis=1)
        scale = np.linalg.norm(columns, axis=0)
        step = np.linalg.lstsq(columns / scale, -at.residual[run], rcond=1e-6)[0] / scale
        assert followed.estimate[run, 0] == pytest.approx(solution.common[0] + step[-1], abs=1e-9)
    weights = 1.0 / followed.covariance[:, 0, 0]
    mean = float(weights @ followed.estimate[:, 0] / weights.sum())
    assert mean == pytest.approx(float(solution.common[0]), abs=1e-9)


def test_adding_without_another_name_says_for_whom_it_changes_the_model(worn):
    use_model(worn, UseModelRequest("with-backlash", "V", WHY))
    before = affected(worn, AddEffectRequest("EYY:reversal", "samba"))
    assert (before.name, before.next_version, before.in_use) == ("samba", 2, True)
    assert (before.changed, before.keep) == (("W",), ("V",))
    assert not affected(worn, AddEffectRequest("EYY:reversal", "samba", "another")).in_use
    assert resolve(worn, "samba").version == 1


def test_a_history_never_mixes_two_versions(worn):
    use_model(worn, UseModelRequest("samba", "V", "for comparison"))
    identify(worn, IdentifyRequest("month-1", "with-backlash"))
    answer = trend(worn, TrendRequest("V"))
    assert BACKLASH not in answer.parameters
    assert answer.runs == 4 * MONTHS


def test_refusals(worn):
    with pytest.raises(InputError, match="say why V is followed by another model: --reason TEXT"):
        UseModelRequest("with-backlash", "V", "  ")
    with pytest.raises(NotFoundError, match="there is no machine 'X'; there are V, W"):
        use_model(worn, UseModelRequest("with-backlash", "X", WHY))
    with pytest.raises(NotFoundError, match="there is no model 'none'"):
        use_model(worn, UseModelRequest("none", "V", WHY))
    with pytest.raises(EffectError, match="EQQ"):
        add_effect(worn, AddEffectRequest("EQQ:reversal", "samba", "wrong"))


def test_the_weekly_report_follows_the_added_effect(worn, tmp_path, pdf_unread):
    from datetime import date, datetime

    from monitor.workflow.health.report import report, stored_health
    from monitor.workflow.health.request import ReportRequest

    use_model(worn, UseModelRequest("with-backlash", "V", WHY))
    ((started,),) = worn.rows("SELECT max(started_at) FROM run")
    day: date = started.date()
    week = f"{day.isocalendar().year}-W{day.isocalendar().week:02d}"
    with pdf_unread():
        report(
            worn, ReportRequest(week=week, machine="V", out=tmp_path, workers=1, made_at=datetime(2027, 6, 1))
        )
    ((stored,),) = worn.rows("SELECT max(analysis_id) FROM analysis WHERE kind = 'health'")
    health = stored_health(worn, stored)
    (backlash,) = [parameter for parameter in health.parameters if parameter.name == BACKLASH]
    assert backlash.estimate == pytest.approx(FIRST_UM + MORE_UM * (MONTHS - 1), abs=4.0 * backlash.u)
    assert len(backlash.history.values) == 4 * MONTHS
    assert backlash.drift


def test_a_limit_of_an_effect_is_read_kept_and_refused_where_there_is_no_such_effect(
    worn: Database, tmp_path: Path
) -> None:
    assert latest_tolerances(worn)["W", BACKLASH] == LIMIT_UM
    folder = tmp_path / "limited"
    shutil.copytree(Path(__file__).resolve().parents[2] / "examples" / "five-days", folder)
    file = folder / "campaign.toml"
    stated = file.read_text(encoding="utf-8")
    table = len(stated.splitlines()) + 2
    file.write_text(
        f'{stated}\n[machine.tolerances]\n"EXX:reversl" = 5.0\n"EBB:harmonic2" = 5.0\n', encoding="utf-8"
    )
    with Database(tmp_path / "new.duckdb") as db:
        with pytest.raises(CampaignError, match=f"line {table + 1}, .*did you mean 'reversal'") as refused:
            import_folders(db, ImportRequest([folder]))
        assert f"line {table + 2}" in str(refused.value)
        assert "it has EBB:harmonic2.cos, EBB:harmonic2.sin" in str(refused.value)
        limits = {"EXX:reversal": 5.0, "EBB:harmonic2.cos": 6.0, "EXX:cyclic0.5mm.sin": 7.0, "EC0Y": 8.0}
        lines = "".join(f'"{name}" = {limit}\n' for name, limit in limits.items())
        file.write_text(f"{stated}\n[machine.tolerances]\n{lines}", encoding="utf-8")
        import_folders(db, ImportRequest([folder]))
        assert dict(load_campaign(db, "five-days").machine.tolerances) == limits


def _health_of_last_week(worn: Database) -> MachineHealth:
    """The page of V in the report of the week of its last run."""
    (name,) = [machine for machine in named_machines(worn) if machine.machine == "V"]
    last = machine_runs(worn, "V")[-1]
    past = read_week(worn, name, week_of(last.local_start.date()), ReportOptions())
    return machine_health(worn, past, computed(past.task))


def test_limits_of_a_type_that_hold_for_no_parameter_are_named_by_fleet_and_report(worn: Database) -> None:
    use_model(worn, UseModelRequest("with-backlash", "V", WHY))
    worn.type_tolerances = {"*": {"EB0C9": 5.0}}
    try:
        said = fleet(worn, FleetRequest()).limits_without_parameter
        health = _health_of_last_week(worn)
    finally:
        worn.type_tolerances = {}
    assert said is not None
    assert "W" not in said  # its campaign states its own
    (sentence,) = said["V"]
    assert sentence.startswith(
        "no limit holds: the machine type '*' in the configuration limits EB0C9, of which"
    )
    assert sentence in [str(remark) for remark in health.quality.remarks]


def test_an_effect_beyond_its_limit_alarms_in_trend_fleet_and_report(worn: Database) -> None:
    """The last month has 2.0 + 8 * 0.8 = 8.4 µm of 7; the probability is that of a normal law, by scipy."""
    use_model(worn, UseModelRequest("with-backlash", "V", WHY))
    worn.type_tolerances = {"*": {BACKLASH: LIMIT_UM}}
    try:
        followed = trend(worn, TrendRequest("V", parameter=BACKLASH))
        rows = {row.parameter: row for row in fleet(worn, FleetRequest(top=0)).table if row.machine == "V"}
        health = _health_of_last_week(worn)
    finally:
        worn.type_tolerances = {}
    assert followed.parameters[BACKLASH].forecast.limit == LIMIT_UM
    assert rows[BACKLASH].attention == "out of tolerance"
    (parameter,) = [each for each in health.parameters if each.name == BACKLASH]
    assert (health.state, parameter.tolerance) == (State.OUT_OF_TOLERANCE, LIMIT_UM)
    beyond = stats.norm(parameter.estimate, parameter.u)
    expected = float(beyond.sf(LIMIT_UM) + beyond.cdf(-LIMIT_UM))
    assert parameter.probability_out == pytest.approx(expected, abs=1e-9)
    assert health.probability_out == pytest.approx(expected, abs=1e-9)
