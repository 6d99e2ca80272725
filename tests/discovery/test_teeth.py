"""Teeth: an error of a linear axis as a sawtooth of a searched pitch; the simulator shares no code."""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import explain, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.teeth import TeethOfError
from monitor.discovery.machine.sizes import size_of
from monitor.discovery.search.amplitudes import amplitudes
from monitor.effects import parse_effect
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of


def sawtooth(q, travel, now):
    return (q / 84.0 + 0.3) % 1.0


def test_pitch_and_edge_of_a_sawtooth_are_found(virtual_campaigns):
    error = simulator().Effect("EYX:curve", peak_um=8.0, curve=sawtooth)
    campaign, _ = virtual_campaigns.virtual(77, [error], days=1, runs_per_day=2)
    scene = scene_of(fit(problem_of(campaign).for_search()), [])
    teeth = TeethOfError(scene, parse_effect("EYX:poly2", scene.fit.problem.context.chain))
    (found,) = teeth.beside([])
    shape = found.effect.shape
    # As near as the positions say between which of them the teeth fall.
    assert shape.pitch == pytest.approx(84.0, rel=0.08)
    context = scene.fit.problem.context
    joint = teeth.effect.term.joint
    line = np.column_stack([np.ones(len(context)), context.places[:, joint]])
    told, hidden = (
        values - line @ np.linalg.lstsq(line, values, rcond=None)[0]
        for values in (shape.columns(context, joint)[:, 0], sawtooth(context.places[:, joint], None, None))
    )
    assert abs(np.corrcoef(told, hidden)[0, 1]) > 0.999
    assert found.variant.nearest == f"EYX:cyclic{shape.pitch:.3g}mm"


def test_the_size_of_teeth_is_their_step(virtual_campaigns):
    """``explain`` told half of what ``identify`` says, the largest value of the curve."""
    error = simulator().Effect("EYX:curve", peak_um=8.0, curve=sawtooth)
    campaign, _ = virtual_campaigns.virtual(77, [error], days=1, runs_per_day=2)
    scene = scene_of(fit(problem_of(campaign).for_search()), [])
    (found,) = TeethOfError(scene, parse_effect("EYX:poly2", scene.fit.problem.context.chain)).beside([])
    sizes = amplitudes(scene, [found])
    size = size_of(found, sizes.estimate, sizes.covariance)
    assert size.amplitude == sizes.estimate[0]
    assert size.u == pytest.approx(float(np.sqrt(sizes.covariance[0, 0])))
    assert np.abs(size.curve.size).max() == pytest.approx(abs(size.amplitude) / 2.0, rel=0.3)


def test_an_error_that_is_among_the_others_has_no_teeth_beside_them(virtual_campaigns):
    campaign, _ = virtual_campaigns.virtual(77, days=1, runs_per_day=1)
    scene = scene_of(fit(problem_of(campaign).for_search()), [])
    effect = parse_effect("EYX:poly2", scene.fit.problem.context.chain)
    teeth = TeethOfError(scene, effect)
    assert teeth.beside([]) == []


@pytest.mark.slow
def test_a_sawtooth_is_told_alone_and_a_model_with_it_lacks_nothing(virtual_campaigns, explained):
    """Cycles of this error and free shapes of others were told in its place."""
    hidden = simulator().Effect("EYX:curve", peak_um=8.0, curve=sawtooth)
    campaign, _ = virtual_campaigns.virtual(77, [hidden], days=2)
    (found,) = explained(campaign).missing
    assert found.effect.startswith("EYX:sawtooth8")
    assert found.nearest.startswith("EYX:cyclic8")
    assert len(found.curve.at) > 10
    grown = problem_of(campaign, Model("grown", added=(found.effect,)))
    assert explain(campaign, grown, "grown", rng=np.random.default_rng(1)).missing == ()
