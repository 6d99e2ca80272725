"""What comes nearest to a shape of position alone tells no direction: a bend is no drive that is wound up."""

from __future__ import annotations

from typing import Any

import pytest
from by_path import simulator

from monitor.discovery import fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.shapes.free_parts import of_parts
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.effects.shapes.free import Follows, Free
from monitor.methods.samba.method import problem_of

SHAPES = ("EBB:harmonic1", "EBB:harmonic2", "EBB:windup30deg", "EBB:reversal")
#: The third part of a rotary axis is cos 2B, the seventeenth its direction.
SECOND_HARMONIC, DIRECTION = 2, 16


@pytest.fixture(scope="module")
def scene(virtual_campaigns: Any) -> ChainScene:
    """Of a play of B, which a shape with direction follows best whatever the parts of a free shape are."""
    campaign, _ = virtual_campaigns.virtual(
        1, [simulator().Effect("EBB:reversal", peak_um=5.0)], days=1, runs_per_day=2
    )
    problem = problem_of(campaign)
    chain = problem.context.chain
    effects = {text: parse_effect(text, chain) for text in SHAPES}
    return scene_of(fit(problem), [Variant(text, effect) for text, effect in effects.items()])


@pytest.mark.parametrize(
    ("parts", "follows", "nearest"),
    [
        ([SECOND_HARMONIC], {Follows.POSITION}, ("EBB:harmonic1", "EBB:harmonic2")),
        ([SECOND_HARMONIC, DIRECTION], {Follows.POSITION, Follows.DIRECTION}, ("EBB:reversal", "EBB:windup30deg")),
    ],
)  # fmt: skip
def test_a_shape_of_direction_is_nearest_to_one_that_has_it(
    scene: ChainScene, parts: list[int], follows: set[Follows], nearest: tuple[str, ...]
) -> None:
    free = of_parts(scene, "EBB", parts, scene.candidates, [])
    effect: Any = free.effect
    assert isinstance(effect.shape, Free)
    assert set(effect.shape.following(scene.fit.problem.context, effect.term.joint)) == follows
    assert free.variant.nearest in nearest


def test_where_all_shapes_tell_the_direction_the_best_of_them_is_nearest(scene: ChainScene) -> None:
    of_direction = [each for each in scene.candidates if "harmonic" not in each.family]
    nearest = of_parts(scene, "EBB", [SECOND_HARMONIC], of_direction, []).variant.nearest
    assert nearest in ("EBB:reversal", "EBB:windup30deg")


def test_a_part_of_direction_that_is_no_more_than_noise_brings_none(virtual_campaigns: Any) -> None:
    campaign, _ = virtual_campaigns.virtual(
        3, [simulator().Effect("EBB:harmonic2", peak_um=5.0)], days=1, runs_per_day=2
    )
    problem = problem_of(campaign)
    some = [Variant(text, parse_effect(text, problem.context.chain)) for text in SHAPES[2:] + SHAPES[:1]]
    scene = scene_of(fit(problem), some)
    free = of_parts(scene, "EBB", [SECOND_HARMONIC, SECOND_HARMONIC + 1, DIRECTION], scene.candidates, [])
    assert free.variant.nearest == "EBB:harmonic1"
