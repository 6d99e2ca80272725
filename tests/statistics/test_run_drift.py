"""Drift within a day, by rates and by hand."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics.run_drift import run_drift

HOURS = np.arange(4) * 0.4
COVARIANCE = 0.5 * np.eye(8) + 0.5


def test_slope_and_scatter_by_hand():
    found = run_drift([[0.0], [1.0], [1.0], [2.0]], [0.0, 1.0, 2.0, 3.0], [[1.0]])
    assert found.slope[0] == pytest.approx(0.6)
    # residuals -0.1, 0.3, -0.3, 0.1: sum of squares 0.2, two degrees of freedom, five hours²
    assert found.u[0] == pytest.approx(np.sqrt(0.2 / 2 / 5))
    assert found.dof == 2
    assert not found.common


def test_a_covariance_that_is_not_stated_is_refused():
    """Was: a drift of every parameter, with an unknown u and p = 0."""
    with pytest.raises(DataError, match="the stated covariance must be finite, of 2 parameters"):
        run_drift(np.zeros((4, 2)), HOURS, [[1.0, np.nan], [np.nan, 1.0]])


def test_false_alarms_keep_their_rate():
    root = np.linalg.cholesky(COVARIANCE)
    rng = np.random.default_rng(1)
    days = np.repeat(np.arange(3), 4)
    single = several = 0
    for _ in range(1500):
        single += run_drift(7.0 * rng.standard_normal((4, 8)) @ root.T, HOURS, COVARIANCE).drifts.any()
        offset = np.repeat(rng.normal(0.0, 20.0, (3, 1)), 4, axis=0)
        values = rng.standard_normal((12, 8)) @ root.T + offset
        several += run_drift(values, np.tile(HOURS, 3), COVARIANCE, days).drifts.any()
    assert 0.03 < single / 1500 < 0.07
    assert 0.03 < several / 1500 < 0.07


def test_a_drift_is_found_that_four_runs_alone_would_not_show():
    rng = np.random.default_rng(2)
    found = 0
    for _ in range(300):
        values = rng.standard_normal((4, 8)) @ np.linalg.cholesky(COVARIANCE).T
        values[:, 3] += 5.0 * np.arange(4)
        found += run_drift(values, HOURS, COVARIANCE).drifts[3]
    assert found > 250  # with its own two degrees of freedom: 40 to 50 %


def test_scatter_that_is_not_common_is_not_pooled():
    rng = np.random.default_rng(3)
    values = rng.standard_normal((8, 3)) * [1.0, 1.0, 1000.0]
    found = run_drift(values, np.arange(8.0), np.eye(3))
    assert not found.common
    assert found.dof == 6


@pytest.mark.parametrize(
    ("values", "hours", "stated", "message"),
    [
        (np.zeros((2, 1)), [0.0, 1.0], [[1.0]], "2 runs of 1 day"),
        (np.zeros((3, 1)), [1.0, 1.0, 1.0], [[1.0]], "began at the same time"),
        (np.zeros((3, 2)), [0.0, 1.0, 2.0], [[1.0]], "must be finite, of 2 parameters"),
        ([[np.nan], [0.0], [0.0]], [0.0, 1.0, 2.0], [[1.0]], "finite matrix"),
    ],
)
def test_what_cannot_be_judged_is_refused(values, hours, stated, message):
    with pytest.raises(DataError, match=message):
        run_drift(values, hours, stated)
