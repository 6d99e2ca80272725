"""``sawtooth84mm(12)``: teeth along a linear axis that rise evenly and fall at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import POSITIONING, Explanation
from monitor.effects.joint_error import JointError
from monitor.effects.shape import DescribedShape, parse_pitch
from monitor.exceptions import EffectError
from monitor.records import Array


@dataclass(frozen=True)
class Sawtooth(DescribedShape):
    """From -1/2 to 1/2 over every ``pitch`` in mm of the reading, back at once at the reading ``edge`` in mm: the size
    is that of the step."""

    pitch: float
    edge: float
    pattern: ClassVar[str] = r"sawtooth(?P<pitch>-?\d+(?:\.\d+)?)mm\((?P<edge>-?\d+(?:\.\d+)?)\)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(parse_pitch("sawtooth", groups["pitch"], "sawtooth84mm(12)"), float(groups["edge"]))

    @property
    def text(self) -> str:
        """The shape as written."""
        return f"sawtooth{self.pitch:.2f}mm({self.edge:.2f})"

    def refuse(self, text: str, error: JointError) -> None:
        if error.joint.turns:
            raise EffectError(
                f"'{text}': a sawtooth in mm belongs to a linear axis; for {error.name} write harmonics(5,10,15)"
            )

    def columns(self, context: Context, joint: int) -> Array:
        reading = context.chain.joints[joint].sign * context.places[:, joint]
        return sawtooths(reading, np.array([self.pitch]), np.array([self.edge])).T

    def jumps(self, low: float, high: float) -> Array:
        first, last = np.ceil((low - self.edge) / self.pitch), np.floor((high - self.edge) / self.pitch)
        return np.asarray(self.edge + self.pitch * np.arange(first, last + 1.0))

    def phrase(self, error: JointError) -> str:
        return f", in teeth of {self.pitch:g} mm that rise evenly and fall at once, one of them at {self.edge:g} mm"

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            f"rack, pinion or gear of {error.name} whose teeth differ from their pitch, or a scale that counts wrongly "
            f"every {self.pitch:g} mm",
            f"check rack, pinion and scale of {error.name} where the teeth fall, or enter a cyclic compensation",
            POSITIONING,
        )


def sawtooths(reading: Array, pitches: Array, edges: Array) -> Array:
    """Sawtooths (k, n) of so many pitches (k,) and edges (k,) in mm at readings (n,) in mm."""
    periods = (reading - edges[:, None]) / pitches[:, None]
    periods -= np.floor(periods)
    periods -= 0.5
    return periods


REGISTERED = (Sawtooth,)
