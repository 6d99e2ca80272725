"""``instrument:plate:expansion@run_time``: an artefact of points, such as a plate of holes, that grows within a run.

What it has grown before a run begins is a gain of the axes that go along it, and free in every run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context, InstrumentRows
from monitor.effects.description import Description
from monitor.effects.instrument_change import BEGIN, InstrumentChange
from monitor.records import Array
from monitor.units import METRE, MICROMETRE, Unit


@dataclass(frozen=True)
class PlateExpansion(InstrumentChange):
    """All points of an artefact go apart from the middle of those that were read; where it is held elsewhere its zero
    drifts besides. Those that are stated stay as they are, so what they should be grows less."""

    pattern: ClassVar[str] = BEGIN + "expansion"
    word: ClassVar[str] = "expansion"
    kinds: ClassVar[tuple[str, ...]] = ("point",)
    needs_driver: ClassVar[bool] = True
    of_instruments: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        return MICROMETRE.per(METRE)

    def since_the_first(self, driver: Array, context: Context) -> Array:
        """Return the driver as it is: one artefact has grown for all its setups, whichever is measured first."""
        return driver

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        read = np.isfinite(rows.ideal)
        middle = np.nansum(rows.ideal, axis=0) / np.maximum(read.sum(axis=0), 1)
        return -np.asarray(rows.ideal - middle)[:, :, None]

    def described(self, driven: str) -> Description:
        return Description(
            f"the points of {self.name} go apart{driven}",
            "the artefact warms up on the machine or under the hands that mounted it; of a tracker, the air along its "
            "beam changes",
            "let the artefact take the machine's temperature, record its temperature with every point, or give its "
            "expansion coefficient; correct no axis by it",
            "ISO 230-3:2020; ISO/TR 16015:2003",
        )


REGISTERED = (PlateExpansion,)
