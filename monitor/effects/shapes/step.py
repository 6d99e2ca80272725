"""``step(120)``, ``step(110,300)``, ``step8mm(120)``: jumps of the error of a linear axis at readings of it."""

from __future__ import annotations

import re
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

#: Places nearer to one another are no two, and nothing travels so far; both in mm.
LEAST_APART, BEYOND_ANY_TRAVEL = 1e-3, 1e6
#: Digits after the point of readings and widths in mm: the last of finest displays.
DECIMALS = 4


@dataclass(frozen=True)
class Step(DescribedShape):
    """From -1/2 to 1/2 at each of some ``readings`` in mm, in rising order, evenly over a ``width`` in mm about it: the
    size of each is that of its jump, towards higher readings."""

    readings: tuple[float, ...]
    width: float = 0.0
    pattern: ClassVar[str] = r"step((?P<width>-?[0-9]+(?:\.[0-9]+)?)mm)?\((?P<readings>[^)]*)\)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        width = parse_pitch("step", groups["width"], "step8mm(120)", "width") if "width" in groups else 0.0
        if width >= BEYOND_ANY_TRAVEL:
            raise EffectError(f"the width of step{groups['width']}mm must be below 1000000 mm")
        return cls(_parse_readings(groups["readings"]), round(width, DECIMALS))

    @property
    def text(self) -> str:
        """The shape as written, of whatever it was read from."""
        over = f"{_mm(self.width)}mm" if self.width else ""
        return f"step{over}({','.join(map(_mm, self.readings))})"

    def named(self, text: str) -> str:
        return self.text

    @property
    def labels(self) -> tuple[str, ...]:
        several = len(self.readings) > 1
        return tuple(f".{_mm(reading)}mm" for reading in self.readings) if several else ("",)

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
        places = " and ".join(f"{_mm(reading)} mm" for reading in self.readings)
        several = len(self.readings) > 1
        over = f", {'each ' if several else ''}over {_mm(self.width)} mm" if self.width else ""
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


def _mm(value: float) -> str:
    """A reading or a width in mm as plain decimals, without zeros at the end."""
    # Zero has no sign.
    return f"{round(value, DECIMALS) + 0.0:.{DECIMALS}f}".rstrip("0").rstrip(".")


def _parse_readings(text: str) -> tuple[float, ...]:
    """Return the readings of ``110,300``. Raises EffectError where they are no plain numbers in rising order."""
    written = [word.strip(" ") for word in text.split(",")]
    plain = all(re.fullmatch(r"-?[0-9]+(\.[0-9]+)?", word) for word in written)
    readings = tuple(round(float(word), DECIMALS) for word in written) if plain else ()
    if not readings or np.any(np.round(np.diff(readings), DECIMALS) < LEAST_APART):
        raise EffectError(
            f"the places of step({text}) must be readings in mm in rising order, plain decimals 0.001 mm or more "
            "apart, for example step(110,300)"
        )
    if max(map(abs, readings)) >= BEYOND_ANY_TRAVEL:
        raise EffectError(f"the places of step({text}) must be between -1000000 and 1000000 mm")
    return readings


REGISTERED = (Step,)
