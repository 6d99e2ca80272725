"""``artefact:moved(run 7, sequence 23)``: a piece that slipped on the table during a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from monitor.effects.context import Context
from monitor.effects.description import OWN_DOCUMENT, Description
from monitor.effects.registry import BuiltIn
from monitor.effects.slip import MOVED, moment_of, shifts_and_turns
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class ArtefactMoved(BuiltIn):
    """A shift of the middle of the whole artefact, and a turn about it, from a probing on (run, sequence) to the end of
    that run. The coefficients of a turn are what the farthest target moves by."""

    run: int
    sequence: int
    unit: Unit = MICROMETRE
    pattern: ClassVar[str] = "artefact:" + MOVED

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(*moment_of(groups, "artefact:moved"))

    @property
    def text(self) -> str:
        return f"artefact:moved(run {self.run}, sequence {self.sequence})"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".x", ".y", ".z", ".turn_x", ".turn_y", ".turn_z")

    def shifts(self, context: Context) -> Array:
        after = (context.run == self.run) & (context.sequence >= self.sequence)
        shifts: Array = after[:, None, None] * rigid_motion(context)
        return shifts

    def described(self, driven: str) -> Description:
        return Description(
            f"the piece moved during run {self.run}",
            "a clamp or the fixture gave way",
            "clamp the piece firmly and repeat the run",
            OWN_DOCUMENT,
        )


def rigid_motion(context: Context) -> Array:
    """Return how every target (n, 3, 6) moves with a shift of all along X, Y, Z and a turn about their middle, by as
    much at the farthest. No turn moves a target of which nobody says where it stands."""
    is_known: npt.NDArray[np.bool_] = np.asarray(np.isfinite(context.nominal).all(axis=1))
    places = np.where(is_known[:, None], context.nominal, 0.0)
    _, first = np.unique(context.target[is_known], return_index=True)
    middle = places[is_known][first].mean(axis=0) if len(first) else np.zeros(3)
    arms = np.where(is_known[:, None], places - middle, 0.0)
    return shifts_and_turns(arms, float(np.linalg.norm(arms, axis=1).max()))


REGISTERED = (ArtefactMoved,)
