"""Effects held against noise that walks: likelihoods, prices and p-values against dense matrices written out here."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from monitor.discovery import fit
from monitor.discovery.machine.evidence.noise_doubt import NoiseDoubt
from monitor.discovery.machine.fit import MOST_CORRELATIONS, SMALLEST_WEIGHT
from monitor.discovery.machine.noise.correlation import GRID, Correlation, NoiseDesign
from monitor.discovery.machine.noise.rows import Rows
from monitor.discovery.machine.noise.whitening import Whitening
from monitor.discovery.machine.rounds import ChainSearch
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.machine.suspects.suspects import Suspects, with_effects
from monitor.discovery.search.projection import without
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of

SLOW = Correlation(0.93, 0.8)


def covariance_of(correlation, turned, stated=0):
    """The covariance (3T, 3T) of the vectors of T touches, of which ``turned`` (T, 3, 3) makes readings of the axes:
    what each axis reads follows itself, by the definition of the correlation. So many ``stated`` quantities behind them
    have a variance of their own."""
    touches = len(turned)
    lag = np.abs(np.subtract.outer(np.arange(touches), np.arange(touches)))
    alike = np.eye(touches)
    if correlation is not None:
        alike = correlation.share * correlation.rho**lag + (1.0 - correlation.share) * alike
    blocks = np.einsum("ts,tki,skj->tisj", alike, turned, turned)
    return scipy.linalg.block_diag(blocks.reshape(3 * touches, 3 * touches), np.eye(stated))


def contrasts_of(columns):
    """An orthonormal basis of what is at right angles to columns."""
    return scipy.linalg.null_space(columns.T, rcond=1e-9)


def generalised(covariance, numbers, columns):
    """What generalised least squares leaves of numbers, squared, and the rank of the columns."""
    triangle = np.linalg.inv(np.linalg.cholesky(covariance))
    white, design = triangle @ numbers, triangle @ columns
    basis = scipy.linalg.orth(design, rcond=1e-9) if columns.size else np.empty((len(numbers), 0))
    return float(np.sum((white - basis @ (basis.T @ white)) ** 2)), basis.shape[1]


def dense_deviance(correlation, turned, base, more, numbers):
    """Minus twice the logarithm of the likelihood of the contrasts of ``base``, with the columns of ``more`` fitted;
    and how many contrasts there are, and the rank of ``more`` in them. ``turned`` (R, T, 3, 3) is of every run."""
    contrasts = contrasts_of(base)
    stated = len(base) // len(turned) - 3 * turned.shape[1]
    noise = scipy.linalg.block_diag(*(covariance_of(correlation, each, stated) for each in turned))
    within = contrasts.T @ noise @ contrasts
    squares, rank = generalised(within, contrasts.T @ numbers, contrasts.T @ more)
    count = contrasts.shape[1]
    return np.linalg.slogdet(within)[1] + count * np.log(squares / count), count, rank


@pytest.mark.parametrize("correlation", [None, SLOW, Correlation(0.998, 0.97)])
def test_the_likelihood_of_two_models_is_that_of_the_same_contrasts(correlation):
    """Harville (1977), section 4.2: restricted by the base alone, whatever columns a model adds to it."""
    rng = np.random.default_rng(5)
    touches = 25
    turned = scipy.stats.special_ortho_group.rvs(3, touches, random_state=rng)
    base, more = rng.normal(size=(3 * touches, 6)), rng.normal(size=(3 * touches, 2))
    numbers = rng.normal(size=3 * touches)
    rows = Rows(np.ones((1, touches), dtype=bool), 3, turned[None])

    first = NoiseDesign(rows, np.zeros((1, touches), dtype=np.int64), scipy.linalg.orth(base)[None], True)
    for added in (np.empty((len(base), 0)), more):
        every = np.concatenate([numbers[:, None], base, added], axis=1)
        white = every if correlation is None else Whitening(rows, correlation)(every.T[:, None])[:, 0].T
        squares = float(np.sum(without(scipy.linalg.orth(white[:, 1:]), white[:, :1]) ** 2))
        expected, count, _ = dense_deviance(correlation, turned[None], base, added, numbers)
        assert first.deviance(squares, correlation) == pytest.approx(expected, rel=1e-9)
        assert first.contrasts == count


@pytest.fixture(scope="module")
def walked(virtual_campaigns, simulator):
    """Two runs of half a play of X, with noise that walks, and their problem; of a single run the first."""

    def noise(rng, run):
        fresh = rng.standard_normal((len(run), 3))
        walk = np.concatenate([np.cumsum(0.25 * fresh[run == number], axis=0) for number in np.unique(run)])
        return walk + 0.7 * rng.standard_normal((len(run), 3))

    def problem(runs):
        hidden = [simulator.Effect("EXX:reversal", peak_um=0.6)]
        campaign, _ = virtual_campaigns.virtual(11, hidden, days=1, runs_per_day=runs, noise=noise)
        return problem_of(campaign).for_search()

    return problem


def candidate_of(under, text):
    """An effect as a candidate in a fit."""
    effect = parse_effect(text, under.problem.context.chain)
    return scene_of(under, variants_of(effect)).candidates[0]


def columns_of_effect(problem, candidate, shape):
    """What a unit of an effect does to the numbers (R, N) of a problem, as columns."""
    moved = problem.padded(candidate.raw / problem.sigma[:, :, None]).reshape(shape[0], -1, 1)
    return np.pad(moved, ((0, 0), (0, shape[1] - moved.shape[1]), (0, 0))).reshape(-1, 1)


@pytest.mark.parametrize("runs", [1, 2])
def test_what_few_runs_are_explained_by_costs_its_likelihood_and_every_choice(walked, runs):
    """Effects, a reading that is left out and noise that walks, in every combination, against dense matrices: a reading
    that is left out is three columns of its own, and an effect has one size in all runs."""
    problem = walked(runs)
    first = fit(problem)
    variants = [
        variant
        for text in ("EXX:reversal", "EYX:poly2", "EZZ:cyclic20mm", "EZC1:const@warmup")
        for variant in variants_of(parse_effect(text, problem.context.chain))
    ]
    search = ChainSearch(problem, variants, (), 0.01, Suspects())
    turned, last = first.noise_design.rows.turned, first.solution.last
    base = scipy.linalg.block_diag(*last.local)
    if runs == 1:
        base = np.concatenate([last.local[0], last.common[0]], axis=1)
    for text, row, correlation in (
        ("", None, None),
        ("", None, SLOW),
        ("EXX:reversal", None, None),
        ("EZC1:const@warmup", 7, None),
        ("EXX:reversal", 7, SLOW),
    ):
        out = np.arange(len(problem.context)) == (-1 if row is None else row)
        chosen = [candidate_of(first, text)] if text else []
        under = fit(with_effects(problem, [each.effect for each in chosen]), out)
        under = under.with_correlation(correlation)
        latest = SimpleNamespace(under=under, refined=[SimpleNamespace(candidate=each) for each in chosen])
        numbers = under.solution.last.residual
        own = np.zeros((numbers.size, 0 if row is None else 3))
        if row is not None:
            own[3 * row : 3 * row + 3] = np.eye(3)
        effects = [columns_of_effect(problem, each, numbers.shape) for each in chosen]
        more = np.concatenate([own, *effects], axis=1)
        deviance, count, rank = dense_deviance(correlation, turned, base, more, numbers.reshape(-1))
        assert rank == (1 if text else 0) + (0 if row is None else 3)
        price = (rank + 2 * (correlation is not None)) * np.log(count)
        price += sum(2.0 * np.log(4 * each.variant.tries * each.variant.odds) for each in chosen)
        assert search.cost(first, latest) == pytest.approx(deviance + price, abs=0.01)


def test_likelihoods_are_the_same_whatever_was_asked_before(walked):
    """Of the grid a correlation asks for a part, in several lots."""
    under = fit(walked(2))
    residual = under.solution.last.residual
    asked, fresh = under.noise_design, replace(under.noise_design)
    assert asked.correlation(residual) is not None
    after, first = (dict(design.likelihoods(residual)) for design in (asked, fresh))
    assert after == pytest.approx(first, rel=1e-9)


def test_unknowns_that_a_run_lacks_or_has_twice_change_no_likelihood(walked):
    under = fit(walked(2))
    residual, design = under.solution.last.residual, under.noise_design
    expected = dict(design.likelihoods(residual))
    first, rest = design.basis[..., :1], design.basis[..., 1:]
    for halves in ([first, np.zeros_like(first)], [first / np.sqrt(2.0)] * 2):
        same = replace(design, basis=np.concatenate([*halves, rest], axis=-1))
        assert dict(same.likelihoods(residual)) == pytest.approx(expected, rel=1e-9)


def test_noise_doubt_is_the_mean_of_generalised_least_squares_over_the_correlations(walked):
    """Two runs: the weights are restricted likelihoods of their difference, which no shared effect changes; the
    p-values are those of F in generalised least squares of both runs."""
    problem = walked(2)
    under = fit(problem)
    correlation = under.correlation()
    assert correlation is not None
    under = under.with_correlation(correlation)
    local, residual = under.solution.last.local, under.solution.last.residual
    turned = under.noise_design.rows.turned
    stated = residual.shape[1] - 3 * turned.shape[1]
    contrasts = contrasts_of(local[0])
    difference = contrasts.T @ (residual[0] - residual[1])
    logarithms = []
    for trial in GRID:
        within = contrasts.T @ covariance_of(trial, turned[0], stated) @ contrasts
        squares = difference @ np.linalg.solve(within, difference)
        logarithms.append(-0.5 * (np.linalg.slogdet(within)[1] + len(difference) * np.log(squares)))
    weight = np.exp(np.array(logarithms) - max(logarithms))
    best = np.argsort(-weight, kind="stable")[:MOST_CORRELATIONS]
    best = best[weight[best] >= SMALLEST_WEIGHT]

    doubt = NoiseDoubt(scene_of(under, []))
    every = [candidate_of(under, text) for text in ("EYX:poly2", "EXX:reversal")]
    effects = [columns_of_effect(problem, each, residual.shape) for each in every]
    base = scipy.linalg.block_diag(*local)
    for others in ([], every[:1]):
        mean = 0.0
        for index in best:
            covariance = scipy.linalg.block_diag(
                *(covariance_of(GRID[index], each, stated) for each in turned)
            )
            before = np.concatenate([base, *effects[: len(others)]], axis=1)
            rest, rank = generalised(covariance, residual.reshape(-1), before)
            after, all_rank = generalised(
                covariance, residual.reshape(-1), np.concatenate([before, effects[1]], axis=1)
            )
            size, dof = all_rank - rank, residual.size - all_rank
            p_value = scipy.stats.f.sf((rest - after) / size / (after / dof), size, dof)
            mean += weight[index] * p_value / weight[best].sum()
        assert 1e-12 < mean < 0.5
        assert doubt.p_value(others, every[1]) == pytest.approx(mean, rel=0.1)


@pytest.mark.parametrize(
    ("white", "walking", "cheaper", "stands"),
    [
        # Minus twice the logarithm of a likelihood is smaller by so much for the search in noise that walks; at a rate
        # of one in a hundred effects have to be likelier by 2 ln 99 = 9.2.
        ({"EXX"}, set(), -9.0, set()),
        ({"EXX"}, set(), -9.4, {"EXX"}),
        ({"EXX"}, {"EXX", "EYY"}, 9.0, {"EXX"}),
        ({"EXX"}, {"EXX", "EYY"}, 9.4, {"EXX", "EYY"}),
    ],
)
def test_more_effects_have_to_be_likelier_by_the_odds_of_the_rate(
    monkeypatch, white, walking, cheaper, stands
):
    """Whichever of the two searches finds them."""
    rounds = {
        None: SimpleNamespace(refined=white, effects=white, families=frozenset(white), cost=0.0),
        SLOW: SimpleNamespace(refined=walking, families=frozenset(walking), cost=-cheaper),
    }
    module = "monitor.discovery.machine.rounds"
    monkeypatch.setattr(f"{module}.correlation_under", lambda first, shared: SLOW)
    monkeypatch.setattr(f"{module}.poses_of_rows", lambda first: None)
    monkeypatch.setattr(f"{module}.replace", lambda latest, limits: latest)
    monkeypatch.setattr(
        ChainSearch, "_settled", lambda search, first, beside, noise, before: (rounds[noise], True)
    )
    monkeypatch.setattr(ChainSearch, "cost", lambda search, first, latest: latest.cost)
    for each in rounds.values():
        each.suspects = SimpleNamespace(bad=())
    search = ChainSearch(SimpleNamespace(runs=np.arange(2)), (), (), 0.01, None)
    assert search.under(None).families == stands
