"""Before and after an event: Student's test of scipy, false alarms, and a change of 3.5 standard deviations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics.before_after import before_after


def sides(rng, days, runs, component):
    values = component * rng.normal(size=(days, 1)) + rng.normal(size=(days, runs))
    return values.ravel(), np.repeat(np.arange(days), runs)


def test_of_one_day_a_side_it_is_students_test():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=6), rng.normal(size=4) + 1.0
    result = before_after(x, y, np.zeros(6), np.zeros(4))
    right = stats.ttest_ind(y, x).confidence_interval(0.95)
    assert result.difference - result.expanded == pytest.approx(right.low, rel=1e-10)
    assert result.difference + result.expanded == pytest.approx(right.high, rel=1e-10)
    assert result.between is None


def test_of_days_of_as_many_runs_it_is_students_test_of_their_means():
    rng = np.random.default_rng(2)
    (x, of_x), (y, of_y) = sides(rng, 5, 4, 3.0), sides(rng, 4, 4, 3.0)
    result = before_after(x, y, of_x, of_y)
    right = stats.ttest_ind(y.reshape(4, 4).mean(axis=1), x.reshape(5, 4).mean(axis=1)).confidence_interval(
        0.95
    )
    assert result.difference - result.expanded == pytest.approx(right.low, rel=1e-9)
    assert result.difference + result.expanded == pytest.approx(right.high, rel=1e-9)


@pytest.mark.parametrize(
    ("before", "after", "component"), [((1, 4), (1, 4), 0.0), ((5, 4), (5, 4), 1.0), ((4, 3), (2, 3), 2.0)]
)
def test_false_alarms_and_a_change_of_three_and_a_half_standard_deviations(
    before, after, component, rate_at_most
):
    rng = np.random.default_rng([*before, *after])
    false_alarms = seen = 0
    u = np.sqrt(sum((component**2 + 1.0 / runs) / days for days, runs in (before, after)))
    for _ in range(300):
        (x, of_x), (y, of_y) = sides(rng, *before, component), sides(rng, *after, component)
        false_alarms += not before_after(x, y, of_x, of_y).agree
        seen += not before_after(x, y + 3.5 * u, of_x, of_y).agree
    assert rate_at_most(false_alarms, 300, 0.05)
    assert seen / 300 > 0.6


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match=r"1 run\(s\) before and 1 after say nothing of their scatter"):
        before_after([1.0], [2.0], [0], [0])
    with pytest.raises(DataError, match="no run differs from the others of its side"):
        before_after([1.0, 1.0], [2.0, 2.0], [0, 0], [0, 0])
