"""Waves of a free shape are told by their names, what is left of it stays free; the simulator shares no code."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from by_path import simulator

from monitor.discovery import fit
from monitor.discovery.machine.missing import standing_out
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.search.amplitudes import amplitudes, length_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of


@pytest.mark.slow
def test_a_fifth_wave_is_told_as_one_with_its_size(virtual_campaigns, explained):
    """It was `ECC:free(9,10)`: cosine and sine of five periods a turn."""
    sim = simulator()
    hidden = sim.Effect("ECC:curve", peak_um=8.0, curve=lambda q, t, now: np.cos(5.0 * q + 0.7))
    campaign, _ = virtual_campaigns.virtual(64000, [hidden], days=2)
    (missing,) = explained(campaign).missing
    assert missing.effect == "ECC:harmonic5"
    assert missing.peak * 1e3 == pytest.approx(8.0, rel=0.1)
    assert not [rival for rival in missing.rivals if "free" in rival.effect]


def wave_beside_play(virtual_campaigns, seed):
    """Two errors of one table: run-out of two lobes, and a play that builds up over half a turn."""
    sim = simulator()
    hidden = [
        sim.Effect("ECC:harmonic2", peak_um=6.0, direction=(1.0, 0.4)),
        sim.Effect("ECC:curve", peak_um=5.0, curve=lambda q, travel, now: travel * np.abs(np.sin(q / 2.0))),
    ]
    return virtual_campaigns.virtual(seed, hidden, days=2)[0]


@pytest.mark.slow
def test_a_wave_beside_a_play_that_builds_up_is_told_by_its_name(virtual_campaigns, explained):
    """Both went into one free shape of C, on some processors with a single part of another wave."""
    named = [effect.effect for effect in explained(wave_beside_play(virtual_campaigns, 64101)).missing]
    assert "ECC:harmonic2" in named
    assert all(name.startswith("ECC:") for name in named)


@pytest.mark.slow
def test_at_a_dozen_poses_the_axis_that_tilts_a_table_is_no_answer_alone(virtual_campaigns, explained):
    """Of this seed a free shape of B is likelier by chance: the readings do not tell the two apart."""
    (missing,) = explained(wave_beside_play(virtual_campaigns, 64103)).missing
    names = [missing.effect, *(rival.effect for rival in missing.rivals)]
    assert {name.partition(":")[0] for name in names} >= {"ECB", "ECC"}


# Seeds of which `explain` told nothing, `ECB:harmonic3`, nothing and `ECB:free(7)`.
LOST_WAVES = (2712, 2713, 2717, 1202)


def eighth_harmonic(virtual_campaigns, seed):
    hidden = simulator().Effect("ECC:curve", peak_um=3.0, curve=lambda q, t, now: np.cos(8.0 * q + 0.4))
    return virtual_campaigns.virtual(seed, [hidden], days=2)[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [*LOST_WAVES[:1], *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in LOST_WAVES[1:])]
)
def test_a_slight_wave_of_many_periods_is_told(virtual_campaigns, explained, seed):
    """What stood in its way: a size that is uncertain though the wave is not, a wave of another axis that the catalogue
    has, and, of all things, that all poses together show lack of fit."""
    (missing,) = explained(eighth_harmonic(virtual_campaigns, seed)).missing
    assert missing.effect == "ECC:harmonic8"
    assert missing.held_out_after < missing.held_out_before
    assert missing.held_out_poses_after < missing.held_out_poses_before


def test_a_wave_that_is_found_alone_may_have_a_size_that_is_uncertain(virtual_campaigns):
    """Cosine and sine are certain together (F by dense least squares); the plan sees one of them badly."""
    fitted = fit(problem_of(eighth_harmonic(virtual_campaigns, 2712)).for_search())
    wave = Variant("ECC:harmonic8", parse_effect("ECC:harmonic8", fitted.problem.context.chain))
    scene = scene_of(fitted, [wave])
    (candidate,) = scene.candidates
    sizes = amplitudes(scene, [candidate])
    length, u = length_of(sizes.estimate, sizes.covariance)
    assert length < 2.0 * u
    estimate, rest, *_ = np.linalg.lstsq(candidate.columns, scene.residual, rcond=None)
    freedom = scene.degrees_of_freedom - 2
    explained = float(scene.residual @ scene.residual - rest[0])
    assert scipy.stats.f.sf(explained / 2.0 / (rest[0] / freedom), 2, freedom) < 1e-4
    assert np.allclose(-estimate, sizes.estimate)
    result = ScanResult(findings_of(scene, [candidate]))
    assert standing_out(scene, result).candidates == [candidate]
