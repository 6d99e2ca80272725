"""What goes with the temperature of a day and what with that of a run: one number only where they do not contradict."""

from __future__ import annotations

from datetime import timedelta

import numpy as np
import pytest

from monitor.cli.dependence_output import _condition
from monitor.workflow.history.series import Series
from monitor.workflow.trend.causes import conditions

DAYS, RUNS = 52, 2


def effect_of(between, within, seed):
    """The effect of a hall of ±4 K a year whose second run of a day is 0.2 K warmer, on a machine that follows it by
    ``between`` from day to day and by ``within`` from run to run."""
    rng = np.random.default_rng(seed)
    day = np.repeat(np.arange(DAYS), RUNS)
    hall = (4.0 * np.sin(2.0 * np.pi * np.arange(DAYS) / 52.0) + 0.4 * rng.normal(size=DAYS))[day]
    inside = 0.2 * np.tile(np.arange(RUNS), DAYS)
    y = between * hall + within * inside + 0.8 * rng.normal(size=DAYS)[day] + 0.1 * rng.normal(size=len(day))
    series = Series(
        "EY0C", "µm", y, np.full(len(day), 0.1), 7.0 * day + 0.1 * inside, day, np.full(len(day), 8.0),
        np.zeros(len(day), bool), timedelta(0),
    )  # fmt: skip
    return conditions(series, {"ambient_degC": 21.0 + hall + inside}, -1.0)[0][0]


@pytest.mark.parametrize("seed", range(3))
def test_days_and_the_runs_within_them_that_contradict_each_other_have_a_number_each(seed):
    effect = effect_of(2.2, 0.0, seed)
    assert effect.interval[0] < 2.2 < effect.interval[1]
    assert effect.u < 0.1
    assert abs(effect.within_days) < 4.0 * effect.u_within_days < 1.0
    words = _condition("EY0C", effect)
    assert "with ambient_degC from day to day, within days" in words


@pytest.mark.parametrize("seed", range(3))
def test_days_and_runs_that_agree_have_one_number(seed):
    effect = effect_of(2.2, 2.2, seed)
    assert effect.within_days is None
    assert effect.u_within_days is None
    assert abs(effect.coefficient - 2.2) < 4.0 * effect.u
    assert "from day to day" not in _condition("EY0C", effect)


@pytest.mark.parametrize("seed", [0, 2])
def test_a_slope_of_days_that_one_for_both_hides_is_said(seed):
    """Up from day to day and down within the days: one slope for both is next to none (p = 0.36 and 0.91)."""
    effect = effect_of(1.0, -0.3, seed)
    assert effect.within_days is not None
    assert effect.coefficient == pytest.approx(1.0, abs=0.2)
    assert effect.p_value < 1e-5
