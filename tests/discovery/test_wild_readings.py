"""Heavy tails: an effect that a few wild readings make is none, an effect that all readings show stays one.

Rates are in docs/trials-discovery.md, from tests/benchmarks/trial_empty.py.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import fit
from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.evidence.wild_readings import without_wild_readings
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.search.evidence import pool_of, weigh_beside, weigh_in
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of

TEXTS = ("EXX:poly2", "EYX:poly2", "ECC:harmonic2", "EXX:reversal", "EZZ:reversal", "EYY:poly3")


@pytest.fixture(scope="module")
def trial():
    return load("trial_unknown", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_unknown.py")


@pytest.fixture(scope="module")
def scene_under(virtual_campaigns):
    """The scene of some effects in a campaign of eight runs."""

    def scene(seed, hidden=(), **options):
        campaign, _ = virtual_campaigns.virtual(seed, hidden, days=2, runs_per_day=4, **options)
        problem = problem_of(campaign).for_search()
        chain = problem.context.chain
        variants = [variant for text in TEXTS for variant in variants_of(parse_effect(text, chain))]
        return scene_of(fit(problem), variants)

    return scene


def test_normal_readings_have_no_wild_ones(scene_under):
    scene = scene_under(3)
    for candidate in scene.candidates:
        assert without_wild_readings(scene, [], candidate) is None


def test_scores_are_bounded_and_leave_nothing_to_the_unknowns(scene_under, trial):
    """The equations of the estimate: the scores have no product with a run's own unknowns or with an effect beside
    them. The wildest readings count for no more than two scales of Student's t."""
    scene = scene_under(3, noise=trial.heavy)
    other, candidate = scene.candidates[:2]
    plain = scene.remainders.beside([other]).residual
    scores = without_wild_readings(scene, [other], candidate).residual
    own = scene.fit.nuisance.basis
    products = np.einsum("rnk,rn->rk", own, scores.reshape(own.shape[:2]))
    assert np.abs(products).max() < 1e-3
    assert np.abs(other.columns.T @ scores).max() < 1e-9 * np.linalg.norm(other.columns)
    assert np.abs(plain).max() > 6.0 * plain.std()
    assert np.abs(scores).max() < 3.0 * scores.std()


def test_an_effect_that_all_readings_show_stands_in_heavy_tails(scene_under, trial, simulator):
    """It says more than by sums of squares, of which few wild readings are the larger part."""
    scene = scene_under(4, [simulator.Effect("EXX:reversal", peak_um=0.4)], noise=trial.heavy)
    best = weigh_beside(scene, scene.candidates, [])[0]
    assert best.candidate.family == "EXX:reversal"
    (bounded,) = weigh_in(without_wild_readings(scene, [], best.candidate), [best.candidate])
    assert bounded.p_value < best.p_value
    assert ChainAcceptance(scene, (), 0.01).stands_among(pool_of(scene), [], best)


@pytest.mark.slow
def test_a_drift_that_wild_readings_make_is_none():
    """Seven runs, nothing hidden: by sums of squares `EYX:poly1@run_time(7)` stood out of this noise."""
    empty = load("trial_empty", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_empty.py")
    plan = empty.Plan(days=7, each=1)
    noise = 1e-3 * empty.NOISES["heavy tails"](np.random.default_rng((30054, 7)), plan.run)
    assert plan.effects([noise]) == [[]]
