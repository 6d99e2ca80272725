"""Moments as people type them: a day, a day with a time, with an offset from UTC or without."""

from __future__ import annotations

import re
from datetime import datetime
from zoneinfo import ZoneInfo

from monitor.cli.configuration import configuration
from monitor.exceptions import InputError

# Other forms of ISO 8601 that Python reads (20260305, 2026-W10-4) a reader may take for another day.
_MOMENT = re.compile(
    r"[0-9]{4}-[0-9]{2}-[0-9]{2}"
    r"([T ][0-9]{1,2}:[0-9]{2}(:[0-9]{2}([.,][0-9]{1,6})?)?( ?(Z|[+-][0-9]{2}(:?[0-9]{2})?))?)?"
)


def moment(text: str, option: str) -> datetime:
    """Return the moment with its offset; a day is its beginning, without an offset it is the time of the
    configuration's zone, else of this computer.

    Raises InputError, which names the forms that are read, or says what no calendar or clock has.
    """
    typed = text.strip()
    if _MOMENT.fullmatch(typed) is None:
        raise InputError(
            f"{option} {text}: write a day or a time as 2026-03-05, 2026-03-05 07:00 or 2026-03-05T07:00:00-05:00"
        )
    day, _, time = typed.replace("T", " ").partition(" ")
    hour, colon, rest = time.replace(" ", "").partition(":")
    try:
        read = datetime.fromisoformat(f"{day}T{hour:0>2}{colon}{rest}" if time else day)
    except ValueError as error:
        raise InputError(f"{option} {text}: there is no such day or time, {error}") from error
    if read.tzinfo is not None:
        return read
    zone = configuration().time_zone
    return read.astimezone() if zone is None else read.replace(tzinfo=ZoneInfo(zone))
