"""Global risks and what a process tells before: JCGM 106 by bivariate integrals of scipy, and by its tables."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.uncertainty.conformity import conformity
from monitor.uncertainty.risk import Process


@pytest.mark.parametrize(("p", "z"), [(0.80, 0.84), (0.90, 1.28), (0.95, 1.64), (0.99, 2.33), (0.999, 3.09)])
def test_jcgm106_7_3_table_1_probability_of_one_sided_limits(p: float, z: float) -> None:
    # The table rounds z to two decimals.
    found = float(conformity([10.0 - z], [[1.0]], [-math.inf], [10.0]).single[0])
    assert abs(float(stats.norm.ppf(found)) - float(stats.norm.ppf(p))) < 0.006


def test_jcgm106_7_4_zener_diode_conforms_with_92_percent() -> None:
    # Breakdown voltage -5.47 V with u = 0.05 V against an upper limit of -5.40 V.
    found = conformity([-5.47], [[0.05**2]], [-math.inf], [-5.40])
    assert round(float(found.single[0]), 2) == 0.92


@pytest.mark.parametrize("acceptance", [(1499.8, 1500.2), (1499.88, 1500.12), (1499.72, 1500.28)])
def test_jcgm106_9_5_global_risks_are_the_integrals_of_the_bivariate_normal(
    acceptance: tuple[float, float],
) -> None:
    # Resistors of 1500 ohm within 0.2 ohm, u_0 = 0.12 ohm, u_m = 0.04 ohm; scipy integrates over both variables.
    limits, spread, u = (1499.8, 1500.2), 0.12, 0.04
    both = stats.multivariate_normal(
        [1500.0, 1500.0], [[spread**2, spread**2], [spread**2, spread**2 + u**2]]
    )
    conforming_accepted = both.cdf([limits[1], acceptance[1]], lower_limit=[limits[0], acceptance[0]])
    accepted = np.diff(stats.norm(1500.0, math.hypot(spread, u)).cdf(acceptance))[0]
    conforming = np.diff(stats.norm(1500.0, spread).cdf(limits))[0]
    risks = Process(1500.0, spread).risks(u, limits, acceptance)
    assert risks.consumer == pytest.approx(accepted - conforming_accepted, abs=2e-6)
    assert risks.producer == pytest.approx(conforming - conforming_accepted, abs=2e-6)
    assert conforming == pytest.approx(0.904, abs=5e-4)


def test_nothing_accepted_is_no_risk_of_the_consumer() -> None:
    risks = Process(0.0, 1.0).risks(0.5, (-1.0, 1.0), None)
    assert risks.consumer == 0.0
    assert risks.producer == pytest.approx(0.682689, abs=1e-6)


def test_a_process_without_spread_is_refused() -> None:
    with pytest.raises(DataError, match="a process needs a finite mean and a positive spread, not 0"):
        Process(0.0, 0.0)
