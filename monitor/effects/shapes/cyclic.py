"""``cyclic20mm``: what repeats along a linear axis."""

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
class Cyclic(DescribedShape):
    """A cosine and a sine of a pitch in millimetres, as a ball screw or a scale has."""

    pitch: float
    pattern: ClassVar[str] = r"cyclic(?P<pitch>-?\d+(?:\.\d+)?)mm"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(parse_pitch("cyclic", groups["pitch"], "cyclic20mm"))

    @property
    def labels(self) -> tuple[str, ...]:
        return (".cos", ".sin")

    def refuse(self, text: str, error: JointError) -> None:
        if error.joint.turns:
            raise EffectError(
                f"'{text}': a cyclic pitch in mm belongs to a linear axis; for {error.name} write harmonic1"
            )

    def columns(self, context: Context, joint: int) -> Array:
        phase = 2.0 * np.pi * context.places[:, joint] / self.pitch
        return np.column_stack([np.cos(phase), np.sin(phase)])

    def phrase(self, error: JointError) -> str:
        return f", repeating every {self.pitch:g} mm"

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            f"eccentric screw or bearing of {error.name}, or interpolation error of its scale, with a pitch of "
            f"{self.pitch:g} mm",
            f"check screw and encoder mounting of {error.name}, clean the scale, or enter a cyclic compensation",
            POSITIONING,
        )


REGISTERED = (Cyclic,)
