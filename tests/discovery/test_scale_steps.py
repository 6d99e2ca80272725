"""Steps of an error of a linear axis at searched places; the simulator shares no code."""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import explain, fit, nearest_readings, steps_of_model
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.scale_steps import StepsOfError
from monitor.discovery.machine.shapes.step_places import places_of_steps
from monitor.discovery.machine.shapes.step_widths import sharpness
from monitor.discovery.machine.shapes.steps_instead import steps_instead
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of


def step(q, travel, now):
    return (q > 20.0) - 0.5


def region(q, travel, now):
    return ((q > -60.0) & (q < 40.0)) - 0.5


def steps_beside_nothing(campaign, error):
    scene = scene_of(fit(problem_of(campaign).for_search()), [])
    steps = StepsOfError(scene, parse_effect(f"{error}:poly2", scene.fit.problem.context.chain))
    return steps, steps.beside([])


@pytest.mark.parametrize(("curve", "places"), [(step, [20.0]), (region, [-60.0, 40.0])])
def test_the_places_of_steps_are_found_between_positions(virtual_campaigns, curve, places):
    hidden = simulator().Effect("EXX:curve", peak_um=8.0, curve=curve)
    campaign, _ = virtual_campaigns.virtual(77, [hidden], days=1, runs_per_day=2)
    steps, (found,) = steps_beside_nothing(campaign, "EXX")
    shape = found.effect.shape
    between = places_of_steps(steps, shape, [])
    assert len(between) == len(places)
    for place, told, interval in zip(places, shape.readings, between, strict=True):
        assert interval.low < place < interval.high
        assert interval.low < told < interval.high
    assert found.variant.tries > 1
    # Over three gaps between positions or more each of the steps says far less.
    assert sharpness(steps, found, []) > 50.0
    grown = problem_of(campaign, Model("grown", added=(found.effect.text,)))
    (of_model,) = steps_of_model(fit(grown)).values()
    # Maps and certificates say the same.
    for interval, same in zip(between, of_model, strict=True):
        assert (same.low, same.high) == pytest.approx((interval.low, interval.high))


def test_a_step_is_weighed_as_the_data_see_its_effect(virtual_campaigns):
    hidden = simulator().Effect("EXX:curve", peak_um=8.0, curve=step)
    campaign, _ = virtual_campaigns.virtual(77, [hidden], days=1, runs_per_day=1)
    steps, (found,) = steps_beside_nothing(campaign, "EXX")
    shape = found.effect.shape
    np.testing.assert_allclose(steps.columns(shape.readings, shape.width), found.columns, rtol=0, atol=1e-9)


def test_a_free_shape_of_a_step_alone_is_told_by_its_place(virtual_campaigns):
    """The flexible basis has a step between every two hats: near one of them it was `EXX:free(47)`."""
    hidden = simulator().Effect("EXX:curve", peak_um=8.0, curve=lambda q, travel, now: (q > 37.5) - 0.5)
    campaign, _ = virtual_campaigns.virtual(203, [hidden], days=1, runs_per_day=2)
    fitted = fit(problem_of(campaign).for_search())
    names = ("EXX:free(47)", "EXX:free(7)")
    variants = [Variant(name, parse_effect(name, fitted.problem.context.chain)) for name in names]
    scene = scene_of(fitted, variants)
    step_part, hat = scene.candidates
    (named,) = steps_instead(scene, step_part, [])
    assert named.effect.text.startswith("EXX:step(")
    assert steps_instead(scene, hat, []) == []


@pytest.mark.parametrize("told", [60.0, 30.0])
def test_a_step_over_a_width_is_known_by_the_positions_within_it(virtual_campaigns, told):
    """Its width was taken as known: the middle was too sure, and the ends of a wider way lay outside."""

    def ramp(q, travel, now):
        return np.clip((q - 20.0) / 60.0, -0.5, 0.5)

    hidden = simulator().Effect("EXX:curve", peak_um=8.0, curve=ramp)
    campaign, _ = virtual_campaigns.virtual(77, [hidden], days=1, runs_per_day=2)
    ((between,),) = steps_of_model(
        fit(problem_of(campaign, Model("grown", added=(f"EXX:step{told:g}mm(20)",))))
    ).values()
    first, last = between.middle
    assert between.width == told
    assert first <= 20.0 <= last
    assert between.low <= -10.0
    assert between.high >= 50.0
    # So far the true way lies off the told one at the ends of that.
    assert between.part >= (1.0 - told / 60.0) / 2.0
    # At the next position on either side of the ramp the middle could lie 20 mm off.
    assert last - first < 20.0


def test_a_step_at_a_position_lies_between_its_neighbours():
    at = np.repeat([0.0, 200.0, 250.0, 300.0], 3) + np.tile([-0.01, 0.0, 0.01], 4)
    for place, low, high in ((250.0, 200.01, 299.99), (230.0, 200.01, 249.99), (250.2, 250.01, 299.99)):
        between = nearest_readings(at, place, 0.0)
        assert (between.low, between.high) == pytest.approx((low, high))
    # Positions everywhere tell the place of any.
    dense = nearest_readings(np.arange(0.0, 100.0, 0.2), 50.1, 0.0)
    assert (dense.low, dense.high) == pytest.approx((50.0, 50.2))


def test_where_nothing_is_hidden_no_step_is_worth_its_price(virtual_campaigns):
    campaign, _ = virtual_campaigns.virtual(77, days=1, runs_per_day=1)
    _, found = steps_beside_nothing(campaign, "EXX")
    assert found == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "companion"),
    [pytest.param(3.0, "EXX:reversal", marks=pytest.mark.all_seeds), (8.0, "EXX:poly2")],
)
def test_a_step_is_told_beside_another_effect_of_its_error(virtual_campaigns, explained, size, companion):
    """A free shape, or a table with cycles, was told in place of both."""
    hidden = simulator().Effect("EXX:curve", peak_um=8.0, curve=step)
    beside = simulator().Effect(companion, peak_um=size)
    campaign, _ = virtual_campaigns.virtual(78, [hidden, beside], days=2)
    told = {found.effect.partition("(")[0] for found in explained(campaign).missing}
    assert told == {"EXX:step", companion}


@pytest.mark.slow
def test_a_step_is_told_alone_and_a_model_with_it_lacks_nothing(virtual_campaigns, explained):
    """A table, a cycle and a free shape of another axis were told in its place."""
    hidden = simulator().Effect("EXX:curve", peak_um=8.0, curve=step)
    campaign, _ = virtual_campaigns.virtual(77, [hidden], days=2)
    (found,) = explained(campaign).missing
    assert found.effect.startswith("EXX:step")
    (interval,) = found.steps
    assert interval.low < 20.0 < interval.high
    grown = problem_of(campaign, Model("grown", added=(found.effect,)))
    (of_model,) = steps_of_model(fit(grown))[found.effect]
    assert (of_model.low, of_model.high) == pytest.approx((interval.low, interval.high))
    assert explain(campaign, grown, "grown", rng=np.random.default_rng(1)).missing == ()
