"""``instrument:bar-xy:length``: a bar that is longer than its calibration says, beyond its stated uncertainty."""

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
class BarLength(InstrumentChange):
    """The bar is longer than stated, in one setup or in all of them; readings come out smaller."""

    pattern: ClassVar[str] = BEGIN + "length"
    word: ClassVar[str] = "length"
    kinds: ClassVar[tuple[str, ...]] = ("distance",)
    of_instruments: ClassVar[bool] = True
    also_single: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        return MICROMETRE

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        return -np.ones((*rows.ideal.shape, 1))

    def described(self, driven: str) -> Description:
        return Description(
            f"the bar of {self.name} is longer than stated{driven}",
            "the bar was calibrated at another temperature, was put together anew, or its ball or cup has dirt on it; "
            "an error of the scale of its calibrator acts alike",
            "calibrate the bar before and after, at the machine's temperature; clean balls and cups",
            "ISO 230-4:2005 (circular tests); docs/effects.md",
        )


REGISTERED = (BarLength,)
