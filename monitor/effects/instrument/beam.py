"""Errors of a laser interferometer: ``scale``, ``cosine`` and ``dead_path``.

The reading counts wavelengths over the travel. Wrong air or material temperature and pressure make it wrong in
proportion to the travel (1 K of air 0.95 µm/m, 1 hPa 0.27 µm/m: B. Edlén, Metrologia 2 (1966) 71), and so does a beam
that stands at an angle a to the travel, by a^2/2: then it is always too short. Air that changes along the way that the
beam has before the travel begins, the dead path, shifts the zero.
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

LASERS = "ISO 230-1:2012 (laser interferometers); B. Edlén, Metrologia 2 (1966) 71; docs/effects.md"


@dataclass(frozen=True)
class BeamScale(InstrumentChange):
    """The laser reads in proportion to its travel."""

    pattern: ClassVar[str] = BEGIN + "scale"
    word: ClassVar[str] = "scale"
    kinds: ClassVar[tuple[str, ...]] = ("displacement",)
    of_instruments: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        return MICROMETRE.per(METRE)

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        return np.asarray(rows.ideal[:, :, None])

    def described(self, driven: str) -> Description:
        return Description(
            f"{self.name} reads in proportion to its travel too much{driven}",
            "the compensation of the wavelength or of the material has a wrong temperature, pressure or humidity: 1 K "
            "of air is 0.95 µm/m, 1 hPa 0.27 µm/m; of a negative sign also a beam askew",
            "check the sensors of air and material and where they hang; measure one axis with a second instrument",
            LASERS,
        )


@dataclass(frozen=True)
class Cosine(InstrumentChange):
    """The beam stands at an angle a to the travel: the laser reads a^2/2 of it too little."""

    pattern: ClassVar[str] = BEGIN + "cosine"
    word: ClassVar[str] = "cosine"
    kinds: ClassVar[tuple[str, ...]] = ("displacement",)

    @property
    def unit(self) -> Unit:
        return MICROMETRE.per(METRE)

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        return np.asarray(-rows.ideal[:, :, None])

    def described(self, driven: str) -> Description:
        return Description(
            f"{self.name} reads in proportion to its travel too little, as a beam askew does{driven}",
            "the beam stands further off the travel than stated: 5 µm/m are 3.2 mrad, a millimetre over 0.3 m; a "
            "negative size is none of a beam but of the wavelength's compensation",
            "align the beam at both ends of the travel, and state how well (direction_standard_uncertainty_urad)",
            LASERS,
        )


@dataclass(frozen=True)
class DeadPath(InstrumentChange):
    """The zero shifts with the air along the dead path."""

    pattern: ClassVar[str] = BEGIN + "dead_path"
    word: ClassVar[str] = "dead_path"
    kinds: ClassVar[tuple[str, ...]] = ("displacement",)
    needs_driver: ClassVar[bool] = True

    @property
    def unit(self) -> Unit:
        return MICROMETRE

    def _of_rows(self, rows: InstrumentRows, context: Context) -> Array:
        return np.ones((*rows.ideal.shape, 1))

    def described(self, driven: str) -> Description:
        return Description(
            f"the zero of {self.name} shifts{driven}",
            "the air along the dead path changes: 1 µm a metre of it for 1 K; or the mounts of the optics move",
            "set the interferometer where the travel begins, or state the dead path to its compensation; wait until "
            "mounts and air are steady",
            LASERS,
        )


REGISTERED = (BeamScale, Cosine, DeadPath)
