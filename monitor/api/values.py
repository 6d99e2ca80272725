"""One value of an argument: a text, a number, a path, a day or a moment, as people in Python give it."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Callable
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import numpy as np

from monitor.exceptions import InputError
from monitor.moments import day_of, moment_of, with_offset

#: Longest value that a message shows, in characters.
_SHOWN = 60
#: Whole numbers are less than this: what a column of the database holds.
_LARGEST_WHOLE = 2**63
#: Longest name of a file and of a path, in bytes, on the systems that this runs on (Linux: NAME_MAX, PATH_MAX).
_LONGEST_NAME, _LONGEST_PATH = 255, 4095
#: What to write for a type, as a message says it.
EXAMPLES: dict[Any, str] = {
    str: "a text",
    bool: "True or False",
    int: "a whole number, such as 3",
    float: "a number, such as 12.0",
    Path: "a path, as a text or a pathlib.Path",
    date: "a day, such as '2026-03-05'",
    datetime: "a day or a time, such as '2026-03-05' or '2026-03-05T07:00:00-05:00'",
    # As the readings of an axis and the coefficients of an effect are given.
    tuple[float, ...]: "a number or several, such as 20.0 or [0.0, 100.0]",
}


def refused(name: str, value: Any, example: str) -> InputError:
    """Return the refusal of a value, with what to write in its place."""
    return InputError(f"{name} is {example}, not {shown(value)}")


def shown(value: Any) -> str:
    """Return a value on one line, shortened."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def is_single(value: Any) -> bool:
    """Return whether a value is one, no list of several."""
    return isinstance(value, (str, bytes, os.PathLike, numbers.Number)) or value is None


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise refused(name, value, EXAMPLES[str])
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise InputError(f"{name} holds half a character: {shown(value)}") from error
    if "\0" in value:
        raise InputError(f"{name} holds a character NUL, which no name and no text has: {shown(value)}")
    return str(value)


def _truth(name: str, value: Any) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise refused(name, value, EXAMPLES[bool])
    return bool(value)


def _number(name: str, value: Any) -> float:
    if not _is_finite(value):
        raise refused(name, value, EXAMPLES[float])
    return float(value)


def _is_finite(value: Any) -> bool:
    """Return whether a value is a number that a double can hold; True and False are none."""
    try:
        return not isinstance(value, bool) and isinstance(value, numbers.Real) and math.isfinite(value)
    except OverflowError:
        return False


def _whole(name: str, value: Any) -> int:
    # A column of pandas with a gap has its whole numbers as floats.
    if not _is_finite(value) or value != int(value) or abs(value) >= _LARGEST_WHOLE:
        raise refused(name, value, EXAMPLES[int])
    return int(value)


def _path(name: str, value: Any) -> Path:
    path = os.fspath(value) if isinstance(value, os.PathLike) else value
    if not isinstance(path, str):
        raise refused(name, value, EXAMPLES[Path])
    typed = Path(_text(name, path))
    if any(len(part.encode()) > _LONGEST_NAME for part in typed.parts) or len(path.encode()) > _LONGEST_PATH:
        raise InputError(f"{name} is longer than the name of any file: {shown(value)}")
    return typed


def _day(name: str, value: Any) -> date:
    value = _of_calendar(value)
    if isinstance(value, datetime):
        return value.date()
    if isinstance(value, str):
        return day_of(value, f"{name}={shown(value)}")
    if not isinstance(value, date):
        raise refused(name, value, EXAMPLES[date])
    return value


def _moment(name: str, value: Any) -> datetime:
    """Return a moment with its offset: of a text, a day or a time; without an offset the time of this computer."""
    value = _of_calendar(value)
    if isinstance(value, str):
        return moment_of(value, f"{name}={shown(value)}")
    if isinstance(value, date) and not isinstance(value, datetime):
        value = datetime.combine(value, time())
    if not isinstance(value, datetime):
        raise refused(name, value, EXAMPLES[datetime])
    return value if value.tzinfo is not None else with_offset(value, f"{name}={value}")


def _of_calendar(value: Any) -> Any:
    """Return times of pandas and numpy as those of Python, a time that is none (NaT) as None."""
    if isinstance(value, np.datetime64):
        return value.astype("datetime64[us]").item()
    if isinstance(value, datetime) and value != value:
        return None
    return value.to_pydatetime() if hasattr(value, "to_pydatetime") else value


#: What one value of a type is made of.
SCALARS: dict[Any, Callable[[str, Any], Any]] = {
    str: _text,
    bool: _truth,
    int: _whole,
    float: _number,
    Path: _path,
    date: _day,
    datetime: _moment,
}
