"""A recorded event on a machine that drifts: its step is stated, the drift is none, and neither is called scatter."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from monitor.cli.agreement_output import agreement_line
from monitor.cli.trend_output import _event_step
from monitor.reporting.lacks import Undecided
from monitor.store import Database, MachineEvent, MachineHistory
from monitor.workflow.history.agreement import agreement
from monitor.workflow.history.event_steps import event_steps
from monitor.workflow.history.past import machine_past, splitting_events
from monitor.workflow.trend.answer import StepAtEvent

START = datetime(2026, 2, 2, 8, tzinfo=UTC)


def history(levels: list[float], names: tuple[str, ...] = ("EC0Y",), seed: int = 28) -> MachineHistory:
    """Campaigns thirty days apart, of two days of two runs each; every parameter at the same levels."""
    rng = np.random.default_rng(seed)
    count, runs = len(levels), 4 * len(levels)
    day = np.tile([1, 1, 2, 2], count)
    at = tuple(START + timedelta(days=30 * (i // 4) + int(day[i] - 1), hours=i % 2) for i in range(runs))
    values = np.repeat(levels, 4)[:, None] + rng.normal(size=(runs, len(names)))
    text = np.full(runs, "samba")
    return MachineHistory(
        machine="VD", campaigns={i: f"vd{i}" for i in range(count)},
        campaign=np.repeat([f"vd{i}" for i in range(count)], 4), method=text, measured_by=text,
        run=np.tile(np.arange(1, 5), count), started_at=at, day=day, warm_up=np.zeros(runs, dtype=np.bool_),
        parameters=names, units=("µrad",) * len(names), values=values, u=np.ones_like(values), conditions={},
        tolerances={}, unidentified=(),
    )  # fmt: skip


def event(after: int) -> MachineEvent:
    return MachineEvent(START + timedelta(days=30 * after - 15), "compensation", "squareness")


@pytest.fixture
def db(tmp_path):
    with Database(tmp_path / "m.duckdb", threads=1) as opened:
        yield opened


def test_a_compensation_after_seven_months_of_drift_is_a_step_and_said_to_move(db):
    machine = history([10.0, 13.0, 16.0, 19.0, 22.0, 25.0, 28.0, 8.0])
    (pair,) = agreement(db, machine, [event(7)])
    result = pair.parameters["EC0Y"]
    assert pair.disagree == ("EC0Y",)
    assert result.difference - result.expected_of_drift == pytest.approx(-23.0, abs=2.5)
    assert abs(result.e_n) > 4.0
    assert result.drift_in_30_days == pytest.approx(3.0, abs=0.5)
    line = agreement_line(pair)
    assert "EC0Y 28" in line
    assert "beside a drift in 30 days of EC0Y +3" in line
    past = machine_past(machine, splitting_events([event(7)]))
    (step,) = event_steps(past, [event(7)])
    assert step.decided
    assert step.size == pytest.approx(-23.0, abs=2.5)
    shown = StepAtEvent(
        "2026-08-15T00:00:00+00:00", "compensation", "squareness", step.size, step.u, "µrad", step.p_value, "days",
        True, drift_in_30_days=step.drift,
    )  # fmt: skip
    assert "beside a drift of +3" in _event_step("EC0Y", shown)


def test_a_drift_alone_is_no_step_and_said_to_be_the_drift(db):
    machine = history([10.0 + 22.0 * i for i in range(8)], seed=29)
    (pair,) = agreement(db, machine, [event(5)])
    assert pair.disagree == ()
    assert pair.parameters["EC0Y"].agree is True
    assert "nothing moved beyond the scatter of runs and days and the drift" in agreement_line(pair)
    assert event_steps(machine_past(machine, splitting_events([event(5)])), [event(5)]) == ()


def test_three_campaigns_do_not_tell_a_drift_from_a_step_and_that_is_said(db):
    """Nothing was known of what lies between campaigns: 22 µrad a month, called a step of 22 µrad."""
    machine = history([10.0, 32.0, 54.0])
    (pair,) = agreement(db, machine, [event(2)])
    result = pair.parameters["EC0Y"]
    assert (result.agree, result.why_not_decided) == (None, Undecided.DRIFT_MAY_DO)
    assert "EC0Y not decided: a drift that goes on through the event" in agreement_line(pair)
    steps = event_steps(machine_past(machine, splitting_events([event(2)])), [event(2)])
    assert [step.undecided for step in steps] in ([], [Undecided.DRIFT_MAY_DO])


def test_a_step_of_one_of_thirteen_is_found_among_those_that_drift():
    names = tuple(f"E{letter}0{axis}" for letter in "ABC" for axis in "XYZB")
    machine = history([3.0 * i for i in range(8)], names)
    machine.values[machine.campaign == "vd7", 4] -= 25.0
    steps = event_steps(machine_past(machine, splitting_events([event(7)])), [event(7)])
    assert [step.parameter for step in steps if step.decided] == [names[4]]


@pytest.mark.parametrize(("jump", "calls"), [(1, [True, False]), (2, [False, True])])
def test_a_campaign_that_two_events_cut_is_judged_at_each_by_its_own_runs(db, jump, calls):
    """A jump at one was called at the other, too: all of the campaign's runs before the event stood for its last."""
    machine = history([10.0] * 6)
    cut = machine.campaign == "vd3"
    moments = [machine.started_at[index] + timedelta(minutes=30) for index in np.flatnonzero(cut)[[0, 2]]]
    later = [at > moments[jump - 1] for at in machine.started_at]
    machine.values[later] += 100.0
    events = [MachineEvent(at, "repair", f"number {number}") for number, at in enumerate(moments, 1)]
    pairs = {pair.description: pair.parameters["EC0Y"] for pair in agreement(db, machine, events)}
    differences = [pairs[f"number {number}"].difference for number in (1, 2)]
    assert [abs(difference) > 50.0 for difference in differences] == calls
    assert pairs[f"number {3 - jump}"].agree is not False


def test_a_campaign_among_another_is_not_judged_in_its_place(db):
    """The pair names the campaign of the nearest runs; the one whose mean time is nearest was judged."""
    machine = history([10.0] * 8)
    # vd6 begins before vd5 and ends behind it.
    first, last = np.flatnonzero(machine.campaign == "vd6")[[0, -1]]
    at = list(machine.started_at)
    at[first : last + 1] = [START + timedelta(days=day) for day in (146, 146.1, 186, 186.1)]
    machine = replace(machine, started_at=tuple(at))
    order = np.argsort([moment.timestamp() for moment in at])
    machine = replace(
        machine, campaign=machine.campaign[order], run=machine.run[order], day=machine.day[order],
        values=machine.values[order], started_at=tuple(at[index] for index in order),
    )  # fmt: skip
    machine.values[machine.campaign == "vd5"] += 50.0
    (pair,) = agreement(db, machine, [MachineEvent(START + timedelta(days=140), "repair", "spindle")])
    result = pair.parameters["EC0Y"]
    assert pair.campaigns == ("vd4", "vd6")
    assert result.e_n * result.expanded + result.expected_of_drift == pytest.approx(
        result.difference, abs=1e-9
    )
