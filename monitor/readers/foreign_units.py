"""Units as foreign files and people write them, and cells carried from one to another."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from types import MappingProxyType

from monitor.readers.faults import one_of


@dataclass(frozen=True)
class ForeignUnit:
    """A unit: what it is of, and ``base = written * factor + offset`` in the base unit of that quantity."""

    name: str
    quantity: str
    factor: Decimal
    offset: Decimal = Decimal(0)


_PI = Decimal("3.14159265358979323846264338327950288")
_DEGREE = _PI / 180
#: Every spelling, in small letters. The inch is 25.4 mm exactly (international yard and pound agreement, 1959); degrees
#: Fahrenheit: NIST SP 811, B.9.
_SPELLINGS: Mapping[ForeignUnit, tuple[str, ...]] = MappingProxyType({
    ForeignUnit("mm", "length", Decimal(1)): ("mm", "millimeter", "millimetre", "millimeters", "millimetres"),
    ForeignUnit("µm", "length", Decimal("1e-3")): (
        "um", "µm", "μm", "micron", "microns", "micrometer", "micrometre", "micrometers", "micrometres",
    ),
    ForeignUnit("nm", "length", Decimal("1e-6")): ("nm", "nanometer", "nanometre"),
    ForeignUnit("m", "length", Decimal(1000)): ("m", "meter", "metre", "meters", "metres"),
    ForeignUnit("cm", "length", Decimal(10)): ("cm", "centimeter", "centimetre"),
    ForeignUnit("inch", "length", Decimal("25.4")): ("in", "inch", "inches", "zoll", '"'),
    ForeignUnit("mil", "length", Decimal("0.0254")): ("mil", "mils", "thou"),
    ForeignUnit("µin", "length", Decimal("25.4e-6")): ("uin", "µin", "μin", "microinch", "microinches"),
    ForeignUnit("deg", "angle", _DEGREE): (
        "deg", "°", "degree", "degrees", "grad_deg", "d:m:s", "dms", "dd:mm:ss",
    ),
    ForeignUnit("hours of angle", "angle", 15 * _DEGREE): (
        "hours of angle", "hour angle", "hourangle", "h:m:s", "hms", "hh:mm:ss",
    ),
    ForeignUnit("arcmin", "angle", _DEGREE / 60): ("arcmin", "'", "′"),
    ForeignUnit("arcsec", "angle", _DEGREE / 3600): ("arcsec", "″", "arcsecond", "arcseconds", "arc-sec", "sec of arc"),
    ForeignUnit("rad", "angle", Decimal(1)): ("rad", "radian", "radians"),
    ForeignUnit("mrad", "angle", Decimal("1e-3")): ("mrad", "mm/m"),
    ForeignUnit("µrad", "angle", Decimal("1e-6")): ("urad", "µrad", "μrad", "um/m", "µm/m", "μm/m"),
    ForeignUnit("s", "time", Decimal(1)): ("s", "sec", "second", "seconds"),
    ForeignUnit("ms", "time", Decimal("1e-3")): ("ms",),
    ForeignUnit("min", "time", Decimal(60)): ("min", "minute", "minutes"),
    ForeignUnit("h", "time", Decimal(3600)): ("h", "hour", "hours"),
    ForeignUnit("degC", "temperature", Decimal(1)): ("degc", "°c", "celsius", "c"),
    ForeignUnit("K", "temperature", Decimal(1), Decimal("-273.15")): ("k", "kelvin"),
    ForeignUnit("degF", "temperature", Decimal(5) / 9, Decimal(-160) / 9): ("degf", "°f", "fahrenheit", "f"),
    ForeignUnit("hPa", "pressure", Decimal(1)): ("hpa", "mbar", "mb"),
    ForeignUnit("kPa", "pressure", Decimal(10)): ("kpa",),
    ForeignUnit("Pa", "pressure", Decimal("0.01")): ("pa",),
    ForeignUnit("percent", "share", Decimal(1)): ("percent", "%", "%rh", "% rh"),
})  # fmt: skip
_BY_SPELLING = {spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings}
#: The decimals of a length or a temperature are kept to the last digit; a factor with pi is none.
_EXACT = ("length", "time", "pressure", "share")
#: ``-05:12:33.4``, ``5 12 33``, ``05h12m33.4s``, ``05d 12' 33"``: degrees or hours, minutes, seconds of an angle.
_SEXAGESIMAL = re.compile(
    r"(?P<sign>[+-]?)\s*(?P<whole>[0-9]{1,3})\s*(?P<mark>[:hd°\s])\s*(?P<minutes>[0-9]{1,2})"
    r"(?:\s*[:m'′\s]\s*(?P<seconds>[0-9]{1,2}(?:[.,][0-9]{0,12})?))?\s*[ms'′\"″]{0,2}"
)
#: The units that have minutes and seconds, and the letters that say which it is.
_MARKS = {"deg": "d°", "hours of angle": "h"}


def foreign_unit(text: str) -> ForeignUnit | None:
    """Return the unit of a spelling; None where it is none."""
    spelling = text.strip().rstrip(".").casefold()
    return _BY_SPELLING.get(text.strip()) or _BY_SPELLING.get(spelling)


def unit_names(quantity: str | None = None) -> str:
    """Return the units that can be named, of one quantity or of all, for the end of a message."""
    return one_of(unit.name for unit in _SPELLINGS if quantity in (None, unit.quantity))


def unit_of_column(column: str) -> ForeignUnit | None:
    """Return the unit in which a column of a campaign is written, by the end of its name; None where it has none."""
    stem, _, suffix = column.rpartition("_")
    return foreign_unit(suffix) if stem else None


@dataclass(frozen=True)
class Conversion:
    """Carries cells of one unit into another: ``written * scale + shift``."""

    source: ForeignUnit
    target: ForeignUnit
    scale: Decimal
    offset: Decimal

    @property
    def is_exact(self) -> bool:
        """Whether decimals stay decimals."""
        return self.source == self.target or self.source.quantity in _EXACT

    def cell(self, text: str) -> str:
        """Return a number in the other unit; what is no number comes back as it is, for the reader to refuse."""
        parts = sexagesimal(text, self.source.name) if self.source.name in _MARKS else None
        if parts is None and self.source == self.target and self.scale == 1 and not self.offset:
            return text
        number = decimal_of(text) if parts is None else parts
        if number is None:
            return text
        if self.source == self.target:
            return plain(number * self.scale + self.offset)
        base = (number * self.source.factor + self.source.offset - self.target.offset) / self.target.factor
        value = base * self.scale + self.offset
        return plain(value) if self.is_exact else repr(float(value))


def decimal_of(text: str) -> Decimal | None:
    """Return the finite number of a cell; None where it is none."""
    try:
        number = Decimal(text)
    except InvalidOperation:
        return None
    # Numbers beyond these are no measurement, and their digits would fill memory.
    return number if number.is_finite() and (not number or abs(number.adjusted()) < 30) else None


def sexagesimal(text: str, unit: str | None = None) -> Decimal | None:
    """Return degrees or hours of a cell with minutes and seconds; None where it is none, or where those reach 60.

    The sign counts for all parts: -00:30:00 is half a degree below zero. Of a ``unit`` the letter of another is none.
    """
    match = _SEXAGESIMAL.fullmatch(text.strip())
    if match is None or match["mark"] in "".join(
        mark for name, mark in _MARKS.items() if unit not in (None, name)
    ):
        return None
    minutes, seconds = Decimal(match["minutes"]), Decimal((match["seconds"] or "0").replace(",", "."))
    if minutes >= 60 or seconds >= 60:
        return None
    # Thirds of a degree have no end; twelve decimals are below any encoder.
    size = round(Decimal(match["whole"]) + minutes / 60 + seconds / 3600, 12)
    return -size if match["sign"] == "-" else size


def has_full_parts(text: str) -> bool:
    """Whether a cell with minutes and seconds is none because one of these reaches 60, as rounding makes of 59.999."""
    match = _SEXAGESIMAL.fullmatch(text.strip())
    return match is not None and sexagesimal(text) is None


def as_angle(unit: ForeignUnit) -> ForeignUnit:
    """Return the unit of an angle: hours there are hours of angle, 15 degrees each; any other as it is."""
    return _BY_SPELLING["hourangle"] if unit.name == "h" else unit


def plain(number: Decimal) -> str:
    """Return a decimal without exponent and without zeros at its end."""
    text = f"{number:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def ratio(first: ForeignUnit, second: ForeignUnit) -> float:
    """Return how many of the second unit the first is; not a number for different quantities."""
    return float(first.factor / second.factor) if first.quantity == second.quantity else math.nan
