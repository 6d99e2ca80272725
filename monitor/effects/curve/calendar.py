"""Periods that the calendar or the sun sets."""

from __future__ import annotations

from typing import NamedTuple


class CalendarPeriod(NamedTuple):
    """A period: its length in a unit, its name, its usual cause."""

    length: float
    name: str
    cause: str


_SEASON = "the seasons: humidity, room temperature or heating act on what is measured or on the instrument"
_DAY = "the course of the day: temperature, sun, traffic, load of the mains or shift work"
_HARMONIC = "a cycle of the seasons that is not a pure sine"
#: Periods by the unit of the time.
CALENDAR = {
    unit: tuple(CalendarPeriod(*period) for period in periods)
    for unit, periods in {
        "d": ((365.2422, "a year", _SEASON), (182.6211, "half a year", _HARMONIC), (7.0, "a week", "the working week"),
              (1.0, "a day", _DAY), (0.5, "half a day", "the tide, or a daily cycle that is not a pure sine")),
        "year": ((1.0, "a year", _SEASON), (0.5, "half a year", _HARMONIC)),
        "month": ((12.0, "a year", _SEASON), (6.0, "half a year", _HARMONIC)),
        "week": ((52.1775, "a year", _SEASON), (26.0887, "half a year", _HARMONIC)),
        "h": ((24.0, "a day", _DAY), (12.0, "half a day", "a daily cycle that is not a pure sine"),
              (168.0, "a week", "the working week")),
        "min": ((1440.0, "a day", _DAY), (60.0, "an hour", "a controller or machine that works by the hour")),
        "s": ((86400.0, "a day", _DAY), (3600.0, "an hour", "a controller or machine that works by the hour")),
    }.items()
}  # fmt: skip


def calendar_period(period: float, u: float, unit: str) -> float | None:
    """Return the period of the calendar that an estimated one agrees with, None where ``u`` is too large to decide."""
    for entry in CALENDAR.get(unit, ()):
        if abs(period - entry.length) < 2.0 * u and u < 0.05 * entry.length:
            return entry.length
    return None


def calendar_entry(period: float | None, unit: str) -> CalendarPeriod | None:
    """Return the period of the calendar that a length names, to a thousandth; None where it names none."""
    for entry in CALENDAR.get(unit, ()):
        if period is not None and abs(period - entry.length) < 1e-3 * entry.length:
            return entry
    return None
