"""Effects that lie inside the free shape of a named error: which of them keep their names beside it.

What does not stand beside everything that an error could do in any shape is no finding of its own: beside a bump of an
elevation refraction and flexure, which are functions of the elevation as well, mend what the parts of its shape do not
follow. An effect that alone says nearly all that the shape says is the simpler explanation, and keeps its name. The
parts of the shape are selected anew beside those that stay.
"""

from __future__ import annotations

from collections.abc import Sequence

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.bends import foretells_poses
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import (
    is_free,
    of_parts,
    parts_worth_keeping,
    priced,
    whole_basis,
)
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import WORTH_EXCHANGING

# An effect stands out beside others at this level: one finding in a thousand.
LEVEL = 1e-3
# An effect inside a shape keeps its name where it alone takes away so much of what the shape does. Of 24 bumps of an
# elevation flexure or refraction took as much in 5, of 48 beside flexure or refraction these did in 30.
MOST_OF_SHAPE = 0.75
# What bends the line of sight of every telescope.
BENDING_SIGHT = ("flexure:tool@gravity", "sight:up:formula(1/tan(elevation))")


def bending_sight(scene: ChainScene) -> list[ChainCandidate]:
    """Flexure and refraction, which together bend the line of sight as a free shape may; none where nothing points."""
    if scene.fit.problem.context.sight is None:
        return []
    return [each for each in scene.candidates if each.visible and each.family in BENDING_SIGHT]


def standing_beside(
    scene: ChainScene, others: Sequence[ChainCandidate], effects: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """Those of some effects that stand out beside others."""
    standing: list[ChainCandidate] = []
    for effect in effects:
        (evidence,) = weigh_beside(scene, [effect], [*others, *standing])
        if evidence.p_value * scene.families < LEVEL:
            standing.append(effect)
    return standing


def with_those_outside(scene: ChainScene, selected: list[ChainCandidate]) -> list[ChainCandidate]:
    """The selected effects without those inside a free shape; where some go its parts are selected anew."""
    for free in filter(is_free, list(selected)):
        outside = _beside_shape(scene, free, [each for each in selected if each is not free])
        if {each.family for each in outside} != {each.family for each in selected}:
            selected = outside
    return selected


def _beside_shape(
    scene: ChainScene, free: ChainCandidate, others: list[ChainCandidate]
) -> list[ChainCandidate]:
    """The effects that keep their names beside a free shape, and its parts beside these; of effects that were not
    selected, those that bend every line of sight may."""
    symbol = error_of(free)
    whole = whole_basis(scene, symbol, free)
    of_error = [each for each in others if error_of(each) == symbol]
    named = [*of_error, *standing_beside(scene, [whole, *of_error], _of_other_errors(others, symbol))]
    names = {each.family for each in named}
    inside = {each.family: each for each in [*others, *bending_sight(scene)] if each.family not in names}
    shape = _shape(scene, free, whole, named) if inside else None
    if shape is None:
        return [*others, free]
    while shape is not None and inside:
        explained = {name: weigh_beside(scene, [each], named)[0].explained for name, each in inside.items()}
        largest = max(explained, key=explained.__getitem__)
        beside = [*named, inside.pop(largest)]
        part_of = weigh_beside(scene, [shape], named)[0].explained
        further = _shape(scene, free, whole, beside)
        gain = priced(scene, _with(beside, further)) - priced(scene, _with(named, shape))
        if explained[largest] < MOST_OF_SHAPE * part_of or gain < -UNDECIDED:
            break
        named, shape = beside, further
    if shape is None:
        # Of what was selected no shape is left to hide it.
        named += standing_beside(scene, named, [each for each in others if each.family in inside])
    return _with(named, shape)


def _of_other_errors(effects: Sequence[ChainCandidate], symbol: str) -> list[ChainCandidate]:
    return [each for each in effects if error_of(each) != symbol]


def _with(effects: Sequence[ChainCandidate], shape: ChainCandidate | None) -> list[ChainCandidate]:
    return [*effects, *([] if shape is None else [shape])]


def _shape(
    scene: ChainScene, free: ChainCandidate, whole: ChainCandidate, others: Sequence[ChainCandidate]
) -> ChainCandidate | None:
    """The parts of a free shape that are worth their price beside others; None where none are, or they raise the error
    at poses left out."""
    parts = parts_worth_keeping(scene, whole, others)
    if not parts:
        return None
    symbol = error_of(free)
    shapes = [each for each in scene.candidates if error_of(each) == symbol and not is_free(each)]
    shape = of_parts(scene, symbol, parts, shapes, others)
    worth = priced(scene, [*others, shape]) > priced(scene, others) + WORTH_EXCHANGING
    return shape if worth and foretells_poses(scene, [shape], others) else None
