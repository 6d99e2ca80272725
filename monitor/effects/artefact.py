"""Effects of the artefact: a ball that moved, an artefact that grows, stems that bend."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from monitor.effects.context import Context
from monitor.effects.tracker import TrackerShift, TrackerTurn
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import METRE, MICROMETRE, Unit


class ArtefactChange(Protocol):
    """A change of the targets' places, in the frame of the last work axis."""

    @property
    def text(self) -> str:
        """The change as written."""
        ...

    @property
    def unit(self) -> Unit:
        """The unit of its coefficients."""
        ...

    def labels(self, context: Context) -> tuple[str, ...]:
        """A suffix for each of the k coefficients."""
        ...

    def shifts(self, context: Context) -> Array:
        """Shift (n, 3, k) of the target at every probing for each coefficient."""
        ...


@dataclass(frozen=True)
class BallMoved:
    """Ball ``ball`` stands elsewhere from a probing on (run, sequence), to the end of that run.

    The balls' places are free in every run, so only the rest of the run in which it moved can show it.
    """

    ball: str
    run: int
    sequence: int
    unit: Unit = MICROMETRE

    @property
    def text(self) -> str:
        return f"ball:{self.ball}:moved(run {self.run}, sequence {self.sequence})"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".x", ".y", ".z")

    def shifts(self, context: Context) -> Array:
        balls = np.unique(context.target)
        if self.ball not in balls:
            raise EffectError(f"'{self.text}': no ball {self.ball}; this campaign probed {', '.join(balls)}")
        after = (
            (context.run == self.run) & (context.sequence >= self.sequence) & (context.target == self.ball)
        )
        shifts: Array = after[:, None, None] * np.eye(3)
        return shifts


@dataclass(frozen=True)
class Expansion:
    """The artefact grows about the origin of the table's frame, in proportion to its driver."""

    text: str = "artefact:expansion"
    unit: Unit = MICROMETRE.per(METRE)  # noqa: RUF009 - an immutable constant

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def shifts(self, context: Context) -> Array:
        return context.nominal[:, :, None]


@dataclass(frozen=True)
class StemGravity:
    """Each ball's stem bends across its length as the table turns; one amplitude a ball at its full weight.

    Stems stand along the last work axis where that is rotary, so gravity along it does not bend them.
    """

    text: str = "stem:gravity"
    unit: Unit = MICROMETRE

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f".{ball}" for ball in np.unique(context.target))

    def shifts(self, context: Context) -> Array:
        if not context.chain.work:
            return np.zeros((len(context), 3, len(np.unique(context.target))))
        last = len(context.chain.work) - 1
        across = context.gravity[:, last].copy()
        if context.chain.joints[last].turns:
            along = np.array(context.chain.joints[last].direction)
            across -= (across @ along)[:, None] * along
        own = context.target[:, None] == np.unique(context.target)
        shifts: Array = across[:, :, None] * own[:, None, :]
        return shifts


@dataclass(frozen=True)
class WorkpieceShape:
    """Every point of the workpiece lies off its nominal place, along the normal of the surface there."""

    text: str = "shape"
    unit: Unit = MICROMETRE

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f"({target})" for target in dict.fromkeys(context.target.tolist()))

    def shifts(self, context: Context) -> Array:
        own = context.target[:, None] == np.array(list(dict.fromkeys(context.target.tolist())))
        shifts: Array = normals_of(context)[:, :, None] * own[:, None, :]
        return shifts


def normals_of(context: Context) -> Array:
    """Unit normals (n, 3) of the surface at every probing, in the frame of the last work axis.

    A component that was not recorded is zero. Raises EffectError where none was, or where one is empty.
    """
    columns = [context.columns.get(f"normal_{axis}") for axis in "xyz"]
    if all(column is None for column in columns):
        raise EffectError("'shape' needs the normal of the surface: the columns normal_x, normal_y, normal_z")
    zero = np.zeros(len(context))
    normals = np.column_stack([zero if column is None else column for column in columns])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    if not np.all(length > 0.0):
        raise EffectError("'shape' needs the normal of the surface at every probing; some have none")
    unit: Array = normals / length
    return unit


def parse_artefact(body: str) -> ArtefactChange:
    """The change that a text names; EffectError lists what there is."""
    if body == "artefact:expansion":
        return Expansion()
    if body == "stem:gravity":
        return StemGravity()
    if body == "shape":
        return WorkpieceShape()
    if body == "tracker:shift":
        return TrackerShift()
    if body == "tracker:turn":
        return TrackerTurn()
    match = re.fullmatch(
        r"ball:(?P<ball>[^:]+):moved\s*\(\s*run\s+(?P<run>\d+)\s*,\s*sequence\s+(?P<seq>\d+)\s*\)", body
    )
    if match:
        return BallMoved(match["ball"], int(match["run"]), int(match["seq"]))
    if re.fullmatch(r"ball:[^:]+:moved", body):
        raise EffectError(
            f"'{body}' must say when: write {body}(run 7, sequence 23); `explain` finds the moment"
        )
    raise EffectError(
        f"there is no effect '{body}' of the artefact; there are ball:2:moved(run 7, sequence 23), "
        "artefact:expansion@ambient_degC, stem:gravity, shape, tracker:shift@run_time and tracker:turn@run_time"
    )
