"""A latest day that stands out from the days before it, whatever the length of the history."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.statistics.days.latest_day import FEWEST_DAYS, latest_day


def test_of_independent_days_it_is_the_comparison_with_their_mean() -> None:
    """By which the fleet ranks: Student's t of the latest mean against the others."""
    t = np.arange(15.0) * 12.0
    y = np.random.default_rng(3).normal(30.0, 2.0, 15)
    y[-1] += 40.0
    found = latest_day(t, y)
    assert found is not None
    others = y[:-1]
    z = (y[-1] - others.mean()) / (others.std(ddof=1) * np.sqrt(1.0 + 1.0 / 14.0))
    assert found.p_value >= 2.0 * stats.t.sf(z, 13)
    assert found.size == pytest.approx(y[-1] - others.mean(), abs=4.0)
    assert found.p_value < 1e-6
    assert found.times_others > 4.0


@pytest.mark.parametrize("days", [10, 15, 30, 52])
def test_it_stands_out_as_rarely_as_stated(days: int) -> None:
    """Of days that are independent, walk, or drift: at the level of 1 % at most 1 % in 200 (99.9 % of them below 8)."""
    rng = np.random.default_rng(days)
    t = np.arange(days) * 7.0
    for make in (
        lambda: rng.normal(size=days),
        lambda: np.cumsum(rng.normal(size=days)),
        lambda: rng.normal(size=days) + np.arange(days),
    ):
        every = [latest_day(t, make()) for _ in range(60)]
        assert sum(found is not None and found.p_value < 0.01 for found in every) <= 4


def test_few_days_or_days_that_do_not_scatter_say_nothing() -> None:
    t = np.arange(FEWEST_DAYS - 1.0)
    assert latest_day(t, np.array([0.0, 1.0, 0.0, 1.0, 90.0])) is None
    assert latest_day(np.arange(9.0), np.append(np.full(8, 5.0), 90.0)) is None


def test_a_day_of_fewer_runs_is_less_sure() -> None:
    t, y = np.arange(12.0), np.append(np.random.default_rng(1).normal(size=11), 9.0)
    alike, fewer = latest_day(t, y), latest_day(t, y, 4.0)
    assert alike is not None
    assert fewer is not None
    assert fewer.u > alike.u
    assert fewer.p_value > alike.p_value
