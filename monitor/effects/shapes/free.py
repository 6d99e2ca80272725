"""``free``: a shape that nobody knows, of position, direction, way since the last reversal, and the other axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from monitor.effects.context import Context
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape
from monitor.effects.shapes.windup import wound_up
from monitor.exceptions import EffectError
from monitor.records import Array

# Hats over the travel of a linear axis: a twelfth of the stroke is as fine as 60 touches show.
HATS = 12
# Harmonics of a rotary axis: a bearing, a gear and a scale of a table err up to some eight times a turn.
HARMONICS = 8
# Hats over the part of a turn that an axis of a mount visits: they follow what harmonics to the eighth do not, where
# they lie closer than half a wave of the last of these and positions are four times as many. Eight say most of a bump
# of 0.12 rad over 70 degrees (12 and 16 were tried). Turning axes of other machines were not tried.
HATS_OF_A_PART, POSITIONS_A_HAT = 8, 4
# Angles closer than this, in rad, are the same.
SAME_ANGLE = 1e-4
# Play takes this part of the travel to build up.
BUILD_UP = (1 / 40, 1 / 12, 1 / 4)
# A drive that is wound up gives way over this part of the travel before it follows; shorter moves leave it in between.
PLAY = (1 / 16, 1 / 8, 1 / 4)
# A joint of two rails or a slip of a scale goes from one level to the other within this part of a hat's spacing.
STEEPNESS = 1 / 4


class Follows(StrEnum):
    """What a part of the basis follows beside the position of its axis."""

    POSITION = "position"
    DIRECTION = "direction"
    OTHERS = "others"


@dataclass(frozen=True)
class Free(DescribedShape):
    """Parts of a flexible basis of one axis, numbered from 1; all of them where none is named, for a search.

    Linear axes: hats over the visited range, the direction of travel (alone, times the position and its square, and
    building up with the way since the last reversal), the position times that of every other axis, and steps in the
    middle between two hats. Rotary axes: harmonics to the eighth, the direction (alone and times cosine and sine),
    cosine and sine times the other axes. Behind all others, since stored names keep their numbers: the play of three
    widths, what the axis does until it first moves in a run, when nobody knows from which side it came, and hats over
    the part of a turn, some 150 degrees at most, that an axis of a mount visits. Every part is scaled to 1 at most.
    """

    parts: tuple[int, ...] = ()
    pattern: ClassVar[str] = r"free\((?P<parts>[1-9]\d*(,[1-9]\d*)*)\)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(tuple(int(word) for word in groups["parts"].split(",")))

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f".{part}" for part in self.parts)

    def columns(self, context: Context, joint: int) -> Array:
        basis = context.remembered(Free(), joint, lambda: flexible_basis(context, joint))
        if not self.parts:
            return basis
        if max(self.parts) > basis.shape[1]:
            raise EffectError(
                f"free has the parts 1 to {basis.shape[1]} here; {max(self.parts)} is none of them"
            )
        return np.asarray(basis[:, [part - 1 for part in self.parts]])

    def phrase(self, error: JointError) -> str:
        return ", of a shape that no entry of the catalogue has"

    def following(self, context: Context, joint: int) -> npt.NDArray[np.str_]:
        """Return what each part (k,) follows: a value of ``Follows``."""
        follows = np.array([each for each, parts in _blocks(context, joint) for _ in parts])
        return np.asarray(follows[[part - 1 for part in self.parts]] if self.parts else follows)


def parts_of_position(turns: bool) -> int:
    """How many of the first parts follow the position of an axis alone: hats, or cosines and sines if it turns."""
    return 2 * HARMONICS if turns else HATS


def parts_of_axis(context: Context, joint: int) -> tuple[int, ...]:
    """The numbers, from 1, of the parts that follow one axis alone: all but products with other axes."""
    turns = context.chain.joints[joint].turns
    simple = 3 if turns else 2
    before = parts_of_position(turns) + 1 + simple + len(BUILD_UP)
    others = [index for index in range(context.places.shape[1]) if index != joint]
    products = simple * sum(len(_of_other(context, index)) for index in others)
    count = flexible_basis(context, joint).shape[1]
    return (*range(1, before + 1), *range(before + products + 1, count + 1))


def axes_of_products(context: Context, joint: int, parts: Sequence[int]) -> frozenset[int]:
    """The other axes whose positions parts, numbered from 1, of a joint's basis are multiplied with."""
    simple = 3 if context.chain.joints[joint].turns else 2
    others = [
        index for index in range(context.places.shape[1]) if index != joint for _ in _of_other(context, index)
    ]
    first = parts_of_position(context.chain.joints[joint].turns) + 1 + simple + len(BUILD_UP)
    return frozenset(
        others[(part - 1 - first) % len(others)]
        for part in parts
        if first < part <= first + simple * len(others)
    )


def flexible_basis(context: Context, joint: int) -> Array:
    """All parts (n, k) of the flexible basis of an axis."""
    columns = _unscaled(context, joint)
    measured = columns if context.measured is None else _unscaled(context.measured, joint)
    largest = np.abs(measured).max(axis=0)
    return np.asarray(columns / np.where(largest > 0.0, largest, 1.0))


def _unscaled(context: Context, joint: int) -> Array:
    """The parts (n, k) before they are scaled to 1."""
    return np.column_stack([part for _, parts in _blocks(context, joint) for part in parts])


def _blocks(context: Context, joint: int) -> list[tuple[Follows, list[Array]]]:
    """The parts (n,) in their order, with what they follow."""
    position, direction = context.places[:, joint], context.travel[:, joint]
    others = [
        part
        for index in range(context.places.shape[1])
        if index != joint
        for part in _of_other(context, index)
    ]
    visited = context.scaling.places[:, joint]
    middle, half = (visited.max() + visited.min()) / 2.0, max(float(np.ptp(visited)) / 2.0, 1e-12)
    scaled = (position - middle) / half
    turns = context.chain.joints[joint].turns
    if turns:
        first = [wave(order * position) for order in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)]
        simple = [np.cos(position), np.sin(position), scaled]
    else:
        first = _hats(scaled, HATS)
        simple = [scaled, scaled**2]
    way = way_since_reversal(context, joint) / (2.0 * half)
    of_direction = [direction, *(direction * part for part in simple)]
    of_direction += [direction * np.exp(-way / length) for length in BUILD_UP]
    play = [wound_up(context, joint, 2.0 * half * width) for width in PLAY]
    is_mount = context.scaling.sight is not None and turns and _is_part_of_turn(visited)
    return [
        (Follows.POSITION, first),
        (Follows.DIRECTION, of_direction),
        (Follows.OTHERS, [part * other for part in simple for other in others]),
        (Follows.POSITION, [] if turns else _steps(scaled)),
        (Follows.DIRECTION, [*play, (direction == 0.0).astype(np.float64)]),
        (Follows.POSITION, _hats(scaled, HATS_OF_A_PART) if is_mount else []),
    ]


def _hats(scaled: Array, count: int) -> list[Array]:
    """Hats (n,) over positions from -1 to 1, the first and the last half ones."""
    nodes = np.linspace(-1.0, 1.0, count)
    return [np.interp(scaled, nodes, hat) for hat in np.eye(count)]


def _is_part_of_turn(visited: Array) -> bool:
    """Whether hats over the angles that an axis visits are finer than its harmonics, and positions enough for them."""
    if not 0.0 < np.ptp(visited) < (HATS_OF_A_PART - 1) * np.pi / HARMONICS:
        return False
    return len(np.unique(np.round(visited / SAME_ANGLE))) >= POSITIONS_A_HAT * HATS_OF_A_PART


def _steps(scaled: Array) -> list[Array]:
    """Steps (n,) of an axis at positions from -1 to 1, one between every two hats: a joint of rails, a slip of a scale.

    Twelve hats make a step of a mixture, each of which an error of another axis mimics better than the whole.
    """
    spacing = 2.0 / (HATS - 1)
    middles = -1.0 + spacing * (np.arange(HATS - 1) + 0.5)
    return [np.tanh((scaled - at) / (STEEPNESS * spacing)) for at in middles]


def _of_other(context: Context, joint: int) -> list[Array]:
    """What a product takes of another axis; nothing of one that stands still."""
    position, visited = context.places[:, joint], context.scaling.places[:, joint]
    spread = float(np.ptp(visited))
    if spread == 0.0:
        return []
    if context.chain.joints[joint].turns:
        return [np.cos(position), np.sin(position), position / np.pi]
    return [(position - visited.mean()) / spread]


def way_since_reversal(context: Context, joint: int) -> Array:
    """The way (n,) that an axis went since it last reversed, from zero at the begin of every run."""
    way = np.zeros(len(context))
    position, direction = context.places[:, joint], context.travel[:, joint]
    for rows in context.stretches:
        steps = np.abs(np.diff(position[rows], prepend=0.0))
        reversals = np.concatenate([[True], np.diff(direction[rows]) != 0.0])
        total = np.cumsum(steps)
        # The way before the step in which the axis reversed does not count.
        begin = np.maximum.accumulate(np.where(reversals, total - steps, 0.0))
        way[rows] = total - begin
    return way


REGISTERED = (Free,)
