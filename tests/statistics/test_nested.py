"""Components within runs, between runs and between days, against statsmodels and the closed forms of ANOVA."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics.nested import NotKnown, day_components

DAYS, RUNS = 6, 5


def nested(rng: np.random.Generator, days, day: float, run: float, width: int = 1) -> np.ndarray:
    """Values (R, p): a level for every day and a scatter of every run."""
    labels = np.asarray(days)
    levels = {label: rng.normal(0.0, day, width) for label in np.unique(labels)}
    return np.array([levels[label] for label in labels]) + rng.normal(0.0, run, (len(labels), width))


def test_balanced_days_are_the_mixed_model_of_statsmodels():
    """REML of a one-way random model is the ANOVA estimate where that is positive (Searle et al. 1992, 3.8)."""
    mixed = pytest.importorskip("statsmodels.regression.mixed_linear_model")
    labels = np.repeat(np.arange(DAYS), RUNS)
    values = nested(np.random.default_rng(5), labels, 2.0, 1.0)
    ours = day_components(values, labels, np.array([0.4]))
    fit = mixed.MixedLM(values[:, 0], np.ones((len(values), 1)), groups=labels).fit(reml=True)
    assert float(ours.between_days[0]) ** 2 == pytest.approx(float(fit.cov_re[0, 0]), rel=1e-4)
    assert ours.within_run[0] ** 2 + ours.between_runs[0] ** 2 == pytest.approx(float(fit.scale), rel=1e-4)
    assert float(ours.covariance[0, 0]) == pytest.approx(float(fit.cov_re[0, 0]), rel=1e-4)


def test_unbalanced_days_are_the_analysis_of_unweighted_means():
    """Day means count alike, their runs by the harmonic mean of the numbers (Burdick and Graybill 1992, 4.3)."""
    labels = np.array([1, 1, 1, 1, 1, 1, 1, 2, 2, 3, 3, 3, 4, 4, 4, 4])
    values = nested(np.random.default_rng(8), labels, 3.0, 1.0, 2)
    ours = day_components(values, labels, np.zeros(2))
    groups = [values[labels == label] for label in (1, 2, 3, 4)]
    within = sum(((g - g.mean(axis=0)) ** 2).sum(axis=0) for g in groups) / (len(values) - 4)
    means = np.array([g.mean(axis=0) for g in groups])
    harmonic = 4 / sum(1 / len(g) for g in groups)
    assert ours.between_runs**2 == pytest.approx(within, rel=1e-12)
    assert ours.between_days**2 == pytest.approx(means.var(axis=0, ddof=1) - within / harmonic, rel=1e-12)
    assert ours.spread == pytest.approx(np.ptp(means, axis=0))
    assert np.diag(ours.covariance) == pytest.approx(ours.between_days**2, rel=1e-12)


def test_negative_estimates_are_zero_and_said_so_and_the_covariance_stays_one():
    labels = np.repeat(np.arange(4), 4)
    rng = np.random.default_rng(3)
    values = rng.normal(0.0, 1.0, (16, 6))
    # The same mean on every day: the days differ by less than their runs explain.
    for label in range(4):
        values[labels == label, :3] -= values[labels == label, :3].mean(axis=0)
    ours = day_components(values, labels, np.full(6, 10.0))
    assert ours.truncated_days[:3].all()
    assert ours.truncated_runs.all()
    assert (ours.between_days[:3] == 0.0).all()
    assert (ours.between_runs == 0.0).all()
    assert np.linalg.eigvalsh(ours.covariance).min() > -1e-12
    assert np.diag(ours.covariance) == pytest.approx(ours.between_days**2)


def test_one_day_two_days_one_run_a_day_and_one_run_say_what_cannot_be_known():
    rng = np.random.default_rng(1)
    u = np.array([0.5])
    assert day_components(rng.normal(size=(1, 1)), [1], u).not_known is NotKnown.ONE_RUN
    one = day_components(rng.normal(size=(9, 1)), [1] * 9, u)
    assert one.not_known is NotKnown.ONE_DAY
    assert np.isnan(one.between_days).all()
    assert one.covariance is None
    two = day_components(nested(rng, [1] * 5 + [2] * 5, 1.0, 1.0), [1] * 5 + [2] * 5, u)
    assert two.not_known is NotKnown.TWO_DAYS
    assert two.covariance is None
    values = nested(rng, range(12), 3.0, 0.5)
    each = day_components(values, range(12), u)
    assert each.not_known is NotKnown.ONE_RUN_A_DAY
    assert np.isnan(each.between_runs).all()
    assert each.between_days[0] ** 2 == pytest.approx(values.var(ddof=1) - 0.25)
    low, high = each.between_days_interval[0]
    assert low < each.between_days[0] < high


@pytest.mark.parametrize(("values", "days"), [([[1.0], [np.nan]], [1, 2]), ([[1.0], [2.0]], [1])])
def test_values_that_are_no_table_are_refused(values, days):
    with pytest.raises(DataError, match=r"finite|R days"):
        day_components(np.array(values), days, np.array([1.0]))


def test_the_estimates_are_right_on_average():
    """The variance between days is unbiased before it is cut at zero: seen where it is seldom cut."""
    rng, labels = np.random.default_rng(20), np.repeat(np.arange(5), 4)
    estimates = [
        day_components(nested(rng, labels, 2.0, 1.0), labels, np.zeros(1)).between_days[0] ** 2
        for _ in range(300)
    ]
    assert np.mean(estimates) == pytest.approx(4.0, abs=3.0 * np.std(estimates) / np.sqrt(len(estimates)))
