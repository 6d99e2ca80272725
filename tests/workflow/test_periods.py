"""Two periods of a machine: rates of saying that something differs, over all parameters of a comparison."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from monitor.statistics.days.before_after import OtherDays, before_after
from monitor.workflow.history.periods import ParameterOfPeriods, _with_discovery_rates

#: Days a side, runs a day, parameters, and other campaigns of the machine with as many days as a side.
DAYS, RUNS, PARAMETERS, OTHERS = 4, 3, 13, 6


def compared(
    seed: int, shift: float = 0.0, others: int = OTHERS, rho: float = 0.0
) -> dict[str, ParameterOfPeriods]:
    """Thirteen parameters whose days are correlated by two common causes; the first is shifted in the later period."""
    rng = np.random.default_rng(seed)
    days = (2 + others) * DAYS
    of_days = rng.normal(size=(days, 2)) @ rng.normal(size=(2, PARAMETERS)) + rng.normal(
        size=(days, PARAMETERS)
    )
    for day in range(1, days):
        of_days[day] = rho * of_days[day - 1] + np.sqrt(1.0 - rho**2) * of_days[day]
    values = np.repeat(of_days, RUNS, axis=0) + 0.3 * rng.normal(size=(days * RUNS, PARAMETERS))
    day = np.repeat(np.arange(days), RUNS)
    earlier, later, rest = day < DAYS, (day >= DAYS) & (day < 2 * DAYS), day >= 2 * DAYS
    values[later, 0] += shift
    campaign = day[rest] // DAYS
    return _with_discovery_rates(
        {
            f"P{j:02d}": (
                ParameterOfPeriods("µm", 0.0, 0.0, 0.0, None, None, None, None, None, None),
                before_after(
                    values[earlier, j], values[later, j], day[earlier], day[later],
                    OtherDays(values[rest, j], day[rest], np.zeros_like(campaign), campaign) if others else None,
                ),
            )
            for j in range(PARAMETERS)
        }
    )  # fmt: skip


def test_where_nothing_changed_few_comparisons_name_any_parameter(seeds: Callable[[int, int], range]) -> None:
    """Each parameter by itself at 5 % names one several times as often."""
    numbers = seeds(1000, 60)
    named = alone = 0
    for seed in numbers:
        parameters = compared(seed).values()
        named += any(of.differs for of in parameters)
        alone += any(of.p_value is not None and of.p_value <= 0.05 for of in parameters)
    # Three standard deviations above 5 %.
    assert named <= 0.05 * len(numbers) + 3.0 * np.sqrt(0.05 * 0.95 * len(numbers))
    assert alone > 2 * named


def test_what_changed_is_named(seeds: Callable[[int, int], range]) -> None:
    named = [compared(seed, shift=12.0)["P00"].differs for seed in seeds(300, 15)]
    assert np.mean([answer is True for answer in named]) > 0.8


def test_q_values_are_those_of_benjamini_and_hochberg() -> None:
    """By their definition, over the p-values that there are."""
    parameters = list(compared(3, shift=12.0).values())
    p = np.array([of.p_value for of in parameters], dtype=np.float64)
    order = np.argsort(p)
    q = np.minimum.accumulate((p[order] * len(p) / np.arange(1, len(p) + 1))[::-1])[::-1]
    assert np.array([of.q_value for of in parameters])[order] == pytest.approx(np.minimum(q, 1.0), rel=1e-12)
