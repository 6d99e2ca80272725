"""Days and moments as people type them into forms and addresses, and as programs send them in documents."""

from __future__ import annotations

import re
import typing
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from datetime import date, datetime
from functools import cache
from types import NoneType, UnionType
from typing import Any

from monitor.exceptions import InputError
from monitor.moments import day_of, written_moment

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


def typed_moment(name: str, text: str) -> datetime:
    """Return the moment that a text says: what the command line takes, or 02.03.2026 07:00; a day is its beginning.

    It has an offset where the text says one. Raises InputError.
    """
    typed = text.strip().removesuffix("Uhr").strip()
    german = _GERMAN.match(typed)
    if german:
        time = typed[german.end() :].lstrip(", ")
        typed = f"{typed_day(name, german[0])} {time}".strip()
    return written_moment(typed, f"{name}, '{text[:40]}'")


def with_moments(kind: Any, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document of a request of this kind with its days and moments read as the command line reads them.

    Raises InputError for what is none, a number too: pydantic would take it for seconds since 1970.
    """
    hints = _hints(kind)
    return {
        name: _read(hints[name], f"'{name}'", value) if name in hints else value
        for name, value in document.items()
    }


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _read(hint: Any, name: str, value: Any) -> Any:
    """Read what a field of a type holds; what can be no day and no moment stays for the check of types."""
    members = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, UnionType) else (hint,)
    for member in members:
        if member in _WRITTEN and not (value is None and NoneType in members):
            return _from_text(member, name, value)
        if isinstance(value, list) and (elements := typing.get_args(member)):
            return [_read(elements[0], name, element) for element in value]
        if isinstance(value, dict) and is_dataclass(member):
            return with_moments(member, value)
    return value


#: What reads the text of a day or a moment, and how one is written.
_WRITTEN: Mapping[Any, tuple[Callable[[str, str], Any], str]] = {
    datetime: (written_moment, "a day or a time as text, such as 2026-03-05T07:00:00-05:00"),
    date: (day_of, "a day as text, such as 2026-03-05"),
}


def _from_text(kind: Any, name: str, value: Any) -> Any:
    read, form = _WRITTEN[kind]
    if isinstance(value, str):
        return read(value, f"{name}, '{value[:40]}'")
    raise InputError(f"{name} is {_shown(value)}: write {form}")


def _shown(value: Any) -> str:
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "an object"
    return f"the number {value}"[:50] if not isinstance(value, bool) and value is not None else str(value)


def as_iso(**days: str) -> dict[str, str]:
    """Return typed days, by the names of their fields, as ISO 8601 writes them; what is empty stays so.

    Raises InputError for what is no day.
    """
    return {
        name: typed_day(name, text.strip()).isoformat() if text.strip() else "" for name, text in days.items()
    }
