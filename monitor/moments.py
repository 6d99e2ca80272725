"""Reads days and moments as people type them: a day, a day with a time, with an offset from UTC or without."""

from __future__ import annotations

import re
from datetime import date, datetime, tzinfo

from monitor.exceptions import InputError

# Other forms of ISO 8601 that Python reads (20260305, 2026-W10-4) a reader may take for another day.
_DAY = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")
_MOMENT = re.compile(
    _DAY.pattern
    + r"([T ][0-9]{1,2}:[0-9]{2}(:[0-9]{2}([.,][0-9]{1,6})?)?( ?(Z|[+-][0-9]{2}(:?[0-9]{2}(:?[0-9]{2})?)?))?)?"
)


def day_of(text: str, named: str) -> date:
    """Return the day of a text; ``named`` begins the message, such as ``--start soon``.

    Raises InputError, which names the form that is read, or says what no calendar has.
    """
    typed = text.strip()
    if _DAY.fullmatch(typed) is None:
        raise InputError(f"{named}: write a day as 2026-03-05")
    try:
        return date.fromisoformat(typed)
    except ValueError as error:
        raise InputError(f"{named}: there is no such day, {error}") from error


def moment_of(text: str, named: str, zone: tzinfo | None = None) -> datetime:
    """Return the moment of a text with its offset: as ``written_moment``, and without an offset a time of ``zone``
    (None: of this computer). Raises InputError."""
    read = written_moment(text, named)
    if read.tzinfo is not None:
        return read
    return with_offset(read, named) if zone is None else read.replace(tzinfo=zone)


def written_moment(text: str, named: str) -> datetime:
    """Return the moment of a text, with its offset where it has one; a day is its beginning.

    ``named`` begins the message, such as ``--at soon``. Raises InputError, which names the forms that are read, or says
    what no calendar or clock has.
    """
    typed = text.strip()
    if _MOMENT.fullmatch(typed) is None:
        raise InputError(
            f"{named}: write a day or a time as 2026-03-05, 2026-03-05 07:00 or 2026-03-05T07:00:00-05:00"
        )
    day, _, time = typed.replace("T", " ").partition(" ")
    hour, colon, rest = time.replace(" ", "").partition(":")
    try:
        return datetime.fromisoformat(f"{day}T{hour:0>2}{colon}{rest}" if time else day)
    except ValueError as error:
        raise InputError(f"{named}: there is no such day or time, {error}") from error


def with_offset(moment: datetime, named: str) -> datetime:
    """Return a moment with the offset that this computer has at that time. Raises InputError beyond its calendar."""
    try:
        return moment.astimezone()
    except (OverflowError, OSError, ValueError) as error:
        raise InputError(f"{named}: this computer has no offset from UTC for {moment}; name it") from error
