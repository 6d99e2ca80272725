"""Plays of which nobody knows on which side they began a run.

Before an axis has moved a run does not say from where it came; it is taken to come from zero. Where that is wrong a
play has another state at the first readings of every run, until the axis has gone through it, and what these are off by
looks like an effect of the beginning: a warm-up of the run, a step at its first position, a shape of nothing known. So
where the first readings contradict the side that is assumed, what the play does there is an unknown of each run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.effects import ChainEffect, Context, Effect
from monitor.effects.context import SMALLEST_MOVE_BETWEEN_STOPS_MM, SMALLEST_MOVE_RAD
from monitor.effects.driver import DescribedDriver
from monitor.effects.drivers import Always
from monitor.effects.shapes import Const, Reversal, WindUp
from monitor.effects.shapes.free import Follows, Free
from monitor.machine import MOTION
from monitor.records import Array

#: Of the play that is left open so small a part is none.
CLOSED = 1e-9


@dataclass(frozen=True)
class UnknownSide(DescribedDriver):
    """One multiplier for every place at which an axis stood while its side of a play was not known: ``places`` gives
    the run and the sequence numbers of its readings. It has no name in an effect."""

    places: tuple[tuple[int, tuple[int, ...]], ...]
    pattern: ClassVar[str] = r"(?!)"

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f".run{run}.{sequences[0]}" for run, sequences in self.places)

    def columns(self, context: Context, joint: int | None) -> Array:
        at = [(context.run == run) & np.isin(context.sequence, sequences) for run, sequences in self.places]
        return np.column_stack(at).astype(np.float64)


def unknown_sides(
    scene: ChainScene, selected: Sequence[ChainCandidate], rate: float
) -> tuple[ChainEffect, ...]:
    """What plays of the model and of a selection do where their side is not known, as effects of single runs: of those
    whose first readings contradict the side that they were taken to begin on, at a ``rate`` of error."""
    context = scene.fit.problem.context
    widest: dict[str, tuple[ChainEffect, float]] = {}
    for effect in (*scene.fit.problem.added, *(candidate.effect for candidate in selected)):
        width = _width_of(effect, context)
        if width is not None and isinstance(effect, ChainEffect):
            before = widest.get(effect.term.symbol, (effect, 0.0))[1]
            widest[effect.term.symbol] = effect, max(width, before)
    sides = (_side_of(effect, width, context) for effect, width in widest.values())
    return tuple(side for side in sides if side is not None and _is_contradicted(scene, selected, side, rate))


def _width_of(effect: Effect, context: Context) -> float | None:
    """The travel in mm or rad within which a play turns over, zero where it does at once; None where an effect is no
    play. A free shape that follows the direction is taken for one that does at once."""
    if not isinstance(effect, ChainEffect) or not isinstance(effect.driver, Always):
        return None
    if effect.term.stage != MOTION:
        return None
    match effect.shape:
        case WindUp(width, unit):
            return float(np.deg2rad(width)) if unit == "deg" else width
        case Reversal():
            return 0.0
        case Free():
            follows = effect.shape.following(context, effect.term.joint)
            return 0.0 if Follows.DIRECTION in follows else None
    return None


def _side_of(effect: ChainEffect, width: float, context: Context) -> ChainEffect | None:
    """What an error does at the places where its side of a play is not known; None where that is nowhere."""
    joint = effect.term.joint
    smallest = SMALLEST_MOVE_RAD if effect.joint.turns else SMALLEST_MOVE_BETWEEN_STOPS_MM
    places = tuple(
        (int(context.run[rows[0]]), tuple(map(int, context.sequence[rows])))
        for stretch in context.stretches
        for rows in open_places(context.places[stretch, joint], stretch, width, smallest)
    )
    if not places:
        return None
    return replace(
        effect, shape=Const(), shape_text="const", driver=UnknownSide(places), driver_text="unknown_side"
    )


def open_places(
    positions: Array, rows: npt.NDArray[np.int64], width: float, smallest: float
) -> list[npt.NDArray[np.int64]]:
    """The rows of each place at which an axis with these positions (n,) stood one after the other until it had moved by
    more than the ``smallest`` and gone through a play of a ``width``, from whichever side it came."""
    places: list[list[int]] = []
    low, high, at = positions[0] - width / 2.0, positions[0] + width / 2.0, positions[0]
    for row, position in zip(rows.tolist(), positions.tolist(), strict=True):
        has_moved = bool(places) and abs(position - at) > smallest
        # What is dragged stands where one side of the play touched it, from whichever side it came.
        low, high = (
            min(max(dragged, position - width / 2.0), position + width / 2.0) for dragged in (low, high)
        )
        if has_moved and high - low <= CLOSED * width:
            break
        if has_moved or not places:
            places.append([])
            at = position
        places[-1].append(row)
    return [np.array(each, dtype=np.int64) for each in places]


def _is_contradicted(
    scene: ChainScene, selected: Sequence[ChainCandidate], side: ChainEffect, rate: float
) -> bool:
    """Whether what a play leaves where its side is not known is more than chance leaves beside other errors."""
    symbol = side.term.symbol
    (candidate,) = scene_of(scene.fit, [Variant(f"{symbol}:side", side)]).candidates
    others = [each for each in selected if error_of(each) != symbol or _is_play(each)]
    if all(error_of(each) != symbol for each in others):
        plain = replace(side, shape=Reversal(), shape_text="reversal", driver=Always(), driver_text="")
        others += scene_of(scene.fit, [Variant(plain.text, plain)]).candidates
    return candidate.visible and weigh_beside(scene, [candidate], others)[0].p_value <= rate


def _is_play(candidate: ChainCandidate) -> bool:
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect)
        and isinstance(effect.driver, Always)
        and isinstance(effect.shape, Reversal | WindUp)
    )
