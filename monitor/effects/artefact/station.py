"""``tracker:moved(run 1, sequence 182)`` and ``base:moved(run 1, sequence 182)``: what was knocked or set down anew in
a run, the tracker on its stand or the machine on its base.

Reflectors beside the machine tell one from the other: they seem to move with the tracker, and rest where the machine is
what moved. Where none was measured on both sides of that moment the two are one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from monitor.effects.artefact.tracker import measured_points
from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.effects.registry import BuiltIn
from monitor.effects.slip import MOVED, moment_of, shifts_and_turns
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class Moved(BuiltIn, ABC):
    """A shift and a turn, about the middle of the run's points, of what is seen from a reading on (run, sequence) to
    the end of that run. The coefficients of a turn are what the farthest point moves by."""

    run: int
    sequence: int
    unit: Unit = MICROMETRE
    head: ClassVar[str]

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(*moment_of(groups, f"{cls.head}:moved"))

    @property
    def text(self) -> str:
        return f"{self.head}:moved(run {self.run}, sequence {self.sequence})"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".x", ".y", ".z", ".turn_x", ".turn_y", ".turn_z")

    def shifts(self, context: Context) -> Array:
        measured_points(context)
        of_run = context.run == self.run
        if not of_run.any():
            raise EffectError(f"'{self.text}': this campaign has no run {self.run}")
        arms = context.nominal - context.nominal[of_run].mean(axis=0)
        motion = shifts_and_turns(arms, float(np.linalg.norm(arms[of_run], axis=1).max()))
        after = of_run & (context.sequence >= self.sequence) & self._takes_part(context)
        return np.asarray(after[:, None, None] * motion)

    def _takes_part(self, context: Context) -> npt.NDArray[np.bool_]:
        """Return the rows (n,) of targets that move along."""
        return np.ones(len(context), dtype=bool)

    @abstractmethod
    def described(self, driven: str) -> Description:
        """Return the move in words; ``driven`` is the phrase of a driver, of which there is none."""


@dataclass(frozen=True)
class TrackerMoved(Moved):
    """All points are seen elsewhere."""

    head: ClassVar[str] = "tracker"
    pattern: ClassVar[str] = "tracker:" + MOVED

    def described(self, driven: str) -> Description:
        return Description(
            f"the station moved during run {self.run}: from reading {self.sequence} on the tracker sees all points "
            "elsewhere",
            "the tracker or its stand was knocked or slipped, or was set down anew; or the robot on its base",
            "fix stand and base, and repeat the run; measure reflectors beside the machine before and after, which say "
            "which of both it was",
            "ISO 10360-10:2021 (laser trackers); docs/effects.md",
        )


@dataclass(frozen=True)
class BaseMoved(Moved):
    """The points that the machine carries stand elsewhere; reflectors beside it rest."""

    head: ClassVar[str] = "base"
    pattern: ClassVar[str] = "base:" + MOVED

    def _takes_part(self, context: Context) -> npt.NDArray[np.bool_]:
        return np.asarray(~np.isin(context.target, list(context.resting)))

    def described(self, driven: str) -> Description:
        return Description(
            f"the machine moved on its base during run {self.run}, from reading {self.sequence} on",
            "the base is loose, or the machine was knocked",
            "fasten the base and repeat the run",
            "docs/effects.md",
        )


REGISTERED = (TrackerMoved, BaseMoved)
