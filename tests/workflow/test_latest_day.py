"""What happened before the latest day is found on that day, and said until an event explains it."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from by_path import load

from monitor.reporting.health.answers import reason, to_do
from monitor.reporting.health.news import CheckKind, NextCheck, ParameterChanged
from monitor.reporting.health.records import Change, ChangeKind, State
from monitor.reporting.origins import OUT_OF_TOLERANCE
from monitor.workflow.health.facts import not_put_right
from monitor.workflow.health.verdict import Conformity, new_this_week, next_check, since_when, state_of
from monitor.workflow.health.weeks import week_named
from monitor.workflow.history.changes import search_changes
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.series import Series
from monitor.workflow.trend.forecast import limit_forecast

first_page = load("first_page", Path(__file__).parents[1] / "reporting" / "test_first_page.py")
QUIET = SimpleNamespace(suspect=(), refused_imports=())
UNLIMITED = Conformity({}, None, every_has_one=False)
STEP = ParameterChanged("EC0X", "step", 39.5, 2.5, "µrad")


def two_runs_a_day(days: int, crash: float, *, seed: int = 1) -> Series:
    """A history whose days scatter by 2 and whose latest day is off by ``crash``."""
    rng = np.random.default_rng(seed)
    mean = rng.normal(30.0, 2.0, days)
    mean[-1] += crash
    day = np.repeat(np.arange(days), 2)
    n = 2 * days
    return Series(
        "EC0X", "µrad", np.repeat(mean, 2) + rng.normal(scale=0.7, size=n), np.full(n, 1.0),
        12.0 * day + np.tile([0.0, 0.05], days), day, np.zeros(n), np.zeros(n, np.bool_), timedelta(),
    )  # fmt: skip


@pytest.mark.parametrize("days", [10, 14, 15, 20, 52])
def test_a_crash_is_found_on_its_own_day_however_long_the_history_is(days: int) -> None:
    series = two_runs_a_day(days, 40.0)
    step = search_changes([series], [])["EC0X"].changes[-1]
    assert (step.kind, step.at) == ("step", 12.0 * (days - 1))
    assert step.size == pytest.approx(40.0, abs=8.0)
    assert series.days_since(step.at) == 1
    assert not search_changes([two_runs_a_day(days, 0.0)], [])["EC0X"].changes


def test_an_event_before_the_latest_day_explains_it() -> None:
    series = two_runs_a_day(20, 40.0)
    assert not search_changes([series], [12.0 * 18.5])["EC0X"].changes


def test_what_is_out_of_tolerance_is_checked_at_once() -> None:
    """Whether its step is found, or its line through all days foretells that it comes back."""
    series = two_runs_a_day(15, 40.0)
    check = float(series.t[-1]) + 12.0
    for begins in (-np.inf, 12.0 * 14):
        ahead = limit_forecast(PieceDrift(series, begins), 60.0, check, 0.95)
        assert (ahead.recommended_interval_days, ahead.recommended_by) == (0.0, OUT_OF_TOLERANCE)
        assert (ahead.in_tolerance_at_next_check or 0.0) < 0.5
    within = limit_forecast(PieceDrift(two_runs_a_day(15, 0.0), -np.inf), 60.0, check, 0.95)
    assert within.recommended_interval_days is not None
    assert within.recommended_interval_days > 1.0


def step(size: float) -> SimpleNamespace:
    return SimpleNamespace(kind="step", size=size)


def test_what_was_put_right_is_open_no_more() -> None:
    away, back, rest = step(40.0), step(-38.0), step(15.0)
    assert not_put_right([away]) == [away]
    assert not_put_right([away, back]) == []
    assert not_put_right([away, back, rest]) == [rest]
    assert not_put_right([away, rest]) == [away, rest]
    assert not_put_right([SimpleNamespace(kind="slope", size=40.0)]) == []


def test_an_open_step_makes_the_state_of_a_later_week() -> None:
    at = datetime(2026, 6, 17, 9)
    still = Change(ChangeKind.CHANGE, datetime(2026, 6, 5, 9), at, STEP, 1e-5, False, True)
    closed = replace(still, is_open=None)
    assert state_of(UNLIMITED, (still,), None, QUIET, 0.05, evaluated=True) is State.CHANGED
    assert state_of(UNLIMITED, (closed,), None, QUIET, 0.05, evaluated=True) is State.NO_CHANGE_SEEN
    said = "EC0X stepped by +39.5 µrad (u = 2.5 µrad) on 2026-06-17, and no event explains it"
    assert str(new_this_week((still,), None, QUIET)) == said
    assert str(new_this_week((closed,), None, QUIET)) == "nothing this week"
    assert since_when(State.CHANGED, (), (still,), at) == at
    health = replace(
        first_page.DRIFTED, state=State.CHANGED, changes=(still,), since=at, probability_out=None
    )
    assert reason(health).startswith(said)
    assert to_do(health).startswith(
        "Find out what was done or happened then, record it as an event, and measure again"
    )


def test_a_step_of_the_latest_day_is_measured_again_now() -> None:
    week = week_named("2026-W25")
    for limits, kind in (({}, CheckKind.ONE_DAY_NO_TOLERANCE), ({"EC0X": 90.0}, CheckKind.ONE_DAY)):
        check = next_check(State.CHANGED, {}, limits, week, "EC0X")
        assert check == NextCheck(kind, "EC0X")
        assert str(check).startswith("now: the latest day alone shows the step of EC0X")
    assert next_check(State.OUT_OF_TOLERANCE, {}, {}, week, "EC0X").kind is CheckKind.ALARM
