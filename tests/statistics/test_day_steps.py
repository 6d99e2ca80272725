"""Steps in the means of a few days: rates for whatever days do, against a plain simulation of the same question."""

import numpy as np
import pytest

from monitor.statistics.days.day_steps import day_step_p_value


@pytest.mark.parametrize("component", [0.0, 2.0, 8.0])
def test_the_rate_holds_whatever_the_days_differ_by(component, rate_at_most):
    rng = np.random.default_rng(int(component) + 1)
    day = np.repeat(np.arange(5), 4)
    called = sum(
        day_step_p_value(rng.normal(size=20) + component * rng.normal(size=5)[day], day, rng, 999) < 0.05
        for _ in range(300)
    )
    assert rate_at_most(called, 300, 0.05)


def test_a_step_far_beyond_the_days_is_seen_and_two_days_say_nothing():
    rng = np.random.default_rng(3)
    day = np.repeat(np.arange(5), 4)
    assert day_step_p_value(rng.normal(size=20) + 40.0 * (day > 2), day, rng, 1999) < 0.005
    assert day_step_p_value(rng.normal(size=8), np.repeat([0, 1], 4), rng, 999) == 1.0
