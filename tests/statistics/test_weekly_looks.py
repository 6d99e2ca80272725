"""Weekly looks: scores against regressions of others, stakes against Ville's bound, and what they notice."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from statsmodels.regression.recursive_ls import RecursiveLS

from monitor.exceptions import DataError
from monitor.statistics.sequential_scores import (
    SequentialScores,
    TailShape,
    VectorScores,
    shrunk_correlation,
)
from monitor.statistics.weekly_looks import WeeklyLooks, overshoot


def test_brown_durbin_evans_scores_are_the_recursive_residuals_of_statsmodels() -> None:
    y = np.random.default_rng(3).normal(1e4, 2.0, 40)
    scores = SequentialScores(1, 1)
    ours = np.array([scores.add(np.array([[value]]), np.zeros((1, 1)))[0, 0] for value in y])
    # Ours begins with pairs of neighbours: without correlation the mean is of all values but the first.
    residuals = RecursiveLS(y[1:], np.ones(len(y) - 1)).fit().resid_recursive
    for week in range(10, 40):
        before = y[1:week]
        t = residuals[week - 1] / before.std(ddof=1)
        expected = scipy.stats.norm.ppf(scipy.stats.t.cdf(t, len(before) - 1))
        assert ours[week] == pytest.approx(expected, rel=1e-6)
    assert np.isnan(ours[:7]).all()


def test_hotelling_vector_scores_are_the_t_of_each_parameter_given_those_before() -> None:
    rng = np.random.default_rng(4)
    mixing = rng.normal(size=(3, 3))
    y = rng.normal(size=(30, 3)) @ mixing + 100.0
    scores = VectorScores(1, 3)
    ours = np.array([scores.add(row[None, :], np.zeros((1, 3)))[0] for row in y])
    assert np.isnan(ours[:10]).all()
    for week in (12, 20, 29):
        past = y[1:week]
        for j in range(3):
            # The regression of parameter j on those before it, by least squares, and its prediction.
            x = np.column_stack([np.ones(len(past)), past[:, :j]])
            new = np.concatenate([[1.0], y[week, :j]])
            beta, squares, _, _ = np.linalg.lstsq(x, past[:, j], rcond=None)
            freedom = len(past) - 1 - j
            sd = np.sqrt(squares[0] / freedom * (1.0 + new @ np.linalg.solve(x.T @ x, new)))
            t = (y[week, j] - new @ beta) / sd
            expected = scipy.stats.norm.ppf(scipy.stats.t.cdf(t, freedom))
            assert ours[week, j] == pytest.approx(expected, rel=1e-6)


def test_siegmund_1985_4_37_overshoot_is_that_of_simulated_walks() -> None:
    rng = np.random.default_rng(5)
    for shift in (1.0, 2.5):
        # Under the shift the walk of log likelihood ratios crosses any height; exp(-overshoot) is what counts.
        height, walk = 8.0, np.zeros(20_000)
        while (walk < height).any():
            rising = walk < height
            walk[rising] += shift * rng.normal(shift, 1.0, rising.sum()) - 0.5 * shift**2
        assert overshoot(shift) == pytest.approx(np.exp(height - walk).mean(), rel=0.02)


def test_correlations_are_drawn_to_that_of_the_fleet() -> None:
    rng = np.random.default_rng(6)
    raw, count = rng.normal(0.5, 0.2, (400, 5)), np.full((400, 5), 25.0)
    drawn = shrunk_correlation(raw, count)
    # What scatters as 25 pairs of one correlation do is one correlation.
    assert drawn == pytest.approx(0.5, abs=0.12)
    assert drawn.std() < 0.3 * raw.std()
    # Where each has its own, and two hundred pairs say so, each keeps its own and its own margin.
    own = rng.uniform(0.0, 0.8, (400, 5))
    kept = shrunk_correlation(own + rng.normal(0.0, 0.05, own.shape), np.full((400, 5), 400.0))
    assert np.abs(kept - own).mean() < 0.08
    assert np.array_equal(shrunk_correlation(np.full((2, 2), np.nan), np.zeros((2, 2))), np.zeros((2, 2)))


@pytest.mark.parametrize("freedom", [3.0, 100.0])
def test_scores_of_any_tail_become_normal(freedom: float) -> None:
    rng = np.random.default_rng(7)
    shape = TailShape()
    normal = np.concatenate(
        [shape.normalised(rng.standard_t(freedom, 20_000), np.ones(20_000, dtype=bool)) for _ in range(10)]
    )
    # Beyond three standard deviations: as many as of normal ones, rather fewer (the margin), once a shape is known.
    assert 0.0015 < (np.abs(normal[20_000:]) > 3.0).mean() < 0.0030


def test_steps_are_noticed_and_false_notices_stay_below_what_was_spent() -> None:
    rng = np.random.default_rng(8)
    weeks, machines, p = 104, 40, 6
    values = rng.standard_normal((weeks, machines, p))
    steps = rng.random((machines, p)) < 0.2
    values[52:] += 4.0 * steps
    looks = WeeklyLooks(np.ones((machines, p), dtype=bool))
    first, false = np.zeros((machines, p), dtype=int), 0
    for week in range(weeks):
        look = looks.look(values[week])
        first[look.parameters & (first == 0)] = week
        false += int((look.parameters & ~(steps & (week >= 52))).sum())
        assert look.spent <= 0.05 * max(look.noticed, 1)
    assert (first[steps] >= 52).mean() > 0.95
    assert np.median(first[steps] - 51) <= 6.0
    # Of some fifty notices 5 % are two or three.
    assert false <= 6
    assert look.noticed >= 40


def test_a_change_of_the_vector_that_no_parameter_shows() -> None:
    rng = np.random.default_rng(9)
    weeks, machines, p = 104, 40, 5
    values = 3.0 * rng.standard_normal((weeks, machines, 1)) + 0.3 * rng.standard_normal((weeks, machines, p))
    # One parameter moves by a third of its scatter, three times what it differs from the others by.
    values[60:, :10, 2] += 1.0
    looks = WeeklyLooks(np.ones((machines, p), dtype=bool))
    singles, vectors = np.zeros(machines, dtype=bool), np.zeros(machines, dtype=bool)
    since = []
    for week in range(weeks):
        look = looks.look(values[week])
        singles |= look.parameters.any(axis=1)
        vectors |= look.vectors
        since += (week + 1 - look.vector_since[look.vectors]).tolist()
    assert vectors[:10].all()
    assert vectors[10:].sum() <= 1
    assert singles.sum() <= 2
    assert np.median(since) == pytest.approx(60, abs=2)


def test_machines_without_a_parameter_missing_weeks_and_events() -> None:
    rng = np.random.default_rng(10)
    has = np.array([[True, True, False], [True, True, True], [False, True, False]])
    looks = WeeklyLooks(has)
    for week in range(60):
        values = np.where(has, rng.standard_normal(has.shape), np.nan)
        if week % 3 == 0:
            values[1] = np.nan
        if week == 40:
            # Something was done to the first machine: its parameters step, and nothing is noticed.
            looks.restart(np.array([True, False, False]))
        if week >= 40:
            values[0] += 50.0
        look = looks.look(values)
        assert not look.parameters.any()
        assert look.series <= 8
    with pytest.raises(DataError, match=r"values has shape \(2, 3\); \(3, 3\) is needed"):
        looks.look(np.zeros((2, 3)))
    with pytest.raises(DataError, match="rate"):
        WeeklyLooks(has, rate=2.0)
