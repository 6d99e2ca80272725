"""Dates as instruments print them. One that may be read in two ways is refused, never guessed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from decimal import Decimal

from monitor.readers.faults import quoted

#: The orders of day, month and year, and where each stands.
ORDERS = {"day-month-year": "DMY", "month-day-year": "MDY", "year-month-day": "YMD"}
_NUMERIC = re.compile(
    r"(?P<a>[0-9]{1,4})(?P<mark>[-/.])(?P<b>[0-9]{1,2})(?P=mark)(?P<c>[0-9]{2,4})(?P<rest>.*)"
)
_NAMED = re.compile(
    r"(?:[A-Za-z]{2,9},?\s+)?(?P<day>[0-9]{1,2})[. -]+(?P<month>[A-Za-zäÄ]{3,9})[. -]+(?P<year>[0-9]{4})(?P<rest>.*)"
)
_TIME = re.compile(
    r"[\sT,/]*(?P<hour>[0-9]{1,2}):(?P<minute>[0-9]{2})(:(?P<second>[0-9]{2})(?P<part>[.,][0-9]+)?)?\s*(?P<half>[AaPp][Mm])?\s*(?P<offset>Z|[+-][0-9]{2}:?[0-9]{2})?\s*"
)
#: Seconds of a day.
_DAY = 86_400
#: English and German, by their first three letters.
_MONTHS = {
    name: number
    for number, names in enumerate(
        (
            "jan",
            "feb",
            "mar mär mrz",
            "apr",
            "may mai",
            "jun",
            "jul",
            "aug",
            "sep",
            "oct okt",
            "nov",
            "dec dez",
        ),
        start=1,
    )
    for name in names.split()
}


@dataclass(frozen=True)
class Dates:
    """How dates are written: ``order`` of day, month, year, and the offset from UTC of the clock that wrote them."""

    order: str | None = None
    utc_offset: str | None = None

    def moment(self, text: str) -> datetime | str:
        """Return the moment of a date as it stands in a file; a sentence where it is none or may be two."""
        date = self._date(text.strip())
        if isinstance(date, str):
            return date
        year, month, day, rest = date
        time = _TIME.fullmatch(rest) if rest.strip() else None
        if rest.strip() and time is None:
            return f"{quoted(text)} is no date and time; write started_at of [[runs]]"
        hour, minute, second = (
            (0, 0, 0) if time is None else (int(time[part] or 0) for part in ("hour", "minute", "second"))
        )
        if time is not None and time["half"]:
            hour = hour % 12 + (12 if time["half"].lower() == "pm" else 0)
        offset = (time["offset"] if time is not None else None) or self.utc_offset
        if offset is None:
            return (
                f'{quoted(text)} has no offset from UTC; write [dates] utc_offset = "+01:00" in the mapping, '
                "or started_at of [[runs]]"
            )
        try:
            return datetime.fromisoformat(
                f"{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}{offset}"
            )
        except ValueError:
            return self._no_date(text)

    def _no_date(self, text: str) -> str:
        if self.order is None:
            return f"{quoted(text)} is no date and time; write started_at of [[runs]]"
        return (
            f"{quoted(text)} is no date in the order {self.order} that [dates] of the mapping says; correct order, or "
            "write started_at of [[runs]]"
        )

    def _date(self, text: str) -> tuple[int, int, int, str] | str:
        """Return year, month, day and the rest of the text, or what is wrong."""
        if named := _NAMED.fullmatch(text):
            month = _MONTHS.get(named["month"][:3].lower())
            if month is not None:
                return int(named["year"]), month, int(named["day"]), named["rest"]
        numeric = _NUMERIC.fullmatch(text)
        if numeric is None:
            return f"{quoted(text)} is no date that can be read; write started_at of [[runs]]"
        first, second, third = (int(numeric[part]) for part in "abc")
        if len(numeric["a"]) == 4:
            return first, second, third, numeric["rest"]
        if len(numeric["c"]) != 4:
            return f"{quoted(text)} has a year of two digits; write started_at of [[runs]]"
        order = ORDERS.get(self.order or "") or _only_order(first, second, numeric["mark"])
        if order == "DMY":
            return third, second, first, numeric["rest"]
        if order == "MDY":
            return third, first, second, numeric["rest"]
        return (
            f'{quoted(text)} may be day and month or month and day; write [dates] order = "day-month-year" or '
            '"month-day-year" in the mapping, or started_at of [[runs]]'
        )


def clock_seconds(cells: Sequence[str]) -> list[str] | None:
    """Return seconds from the first of times of day, or of dates with times as ISO 8601 has them; None for others.

    Times of day that fall by more than half a day went past midnight.
    """
    days = 0
    seconds: list[Decimal] = []
    for cell in cells:
        moment = _clock(cell.strip())
        if moment is None:
            return None
        if seconds and moment + days * _DAY < seconds[-1] - _DAY // 2:
            days += 1
        seconds.append(moment + days * _DAY)
    return [f"{second - seconds[0]:f}" for second in seconds] if seconds else None


def _clock(cell: str) -> Decimal | None:
    """Return the seconds of a time of day, or of a date with its time; None for any other cell."""
    if time := _TIME.fullmatch(cell):
        hour = int(time["hour"])
        if time["half"]:
            hour = hour % 12 + (12 if time["half"].lower() == "pm" else 0)
        part = (time["part"] or "").replace(",", ".")
        return Decimal(hour * 3600 + int(time["minute"]) * 60 + int(time["second"] or 0)) + Decimal(
            f"0{part}"
        )
    try:
        moment = datetime.fromisoformat(cell.replace(",", "."))
    except ValueError:
        return None
    if ":" not in cell:
        return None
    passed = moment - datetime(2000, 1, 1, tzinfo=moment.tzinfo)
    return Decimal(passed.days * _DAY + passed.seconds) + Decimal(passed.microseconds) / 1_000_000


def _only_order(first: int, second: int, mark: str) -> str | None:
    """Return the one order that two numbers of a date can have; None where they can have two."""
    if mark == "." or first > 12 or first == second:
        return "DMY"
    return "MDY" if second > 12 else None
