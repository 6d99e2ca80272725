"""``step(120)``, ``step(110,300)``, ``step8mm(120)``: jumps of the error of a linear axis at readings of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
class Step(DescribedShape):
    """From -1/2 to 1/2 at each of some ``readings`` in mm, in rising order, evenly over a ``width`` in mm about it: the
    size of each is that of its jump, towards higher readings."""

    readings: tuple[float, ...]
    width: float = 0.0
    pattern: ClassVar[str] = r"step((?P<width>-?\d+(?:\.\d+)?)mm)?\((?P<readings>[^)]*)\)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        width = parse_pitch("step", groups["width"], "step8mm(120)", "width") if "width" in groups else 0.0
        return cls(_parse_readings(groups["readings"]), width)

    @property
    def text(self) -> str:
        """The shape as written."""
        over = f"{self.width:.4g}mm" if self.width else ""
        return f"step{over}({','.join(f'{reading:.9g}' for reading in self.readings)})"

    @property
    def labels(self) -> tuple[str, ...]:
        several = len(self.readings) > 1
        return tuple(f".{reading:.9g}mm" for reading in self.readings) if several else ("",)

    def refuse(self, text: str, error: JointError) -> None:
        if error.joint.turns:
            raise EffectError(
                f"'{text}': a step at a reading in mm belongs to a linear axis; for {error.name} write "
                "table(...) with nodes in degrees on either side of it"
            )

    def columns(self, context: Context, joint: int) -> Array:
        reading = context.chain.joints[joint].sign * context.places[:, joint]
        return steps_at(reading, self.readings, self.width)

    def jumps(self, low: float, high: float) -> Array:
        return np.array([reading for reading in self.readings if low <= reading <= high and not self.width])

    def kinks(self, low: float, high: float) -> Array:
        half = self.width / 2.0
        ends = [end for reading in self.readings for end in (reading - half, reading + half)] if half else []
        return np.array([end for end in ends if low <= end <= high])

    def phrase(self, error: JointError) -> str:
        places = " and ".join(f"{reading:g} mm" for reading in self.readings)
        over = f", each over {self.width:g} mm" if self.width else ""
        several = len(self.readings) > 1
        return f", which jumps at {'the readings' if several else 'the reading'} {places}{over}"

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            f"a joint or a damaged spot of the scale of {error.name}, or of its guideway, where it jumps; a crash or "
            "coolant that shifted a part of the scale",
            f"look at scale and guideway of {error.name} at these readings, clean and align them, or compensate with "
            "points close to either side",
            POSITIONING,
        )


def steps_at(reading: Array, at: Iterable[float], width: float) -> Array:
    """The steps (n, k) from -1/2 to 1/2 of readings (n,) in mm, at places (k,) and evenly over a width in mm."""
    beyond = reading[:, None] - np.asarray(list(at))
    return np.asarray(np.clip(beyond / width, -0.5, 0.5) if width else np.sign(beyond) / 2.0)


def _parse_readings(text: str) -> tuple[float, ...]:
    """Return the readings of ``110,300``. Raises EffectError where they are no numbers in rising order."""
    try:
        readings = tuple(float(word) for word in text.split(","))
    except ValueError:
        readings = ()
    if not readings or not np.all(np.isfinite(readings)) or np.any(np.diff(readings) <= 0.0):
        raise EffectError(
            f"the places of step({text}) must be readings in mm in rising order, for example step(110,300)"
        )
    return readings


REGISTERED = (Step,)
