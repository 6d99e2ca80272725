"""Days and moments as people type them into forms and addresses."""

from __future__ import annotations

import re
from datetime import date, datetime, tzinfo

from monitor.exceptions import InputError
from monitor.moments import moment_of

_GERMAN = re.compile(r"([0-9]{1,2})\. ?([0-9]{1,2})\. ?([0-9]{4})")
#: Other forms that Python reads (20260302, 2026-W10-1) a reader may take for another day.
_ISO = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


def typed_day(name: str, text: str) -> date:
    """Return the day that a text says, as 2026-03-02 or 02.03.2026. Raises InputError, which names the field, for
    another form and for a day of no calendar."""
    german = _GERMAN.fullmatch(text)
    iso = text if _ISO.fullmatch(text) else ""
    try:
        return date(int(german[3]), int(german[2]), int(german[1])) if german else date.fromisoformat(iso)
    except ValueError as error:
        raise InputError(f"{name} is a day, such as 2026-03-02 or 02.03.2026, not '{text}'") from error


def typed_moment(name: str, text: str, zone: tzinfo | None = None) -> datetime:
    """Return the moment that a text says: what the command line takes, or 02.03.2026 07:00; a day is its beginning.

    Without an offset it is a time of ``zone`` (None: of the server's computer). Raises InputError.
    """
    typed = text.strip().removesuffix("Uhr").strip()
    german = _GERMAN.match(typed)
    if german:
        time = typed[german.end() :].lstrip(", ")
        typed = f"{typed_day(name, german[0])} {time}".strip()
    return moment_of(typed, f"{name}, '{text[:40]}'", zone)


def as_iso(**days: str) -> dict[str, str]:
    """Return typed days, by the names of their fields, as ISO 8601 writes them; what is empty stays so.

    Raises InputError for what is no day.
    """
    return {
        name: typed_day(name, text.strip()).isoformat() if text.strip() else "" for name, text in days.items()
    }
