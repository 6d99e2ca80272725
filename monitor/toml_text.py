"""Reads TOML that people write, and says in plain words why a text is none, where those of the parser do not help."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from monitor.bounded import LARGEST_SETTINGS, read_bounded
from monitor.exceptions import InputError

#: What the parser's message ends in.
_WHERE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
#: A number behind a key with a comma where TOML has a point: ``EC0Y = 20,0``.
_DECIMAL_COMMA = re.compile(r"[^#=\"']*=\s*([+-]?[0-9]+,[0-9]+)\s*(?:#.*)?")


def toml_file(path: Path) -> dict[str, Any]:
    """Return the tables of a file of settings. Raises InputError, with the line, for one that cannot be read."""
    try:
        content = read_bounded(path, LARGEST_SETTINGS)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from error
    return toml_tables(path, content)


def toml_tables(file: object, content: bytes) -> dict[str, Any]:
    """Return the tables in the bytes of a file. Raises InputError that names the file and the line."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(encoding_refusal(file, error)) from error
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise InputError(f"{file}: brackets or names are nested too deeply to be read") from error
    except ValueError as error:  # also a number of thousands of digits, which is no TOMLDecodeError
        raise InputError(toml_refusal(file, error, text)) from error


def toml_fault(error: ValueError, text: str) -> tuple[int | None, str]:
    """Return the line, None where there is none, and the reason why ``text`` could not be parsed.

    Of numbers with a decimal comma all lines are named.
    """
    message = str(error)
    match = _WHERE.search(message)
    if match is None:
        return None, f"this is not TOML: {_printable(message)}"
    lines = text.split("\n")
    line = int(match[1]) if match[1] else len(lines)
    commas = {
        number: number_text[1]
        for number, row in enumerate(lines, start=1)
        if (number_text := _DECIMAL_COMMA.fullmatch(row.rstrip("\r")))
    }
    if line in commas:
        others = [str(number) for number in commas if number != line]
        also = f"; so have line{'s' if len(others) > 1 else ''} {', '.join(others)}" if others else ""
        shown, point = commas[line][:40], commas[line].replace(",", ".")[:40]
        return line, f"{shown} has a decimal comma, and TOML has decimal points: write {point}{also}"
    where = f" at character {match[2]}" if match[2] else ""
    return line, f"this is not TOML{where}: {_printable(message[: match.start()])}"


def encoding_refusal(file: object, error: UnicodeDecodeError) -> str:
    """Return why a file is no text in UTF-8, with the line of the first byte that is not."""
    line = error.object.count(b"\n", 0, error.start) + 1
    return f"{file}, line {line}: byte 0x{error.object[error.start]:02x} is not UTF-8; save the file as UTF-8 text"


def toml_refusal(file: object, error: ValueError, text: str) -> str:
    """Return why a file could not be parsed, with its line."""
    line, reason = toml_fault(error, text)
    return f"{file}{'' if line is None else f', line {line}'}: {reason}"


def _printable(reason: str) -> str:
    shown = reason if reason.isprintable() else reason.encode("ascii", "backslashreplace").decode()
    return shown[:200]
