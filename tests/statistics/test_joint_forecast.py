"""Forecast of the longest vector: one parameter agrees with `forecast`, rates over many histories, correlations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics import (
    ErrorVectors,
    JointLines,
    LengthQuestion,
    forecast,
    forecast_longest,
    residual_correlation,
)
from monitor.statistics.forecasts.joint_forecast import _chi_square
from monitor.statistics.trend import trend

WEEKS = np.arange(30) * 7.0


def lines_of(values, times=WEEKS):
    return [trend(column, times) for column in np.asarray(values).T]


def residuals_of(lines, values, times=WEEKS):
    return np.column_stack(
        [y - (a.level_at + a.slope * (times - a.at)) for a, y in zip(lines, values.T, strict=True)]
    )


def test_one_parameter_along_one_axis_agrees_with_its_own_forecast():
    rng = np.random.default_rng(1)
    values = (5.0 + 0.03 * WEEKS + 0.5 * rng.normal(size=30))[:, np.newaxis]
    lines = lines_of(values)
    now, horizon = float(WEEKS[-1]), float(WEEKS[-1]) + 3000.0
    checks = [now + 100.0, now + 250.0, now + 400.0]
    own = forecast(lines[0], (-20.0, 20.0), now, checks, horizon=horizon)
    found = forecast_longest(
        JointLines(lines, np.eye(1)), ErrorVectors(np.array([[[1.0], [0.0], [0.0]]]), np.zeros((1, 3))),
        LengthQuestion(20.0, now, checks, horizon), rng=rng, draws=20_000,
    )  # fmt: skip
    assert found.probability == pytest.approx(own.probability, abs=0.012)
    assert found.crossing.at == pytest.approx(own.crossing.at, abs=1.0)
    # Ten days of the several hundred that the interval is wide: the scatter of 20 000 draws and the grid.
    assert found.crossing.interval == pytest.approx(own.crossing.interval, abs=10.0)
    assert found.predicted == pytest.approx(own.predicted, abs=0.05)
    assert found.recommended_interval == pytest.approx(own.recommended_interval, rel=0.2)


def test_what_all_runs_are_off_by_together_is_drawn_once_for_all_parameters():
    """Two gains by one laser: their sum is off by twice its scale, their difference by nothing."""
    rng = np.random.default_rng(3)
    values = 5.0 + 0.5 * rng.normal(size=(30, 2))
    lines, now = lines_of(values), float(WEEKS[-1])
    common, question = np.array([[[2.0, 0.0], [2.0, 0.0]]]), LengthQuestion(8.0, now, [now], now + 1.0)
    for signs, both in ((1.0, 4.0), (-1.0, 0.0)):
        vectors = ErrorVectors(np.array([[[1.0, signs], [0.0, 0.0], [0.0, 0.0]]]), np.zeros((1, 3)))
        found = forecast_longest(
            JointLines(lines, np.eye(2), common),
            vectors,
            question,
            rng=np.random.default_rng(4),
            draws=20_000,
        )
        plain = forecast_longest(
            JointLines(lines, np.eye(2)), vectors, question, rng=np.random.default_rng(4), draws=20_000
        )
        # Half the width of 95 %, of the run's scatter and of what is common.
        wide, narrow = (float(np.ptp(each.interval[0])) / 2.0 / 1.96 for each in (found, plain))
        if both:
            assert wide == pytest.approx(np.hypot(narrow, both), rel=0.03)
        else:
            assert wide == pytest.approx(narrow, rel=0.03)


@pytest.mark.slow
def test_prediction_interval_of_the_longest_vector_covers_the_next_run(rate_agrees):
    # Truth: three correlated parameters that drift, four points; the length of a run 20 weeks ahead.
    rng = np.random.default_rng(2)
    root = np.linalg.cholesky(np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    sensitivity = rng.normal(size=(4, 3, 3))
    slope, level = np.array([0.05, 0.03, 0.0]), np.array([3.0, 2.0, 1.0])
    inside, trials = 0, 120
    for _ in range(trials):
        values = level + slope * WEEKS[:, np.newaxis] + rng.normal(size=(30, 3)) @ root.T
        lines = lines_of(values)
        correlation, _, _ = residual_correlation(residuals_of(lines, values), np.arange(30))
        at = WEEKS[-1] + 140.0
        truth = level + slope * at + root @ rng.normal(size=3)
        length = np.linalg.norm(sensitivity @ truth, axis=1).max()
        found = forecast_longest(
            JointLines(lines, correlation), ErrorVectors(sensitivity, np.zeros((4, 3))),
            LengthQuestion(50.0, float(WEEKS[-1]), [at], at + 1.0), rng=rng, draws=200,
        )  # fmt: skip
        inside += found.interval[0, 0] <= length <= found.interval[0, 1]
    assert rate_agrees(inside, trials, 0.95), inside / trials


def test_correlation_decides_whether_parameters_make_up_for_each_other():
    rng = np.random.default_rng(3)
    common = rng.normal(size=(30, 1))
    values = np.hstack([10.0 + common, 10.0 - common]) + 0.05 * rng.normal(size=(30, 2))
    lines = lines_of(values)
    now = float(WEEKS[-1])
    mean = np.array([[[0.5, 0.5], [0.0, 0.0], [0.0, 0.0]]])

    def spread(correlation):
        found = forecast_longest(
            JointLines(lines, correlation), ErrorVectors(mean, np.zeros((1, 3))),
            LengthQuestion(30.0, now, [now + 7.0], now + 700.0), rng=np.random.default_rng(4),
        )  # fmt: skip
        return float(np.ptp(found.interval[0]))

    correlation, shrink, days = residual_correlation(residuals_of(lines, values), np.arange(30))
    assert days == 30
    assert shrink < 0.2
    assert correlation[0, 1] < -0.8
    assert spread(correlation) < 0.5 * spread(np.eye(2))


def test_few_days_say_nothing_of_correlations_and_noise_is_shrunk():
    rng = np.random.default_rng(5)
    r, shrink, days = residual_correlation(rng.normal(size=(12, 6)), np.repeat([1, 2, 3], 4))
    assert (r == np.eye(6)).all()
    assert (shrink, days) == (1.0, 3)
    r, shrink, _ = residual_correlation(rng.normal(size=(10, 8)), np.arange(10))
    assert shrink > 0.5
    assert np.linalg.eigvalsh(r).min() > 0.1


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match=r"limit is 0\.0; the longest vector needs a limit above zero"):
        LengthQuestion(0.0, 210.0, [], 300.0)
    with pytest.raises(DataError, match=r"checks holds 10\.0; a planned check cannot lie before now, 210"):
        LengthQuestion(1.0, 210.0, [10.0], 300.0)
    with pytest.raises(DataError, match=r"horizon is 100\.0; it must lie after now, 210"):
        LengthQuestion(1.0, 210.0, [], 100.0)


def test_chi_square_between_its_points_is_that_of_scipy():
    dof = np.array([1.0, 1.5, 2.0, 3.7, 10.0, 38.2, 250.0, 1e4, 1e6])
    for seed, count in ((1, 2), (2, 500), (3, 2000)):
        u = np.random.default_rng(seed).uniform(size=count)
        np.testing.assert_allclose(_chi_square(u, dof), stats.chi2.isf(u[:, np.newaxis], dof), rtol=1e-10)
