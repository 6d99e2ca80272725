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


def parse_artefact(body: str) -> ArtefactChange:
    """The change that a text names; EffectError lists what there is."""
    if body == "artefact:expansion":
        return Expansion()
    if body == "stem:gravity":
        return StemGravity()
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
        "artefact:expansion@ambient_degC, stem:gravity, tracker:shift@run_time and tracker:turn@run_time"
    )
