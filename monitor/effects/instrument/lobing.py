"""``instrument:probe:lobing3``: what a probe reads depends on the direction in which it touches.

The direction is that of each number in the frame of the tool, about its main axis; two or three lobes a turn. A sphere
that is out of round, turned in front of sensors, looks alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context, InstrumentRows
from monitor.effects.description import Description
from monitor.effects.instrument_change import BEGIN, InstrumentChange
from monitor.records import Array
from monitor.units import MICROMETRE, Unit


@dataclass(frozen=True)
class Lobing(InstrumentChange):
    """A shift along every number's direction, by cosine and sine of so many ``lobes`` times its angle."""

    lobes: ClassVar[int]
    kinds: ClassVar[tuple[str, ...]] = ("component", "vector")

    @property
    def unit(self) -> Unit:
        return MICROMETRE

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".cos", ".sin")

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        # The tool points along the Z of its frame at all axes zero, as the chain is described.
        x, y = rows.towards[..., 0], rows.towards[..., 1]
        angle = self.lobes * np.arctan2(y, x)
        across = np.hypot(x, y)
        return np.stack([across * np.cos(angle), across * np.sin(angle)], axis=-1)

    def described(self, driven: str) -> Description:
        return Description(
            f"{self.name} reads by the direction of touching, {self.lobes} lobes a turn{driven}",
            "the trigger force of the probe depends on the direction, or the ball of the stylus or the sphere is not "
            "round",
            "calibrate the probe in the directions that are used, touch from both sides, or use another sphere",
            "ISO 230-10:2016 (probing systems of machine tools); docs/effects.md",
        )


@dataclass(frozen=True)
class TwoLobes(Lobing):
    """Two lobes a turn: an oval."""

    pattern: ClassVar[str] = BEGIN + "lobing2"
    word: ClassVar[str] = "lobing2"
    lobes: ClassVar[int] = 2


@dataclass(frozen=True)
class ThreeLobes(Lobing):
    """Three lobes a turn, as of a seat on three points."""

    pattern: ClassVar[str] = BEGIN + "lobing3"
    word: ClassVar[str] = "lobing3"
    lobes: ClassVar[int] = 3


REGISTERED = (TwoLobes, ThreeLobes)
