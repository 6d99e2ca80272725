"""Calendar weeks as reports name them: ``2026-W10`` (ISO 8601-1:2019, 5.2.3.2), Monday to Sunday local time."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta

from monitor.exceptions import InputError

#: The calendar of Python ends with 9999-12-31, and a week's end is computed.
LAST_YEAR = 9998


@dataclass(frozen=True)
class Week:
    """A week; ``first`` is its Monday."""

    first: date

    @property
    def name(self) -> str:
        """``2026-W10``."""
        year, week, _ = self.first.isocalendar()
        return f"{year}-W{week:02d}"

    @property
    def last(self) -> date:
        """Its Sunday."""
        return self.first + timedelta(days=6)

    @property
    def begins(self) -> datetime:
        """Midnight at the beginning of Monday, local time without a zone."""
        return datetime.combine(self.first, time())

    @property
    def ends(self) -> datetime:
        """Midnight at the end of Sunday."""
        return self.begins + timedelta(days=7)

    def holds(self, moment: datetime) -> bool:
        """Whether a local time lies in the week."""
        return self.begins <= moment < self.ends


def week_named(text: str) -> Week:
    """The week of a name like ``2026-W10``. Raises InputError."""
    match = re.fullmatch(r"([0-9]{4})-?W([0-9]{1,2})", text.strip().upper())
    try:
        if match is None or int(match[1]) > LAST_YEAR:
            raise ValueError
        return Week(date.fromisocalendar(int(match[1]), int(match[2]), 1))
    except ValueError:
        raise InputError(
            f"--week {text}: write a year and a week of it, for example 2026-W10 (weeks are W01 to W52 or W53)"
        ) from None


def week_of(day: date) -> Week:
    """The week that a day lies in."""
    return Week(day - timedelta(days=day.isocalendar().weekday - 1))


def week_before(day: date) -> Week:
    """The last week that had ended on ``day``: what a timer on Monday morning reports. Raises InputError on the first
    days of the calendar."""
    try:
        return Week(day - timedelta(days=day.isocalendar().weekday - 1 + 7))
    except OverflowError:
        raise InputError(f"no week had ended on {day}; name the week, for example 2026-W10") from None
