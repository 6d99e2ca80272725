"""``instrument:r-test:drift@run_time`` and ``instrument:level:tilt@run_time``: zeros that move within a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context, InstrumentRows
from monitor.effects.description import Description
from monitor.effects.instrument_change import BEGIN, InstrumentChange
from monitor.records import Array
from monitor.units import MICROMETRE, MICRORADIAN, Unit

#: Suffixes of the numbers of kinds that read several.
AXES = (".x", ".y", ".z")


@dataclass(frozen=True)
class ZeroDrift(InstrumentChange):
    """The zero of a length drifts, each number of a row by itself."""

    pattern: ClassVar[str] = BEGIN + "drift"
    word: ClassVar[str] = "drift"
    kinds: ClassVar[tuple[str, ...]] = ("component", "offset", "point", "vector")
    needs_driver: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        return MICROMETRE

    def labels(self, context: Context) -> tuple[str, ...]:
        read = max(setup.numbers for setup in self.setups(context))
        return ("",) if read == 1 else AXES[:read]

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        numbers = rows.ideal.shape[1]
        return np.tile(np.eye(numbers)[:, : len(self.labels(context))], (len(rows.setup), 1, 1))

    def described(self, driven: str) -> Description:
        return Description(
            f"the zero of {self.name} drifts{driven}",
            "sensors, their holder or the sphere's stem warm up or creep; electronics were switched on just before",
            "switch on an hour before, come back to the first pose in between, and measure in shorter runs",
            "ISO 230-3:2020; docs/effects.md",
        )


@dataclass(frozen=True)
class LevelDrift(InstrumentChange):
    """The zero of an angle drifts."""

    pattern: ClassVar[str] = BEGIN + "tilt"
    word: ClassVar[str] = "tilt"
    kinds: ClassVar[tuple[str, ...]] = ("angle", "level")
    needs_driver: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        return MICRORADIAN

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        return np.full((*rows.ideal.shape, 1), rows.lever)

    def described(self, driven: str) -> Description:
        return Description(
            f"the zero of {self.name} drifts{driven}",
            "the level settles or warms up, or the floor gives way under the machine",
            "let the level rest on the machine, come back to the first pose in between, and use a second level on the "
            "bed, whose reading is taken off",
            "ISO 230-3:2020; docs/effects.md",
        )


REGISTERED = (ZeroDrift, LevelDrift)
