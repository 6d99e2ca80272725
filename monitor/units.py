"""Units: mm, rad, s and °C inside; what people see is converted here, at the edge.

A ``Unit`` is a name as printed and the factor that turns a number in it into the internal unit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Unit:
    """A unit as printed; ``internal = displayed * factor``."""

    name: str
    factor: float

    def to_internal(self, displayed: float) -> float:
        """The internal value of a displayed number."""
        return displayed * self.factor

    def to_display(self, internal: float) -> float:
        """The displayed number of an internal value."""
        return internal / self.factor

    def per(self, other: Unit) -> Unit:
        """The quotient of two units, for example µm per K."""
        return Unit(f"{self.name}/{other.name}", self.factor / other.factor)


#: Days of a Julian year (IAU), by which slopes are stated.
DAYS_PER_YEAR = 365.25

ONE = Unit("1", 1.0)
MILLIMETRE = Unit("mm", 1.0)
MICROMETRE = Unit("µm", 1e-3)
METRE = Unit("m", 1e3)
RADIAN = Unit("rad", 1.0)
MICRORADIAN = Unit("µrad", 1e-6)
DEGREE = Unit("°", math.pi / 180.0)
INCH = Unit("inch", 25.4)
CENTIMETRE = Unit("cm", 10.0)
TENTH_MILLIMETRE = Unit("0.1 mm", 0.1)
SECOND = Unit("s", 1.0)
MINUTE = Unit("min", 60.0)
HOUR = Unit("h", 3600.0)
DEGREE_CELSIUS = Unit("°C", 1.0)
KELVIN = Unit("K", 1.0)
PERCENT = Unit("%", 1.0)
HECTOPASCAL = Unit("hPa", 1.0)

#: The suffix of a column of a campaign file, and the unit it names.
COLUMN_UNITS = {
    "um": MICROMETRE,
    "mm": MILLIMETRE,
    "deg": DEGREE,
    "s": SECOND,
    "min": MINUTE,
    "degC": DEGREE_CELSIUS,
    "percent": PERCENT,
    "hPa": HECTOPASCAL,
}

#: The units a condition or a channel may be recorded in (campaign format 1); kept as recorded.
CONDITION_SUFFIXES = ("degC", "percent", "hPa", "min")


_DEGREES = "_degC"
#: Words of the names of temperatures that say how warm a bar was, those nearest to it first: ``bar_degC`` and
#: ``scale_bar_1_degC`` stand before ``ambient_degC``, of which ``runs.csv`` speaks; a workpiece stands where it does.
_NEAREST_TO_BAR = (("bar", "scalebar"), ("artefact", "artifact"), ("ambient",), ("air",), ("workpiece",))


def nearness_to_bar(column: str) -> int | None:
    """Return how near to the scale bar the temperature of a column was measured, 0 the nearest; None for another.

    Words of a name are parted by underscores; numbers behind them do not count (``bar2_degC``).
    """
    if not column.endswith(_DEGREES):
        return None
    parts = {word.rstrip("0123456789") for word in column.lower().split("_")}
    return next((rank for rank, names in enumerate(_NEAREST_TO_BAR) if parts.intersection(names)), None)


def column_unit(column: str) -> Unit | None:
    """The unit that a column's name ends in, or None: ``column_unit("x_mm")`` is the millimetre."""
    stem, _, suffix = column.rpartition("_")
    return COLUMN_UNITS.get(suffix) if stem else None


#: Units that lengths in columns of mm are typed in by mistake, the commonest first.
_MISTAKEN = (METRE, MICROMETRE, INCH, CENTIMETRE, TENTH_MILLIMETRE)
#: What columns of mm are taken to be instead.
UNIT_WORDS = {
    METRE: "in metres",
    MICROMETRE: "in µm",
    INCH: "in inches",
    CENTIMETRE: "ten times too small",
    TENTH_MILLIMETRE: "ten times too large",
}


def mistaken_for_mm(ratio: float | None = None, tolerance: float = 0.02) -> tuple[Unit, ...]:
    """Return the units that lengths may be in that should be in mm; with the ``ratio`` of typed to true lengths
    those that give it within a relative ``tolerance``."""
    if ratio is None:
        return _MISTAKEN
    return tuple(unit for unit in _MISTAKEN if abs(ratio * unit.factor - 1.0) <= tolerance)
