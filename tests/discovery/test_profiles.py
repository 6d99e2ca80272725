"""Profiles of an error weighed without their columns, against the columns themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.profiles import ErrorProfiles
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.effects import parse_effect
from monitor.effects.shapes import Sawtooth
from monitor.effects.shapes.sawtooth import sawtooths
from monitor.methods.samba.method import problem_of


@pytest.mark.parametrize("correlation", [None, Correlation(0.8, 0.7)])
@pytest.mark.parametrize("symbol", ["EYX", "ECX"])
def test_profiles_have_the_scores_of_their_columns(virtual_campaigns, correlation, symbol):
    campaign, _ = virtual_campaigns.virtual(77, days=1, runs_per_day=2)
    fitted = fit(problem_of(campaign).for_search()).with_correlation(correlation)
    chain = fitted.problem.context.chain
    scene = scene_of(
        fitted, [Variant(text, parse_effect(text, chain)) for text in ("EZZ:poly2", "EYX:poly2")]
    )
    effect = parse_effect(f"{symbol}:poly2", chain)
    pitches, edges = np.array([61.0, 84.0, 84.0, 120.0, 1e6]), np.array([3.0, -20.0, 5.0, 40.0, -1e6])
    variants = [
        Variant("saw", replace(effect, shape=Sawtooth(pitch, edge)), 7)
        for pitch, edge in zip(pitches.tolist(), edges.tolist(), strict=True)
    ]
    profiles = ErrorProfiles(scene, effect)
    joint = effect.joint.sign * fitted.problem.context.places[:, effect.term.joint]
    seen = profiles.of(sawtooths(joint, pitches, edges))
    candidates = scene_of(fitted, variants).candidates
    shares = [candidate.share for candidate in candidates]
    # A pitch beyond all positions is a straight line, of which the base leaves nothing but rounding.
    np.testing.assert_allclose(seen.shares, shares, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(seen.largest, [candidate.largest for candidate in candidates], rtol=1e-12)
    for others in ([], scene.candidates[:1], scene.candidates):
        weighed = {
            evidence.candidate.effect.shape: evidence.score + evidence.candidate.behind
            for evidence in weigh_beside(scene, candidates[:4], others)
        }
        expected = [weighed[variant.effect.shape] for variant in variants[:4]]
        np.testing.assert_allclose(profiles.scores(seen, 7, others)[:4], expected, rtol=1e-8, atol=1e-8)


def test_the_transposed_filter_has_the_products_of_the_filter(virtual_campaigns):
    campaign, _ = virtual_campaigns.virtual(77, days=1, runs_per_day=2)
    fitted = fit(problem_of(campaign).for_search()).with_correlation(Correlation(0.93, 0.8))
    numbers = np.random.default_rng(3).normal(size=(2, 4, *fitted.solution.last.residual.shape))
    filtered, transposed = fitted.whitening(numbers[0]), fitted.whitening.transposed(numbers[1])
    products = np.einsum("arn,brn->ab", filtered, numbers[1])
    np.testing.assert_allclose(
        products, np.einsum("arn,brn->ab", numbers[0], transposed), rtol=1e-9, atol=1e-9
    )
