"""Days that wander are no slope of days: one coefficient stays where they alone part days and runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.statistics.days.wandering_days import slope_as_far
from monitor.workflow.trend.causes import conditions

trial = load(
    "trial_wandering_days", Path(__file__).resolve().parents[1] / "benchmarks/trial_wandering_days.py"
)


@pytest.mark.parametrize(
    ("plan", "correlation", "size", "seed"), [((100, 2), 1.0, 4.0, 65), ((40, 4), 0.9, 3.0, 89)]
)
def test_days_that_wander_leave_one_coefficient(
    plan: tuple[int, int], correlation: float, size: float, seed: int
) -> None:
    """Was: two coefficients, the one from day to day that of the wandering (chance below 0.1 %; now above 2 %)."""
    series, hall = trial.history(seed, plan, (0.5, 0.5), correlation, size)
    (effect,), _ = conditions(series, {"ambient_degC": hall}, -np.inf)
    assert effect.within_days is None
    assert effect.coefficient == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("correlation", [0.0, 0.9, 1.0])
def test_a_machine_that_follows_the_days_alone_has_two_coefficients_beside_wandering_days(
    correlation: float,
) -> None:
    series, hall = trial.history(0, (100, 2), (2.24, 0.01), correlation, 1.0)
    (effect,), _ = conditions(series, {"ambient_degC": hall}, -np.inf)
    assert effect.coefficient == pytest.approx(2.24, abs=0.4)
    assert effect.within_days == pytest.approx(0.01, abs=0.1)


def test_days_that_leave_nothing_over_decide_nothing() -> None:
    times = np.arange(3.0)
    design = np.column_stack([np.ones(3), times, [0.0, 1.0, 0.0]])
    assert slope_as_far(5.0 * design[:, 2], times, design, np.ones(3), 0.0, 0.1, 10.0) == 1.0
