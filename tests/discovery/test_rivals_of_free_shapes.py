"""A free shape of one error is that of another where the plan moves the tip alike: with one length of the tool, say."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.discovery import explain, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.separation.rivals import RivalSearch
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import least_likelihood
from monitor.effects import parse_effect
from monitor.methods.samba.method import problem_of


def fifth(q, travel, now):
    """A shape that the catalogue does not have."""
    return np.cos(5 * q + 0.4)


@pytest.fixture(scope="module")
def campaign(virtual_campaigns, simulator):
    """A fork head whose last axis turns 200 mm above the tip, with a fifth harmonic of its turn."""
    hidden = [simulator.Effect("EBB:curve", peak_um=8.0, curve=fifth)]
    return virtual_campaigns.on_machine("fork head", 3, hidden)[0]


def test_a_shift_of_a_head_and_its_turn_are_rivals_in_every_shape(campaign):
    """By rigid bodies: a turn of B by e moves a tip that stands r below it by e times r across, and so does a shift of
    B along X; along Y and Z it moves nothing."""
    fitted = fit(problem_of(campaign).for_search())
    effect = parse_effect("EXB:free(7,8,10,11,13)", fitted.problem.context.chain)
    scene = scene_of(fitted, [Variant("EXB:free", effect)])
    (candidate,) = scene.candidates
    estimate = amplitudes(scene, [candidate]).estimate
    least = least_likelihood(weigh_beside(scene, [candidate], [])[0])
    rivals = RivalSearch(scene, [candidate], ()).rivals(0, least, estimate)
    assert [(rival.family, same) for rival, same in rivals] == [("EBB:free(7,8,10,11,13)", True)]


@pytest.mark.slow
def test_explain_names_the_turn_of_a_head_beside_its_shift(campaign):
    told = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))
    (effect,) = told.missing
    names = {effect.effect, *(rival.effect for rival in effect.rivals)}
    assert {name.partition(":")[0] for name in names} == {"EXB", "EBB"}
