"""``ball:2:moved(run 7, sequence 23)``: a ball that moved during a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OWN_DOCUMENT, Description
from monitor.effects.registry import BuiltIn
from monitor.effects.slip import MOVED, moment_of
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class BallMoved(BuiltIn):
    """A shift of ``ball`` from a probing on (run, sequence), to the end of that run.

    The balls' positions are free in every run, so only the rest of the run in which it moved can show it.
    """

    ball: str
    run: int
    sequence: int
    unit: Unit = MICROMETRE
    pattern: ClassVar[str] = r"ball:(?P<ball>[^:]+):" + MOVED

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(groups["ball"], *moment_of(groups, f"ball:{groups['ball']}:moved"))

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

    def described(self, driven: str) -> Description:
        return Description(
            f"ball {self.ball} moved during run {self.run}",
            "a stem came loose, or the ball was touched",
            f"tighten the stem of ball {self.ball} and repeat the run",
            OWN_DOCUMENT,
        )


REGISTERED = (BallMoved,)
