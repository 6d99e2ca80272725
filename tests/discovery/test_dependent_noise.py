"""Noise that depends on its neighbours: the filter, the sign flips, and what is told of empty campaigns.

All rates are in tests/benchmarks/trial_unknown.py; here a few campaigns and independent computations with numpy.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy
from by_path import load

from monitor.discovery import explain, fit
from monitor.discovery.machine.compare import lack_of_fit
from monitor.discovery.machine.noise.beyond_noise import beyond_neighbours
from monitor.discovery.machine.noise.correlation import Correlation, Filters
from monitor.discovery.machine.noise.rows import Rows
from monitor.discovery.machine.noise.whitening import Whitening
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.search.evidence import Pool, weigh_beside
from monitor.discovery.search.sign_flips import p_value_by_flips, signs
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of


@pytest.fixture(scope="module")
def trial():
    return load("trial_unknown", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_unknown.py")


def test_the_filter_is_the_inverse_of_the_triangle_of_cholesky():
    """The covariance of a correlated and an independent part, with a touch that was left out."""
    correlation = Correlation(0.8, 0.6)
    weighted = np.ones((1, 9), dtype=bool)
    weighted[0, 4] = False
    lag = np.abs(np.subtract.outer(np.arange(9), np.arange(9)))
    covariance = 0.6 * 0.8**lag + 0.4 * np.eye(9)
    inside = np.ix_(weighted[0], weighted[0])
    expected = np.linalg.inv(np.linalg.cholesky(covariance[inside]))
    triangle = Whitening(Rows(weighted, 1, None), correlation)(np.eye(9)[:, None])[:, 0].T
    np.testing.assert_allclose(triangle[inside], expected, atol=1e-12)
    assert not triangle[4].any()
    logarithm = Filters((correlation,), weighted).logarithm(1)
    assert logarithm[0, 0] == pytest.approx(np.linalg.slogdet(covariance[inside])[1])


def test_touches_follow_those_of_their_own_direction():
    """A vector that drifts, of which every touch shows one component from one side or the other: its covariance, from
    touch to touch along the whole sequence, by its definition."""
    correlation = Correlation(0.8, 0.6)
    rng = np.random.default_rng(2)
    axis, sign = rng.integers(0, 3, 14), rng.choice([-1.0, 1.0], 14)
    lag = np.abs(np.subtract.outer(np.arange(14), np.arange(14)))
    alike = np.equal.outer(axis, axis) * np.outer(sign, sign)
    covariance = 0.6 * 0.8**lag * alike + 0.4 * np.eye(14)
    order = np.argsort(axis, kind="stable")
    begins = np.diff(axis[order], prepend=-1) != 0
    steps = np.where(begins, 1, np.diff(order, prepend=0)).astype(float)
    rows = Rows(
        np.ones((1, 14), dtype=bool),
        1,
        sign[None, :, None, None],
        begins[None],
        None,
        order[None],
        steps[None],
    )
    whitening = Whitening(rows, correlation)
    filtered = np.array([whitening(unit[None])[0] for unit in np.eye(14)]).T
    np.testing.assert_allclose(filtered @ covariance @ filtered.T, np.eye(14), atol=1e-12)
    filters = Filters((correlation,), rows.weighted, rows.begins, rows.steps)
    assert filters.logarithm(1)[0, 0] == pytest.approx(np.linalg.slogdet(covariance)[1])
    numbers = rng.normal(size=(1, 14))
    np.testing.assert_allclose(whitening.undone(whitening(numbers)), numbers, atol=1e-12)


@pytest.mark.parametrize(("rho", "days", "each"), [(0.6, 2, 2), (0.6, 1, 1), (0.9, 2, 2)])
def test_the_correlation_of_neighbours_is_estimated(virtual_campaigns, trial, rho, days, each):
    campaign, _ = virtual_campaigns.virtual(3, noise=trial.autoregressive(rho), days=days, runs_per_day=each)
    correlation = fit(problem_of(campaign)).correlation()
    assert correlation is not None
    # 150 degrees of freedom a run determine a correlation to some 0.07.
    assert correlation.rho * correlation.share == pytest.approx(rho, abs=0.2)


def test_how_far_a_random_walk_drifts_is_estimated():
    """A walk of 0.25 a reading and independent noise of 0.7: the variance of its drift over a run of 62 readings, as a
    multiple of the independent variance, in the median of 40 campaigns. With coarse shares half of it was estimated."""
    empty = load("trial_empty", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_empty.py")
    plan, drifts = empty.Plan(days=1, each=2), []
    for seed in range(40):
        walk = 1e-3 * empty.NOISES["random walk"](np.random.default_rng(seed), plan.run)
        correlation = plan.fit.noise_design.correlation(plan.noisy(walk).solution.last.residual)
        share, rho = (0.0, 0.0) if correlation is None else (correlation.share, correlation.rho)
        drifts.append(2.0 * share * (1.0 - rho**62) / max(1.0 - share, 0.01))
    assert float(np.median(drifts)) == pytest.approx(62 * (0.25 / 0.7) ** 2, rel=0.3)


def test_white_noise_stays_as_it_is(virtual_campaigns):
    for seed in (1, 2, 3):
        assert (
            fit(problem_of(virtual_campaigns.virtual(seed, days=2, runs_per_day=2)[0])).correlation() is None
        )


def test_sign_flips_agree_with_fits_of_flipped_residuals(virtual_campaigns):
    """Eight runs have 127 other sign patterns: each is fitted anew with numpy."""
    campaign, _ = virtual_campaigns.virtual(5, days=2, runs_per_day=4)
    problem = problem_of(campaign).for_search()
    chain = problem.context.chain
    texts = ("EXX:poly2", "EYX:poly2", "ECC:harmonic2", "EXX:reversal")
    variants = [variant for text in texts for variant in variants_of(parse_effect(text, chain))]
    scene = scene_of(fit(problem), variants)
    pool = Pool(scene.candidates)
    best = weigh_beside(scene, pool, [])[0]
    p_value = p_value_by_flips(scene.remainders.beside([]), pool, best, [scene.run])
    total, dof = float(scene.residual @ scene.residual), scene.degrees_of_freedom
    beaten = 0
    for flips in signs(8).T:
        flipped = scene.residual * flips[scene.run]
        scores = []
        for candidate in scene.candidates:
            size = np.linalg.matrix_rank(candidate.columns / np.linalg.norm(candidate.columns, axis=0))
            coefficients = scipy.linalg.lstsq(candidate.columns, flipped, cond=1e-10)[0]
            stays = float(np.sum((flipped - candidate.columns @ coefficients) ** 2))
            scores.append(dof * np.log(total / stays) - size * np.log(dof))
        beaten += max(scores) >= best.score
    assert p_value == pytest.approx((1 + beaten) / 128)


@pytest.mark.slow
def test_nothing_is_told_of_empty_campaigns_in_correlated_noise(virtual_campaigns, trial, explained, seeds):
    """At 1.5 % a campaign, two alarms in four are a chance of 1.3e-3."""
    alarms = []
    for seed in seeds(30, 2):
        for rho in (0.3, 0.6):
            campaign, _ = virtual_campaigns.virtual(
                seed, noise=trial.autoregressive(rho), days=2, runs_per_day=2
            )
            alarms += explained(campaign).missing
    assert len(alarms) <= 1


def test_a_finding_stands_at_the_end_too(virtual_campaigns, trial):
    """What an exchange or a merger has made doubtful is no finding: p = q = 1 was told in this noise."""
    for seed in (201,):
        campaign, _ = virtual_campaigns.virtual(seed, noise=trial.autoregressive(0.6), days=2)
        answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
        assert all(finding.q_value <= 0.01 for finding in answer.missing)


def test_lack_of_fit_is_held_against_runs_with_the_noise_of_neighbours_taken_out(
    virtual_campaigns, trial, simulator
):
    """White noise: the plain F test. Neighbours of 0.9: what the plain test calls certain is no longer so; an effect
    stays beyond doubt. One run has nothing to compare."""
    white = fit(problem_of(virtual_campaigns.virtual(3, days=2, runs_per_day=2)[0]))
    assert white.correlation() is None
    assert beyond_neighbours(white) == pytest.approx(lack_of_fit(white)[0].p_value, rel=1e-6)
    assert beyond_neighbours(fit(problem_of(virtual_campaigns.virtual(3, days=1, runs_per_day=1)[0]))) is None
    correlated = {"noise": trial.autoregressive(0.9), "days": 1, "runs_per_day": 2}
    # Of sixty right models with this noise the one with the third smallest plain p-value.
    right = fit(problem_of(virtual_campaigns.virtual(25, **correlated)[0]))
    assert lack_of_fit(right)[0].p_value < 1e-5
    assert beyond_neighbours(right) > 0.05
    hidden = [simulator.Effect("EXX:reversal", peak_um=5.0)]
    wrong = fit(problem_of(virtual_campaigns.virtual(25, hidden, **correlated)[0]))
    assert beyond_neighbours(wrong) < 1e-6


def test_seven_runs_have_too_few_flips_whatever_their_rounding(virtual_campaigns):
    """63 flips of seven runs give 1/64 at least, which passes no level of 1 %. An effective number of 7.000000000001
    made them enough: a wobble of 8 um in noise of 0.5 um was named in some weeks and not in others."""
    campaign, _ = virtual_campaigns.virtual(5, days=7, runs_per_day=1)
    problem = problem_of(campaign).for_search()
    texts = ("EXX:poly2", "EYX:poly2", "ECC:harmonic2", "EAC:harmonic2", "EXX:reversal", "EYY:poly3")
    variants = [
        variant for text in texts for variant in variants_of(parse_effect(text, problem.context.chain))
    ]
    scene = scene_of(fit(problem), variants)
    pool = Pool(scene.candidates)
    for evidence in weigh_beside(scene, pool, []):
        assert p_value_by_flips(scene.remainders.beside([]), pool, evidence, [scene.run]) is None
