"""Steps at recorded events: size, uncertainty and p-value by other people's t test, rates over many machines, words."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from scipy import stats

from monitor.cli.trend_output import _event_step
from monitor.reporting.health.news import SteppedAtEvent
from monitor.reporting.lacks import Undecided
from monitor.store import MachineEvent
from monitor.workflow.history.changes import ChangeSearch
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.event_steps import event_steps
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import StepAtEvent

START = datetime(2026, 3, 2, 8, tzinfo=UTC)
REPAIR = MachineEvent(START + timedelta(days=2.5), "repair", "zero of B reset")


def _past(name, by_day):
    """A parameter whose runs of each day are the rows of an array."""
    days, runs = by_day.shape
    first = START.timestamp() / 86400.0
    t = first + np.repeat(np.arange(days), runs) + np.tile(np.arange(runs) * 0.05, days)
    series = Series(
        name, "µrad", by_day.ravel(), np.full(days * runs, 1.0), t, np.repeat(np.arange(days), runs),
        np.zeros(days * runs), np.zeros(days * runs, dtype=np.bool_), timedelta(),
    )  # fmt: skip
    return ParameterPast(
        series, np.ones(days * runs, dtype=np.bool_), ChangeSearch(), PieceDrift(series, -np.inf)
    )


def _runs(rng, days_before, days_after, step, day_sd):
    values = rng.standard_normal((days_before + days_after, 4)) + day_sd * rng.standard_normal(
        (days_before + days_after, 1)
    )
    values[days_before:] += step
    return values


def test_a_step_is_that_of_a_t_test_of_the_days():
    values = _runs(np.random.default_rng(2), 3, 4, 15.0, 1.0)
    (step,) = event_steps({"EB0C": _past("EB0C", values)}, [REPAIR])
    means = values.mean(axis=1)
    test = stats.ttest_ind(means[3:], means[:3])
    assert step.by_days
    assert step.size == pytest.approx(means[3:].mean() - means[:3].mean())
    assert step.u == pytest.approx(step.size / test.statistic)
    assert step.p_value == pytest.approx(test.pvalue)
    assert step.event is REPAIR


@pytest.mark.parametrize(("correlation", "decided"), [(0.6, False), (0.0, True)])
def test_steps_of_days_that_follow_each_other_are_named_as_not_decided(correlation, decided):
    rng = np.random.default_rng(23)
    called = named = 0
    for _ in range(200):
        past = {}
        for k in range(4):
            days = rng.standard_normal((10, 1))
            for i in (*range(1, 5), *range(6, 10)):
                days[i] = correlation * days[i - 1] + np.sqrt(1.0 - correlation**2) * days[i]
            past[f"E{k}"] = _past(f"E{k}", days + 0.5 * rng.standard_normal((10, 4)))
        event = MachineEvent(START + timedelta(days=4.5), "repair", "")
        steps = event_steps(past, [event])
        called, named = called + any(step.decided for step in steps), named + bool(steps)
    # Nominal 5 % of machines; independent days alone would call ``named`` of them.
    assert called / 200 < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 200)
    assert decided or named / 200 > 0.2


@pytest.mark.parametrize(("days", "runs", "after"), [(8, 3, 1), (6, 10, 1), (9, 10, 2)])
def test_a_check_of_few_runs_after_days_of_many_is_no_step(days, runs, after):
    rng = np.random.default_rng([days, runs, after])
    first = START.timestamp() / 86400.0
    day = np.repeat(np.arange(days + 1), [*[runs] * days, after])
    t = first + day + 0.01 * np.arange(len(day)) / len(day)
    event = MachineEvent(START + timedelta(days=days - 0.5), "repair", "")
    called = 0
    for _ in range(150):
        past = {}
        for k in range(4):
            series = Series(
                f"E{k}", "µrad", rng.standard_normal(len(day)), np.ones(len(day)), t, day, np.zeros(len(day)),
                np.zeros(len(day), dtype=np.bool_), timedelta(),
            )  # fmt: skip
            past[f"E{k}"] = ParameterPast(
                series, np.ones(len(day), dtype=np.bool_), ChangeSearch(), PieceDrift(series, -np.inf)
            )
        called += bool(event_steps(past, [event]))
    assert called / 150 < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 150)


def test_a_note_and_an_event_without_runs_on_both_sides_state_nothing():
    past = {"EB0C": _past("EB0C", _runs(np.random.default_rng(2), 3, 4, 15.0, 1.0))}
    early = MachineEvent(START - timedelta(days=9), "repair", "before all runs")
    assert event_steps(past, [MachineEvent(REPAIR.at, "note", "looked at"), early]) == ()


def test_one_day_before_and_one_after_decide_nothing_and_are_said_to():
    late = MachineEvent(START + timedelta(days=0.5), "crash", "tool broken")
    values = _runs(np.random.default_rng(3), 1, 1, 15.0, 0.0)
    (step,) = event_steps({"EB0C": _past("EB0C", values)}, [late])
    assert not step.by_days
    assert step.p_value == pytest.approx(stats.ttest_ind(values[1], values[0]).pvalue)


def test_the_days_of_other_pieces_say_what_a_step_between_two_days_has_to_exceed():
    rng = np.random.default_rng(6)
    values = _runs(rng, 5, 1, 0.0, 1.0)
    values[4:] += 40.0
    values[5] += 30.0
    events = [MachineEvent(START + timedelta(days=day + 0.5), "repair", "spindle") for day in (3, 4)]
    first, second = event_steps({"EB0C": _past("EB0C", values)}, events)
    means = values.mean(axis=1)
    # One day between the events and one after: only the four days before them scatter about a mean.
    u = means[:4].std(ddof=1) * np.sqrt(2.0)
    assert second.by_days
    assert second.u == pytest.approx(u)
    assert second.p_value == pytest.approx(2.0 * stats.t.sf((means[5] - means[4]) / u, 3))
    assert first.by_days


def test_days_that_differ_by_five_are_no_step_of_two_days():
    rng = np.random.default_rng(8)
    stated = [
        step.by_days
        for _ in range(100)
        for step in event_steps(
            {"EB0C": _past("EB0C", _runs(rng, 1, 1, 0.0, 5.0))},
            [MachineEvent(START + timedelta(days=0.5), "crash", "")],
        )
    ]
    assert len(stated) > 50
    assert not any(stated)


@pytest.mark.parametrize("day_sd", [0.0, 1.0, 2.0])
def test_false_steps_by_days_hold_their_rate_whatever_the_days_do(day_sd):
    rng = np.random.default_rng(17)
    machines = 300
    stated = sum(
        any(
            step.by_days
            for step in event_steps(
                {f"E{k}": _past(f"E{k}", _runs(rng, 3, 4, 0.0, day_sd)) for k in range(4)}, [REPAIR]
            )
        )
        for _ in range(machines)
    )
    # Nominal 5 % of machines; three standard deviations of 300.
    assert stated / machines < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / machines)


def test_a_step_of_one_of_many_after_one_day_is_named_and_not_decided():
    """Without the event the search calls such a step; with it the report said nothing, and `trend` of a day more said
    that it stepped."""
    rng = np.random.default_rng(12)
    past = {f"E{k}": _past(f"E{k}", _runs(rng, 3, 1, 0.0, 0.0)) for k in range(1, 13)}
    means = np.array([-1.5, 0.0, 1.5, 9.0])
    past["E0"] = _past("E0", means[:, np.newaxis] + 0.3 * np.array([-1.0, 1.0, -1.0, 1.0]))
    event = MachineEvent(START + timedelta(days=2.5), "repair", "zero set")
    (step,) = event_steps(past, [event])
    assert (step.parameter, step.decided, step.undecided) == ("E0", False, Undecided.FEW_DAYS)
    assert 0.05 / 13 < step.p_value < 0.05


def test_trend_says_a_step_in_the_words_of_the_report():
    step = StepAtEvent(
        "2026-03-05T00:00:00+00:00", "repair", "zero set", 15.1, 0.74, "µrad", 3e-4, "days", True
    )
    words = str(SteppedAtEvent("EB0C", "zero set", 15.1, 0.74, "µrad", None))
    assert words == "EB0C stepped by +15.10 µrad at the event 'zero set' (u = 0.74 µrad)"
    assert words in _event_step("EB0C", step)
    unsure = replace(step, decided=False, why_not_decided=Undecided.FEW_DAYS)
    words = str(SteppedAtEvent("EB0C", "zero set", 15.1, 0.74, "µrad", Undecided.FEW_DAYS))
    assert words in _event_step("EB0C", unsure)
