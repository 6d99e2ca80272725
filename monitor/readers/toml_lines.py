"""Finds the line of a key of a TOML file, which the standard parser does not report."""

from __future__ import annotations

import re

Path = tuple[str | int, ...]

PART = r"""[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*'"""
DOTTED = rf"(?:{PART})(?:[ \t]*\.[ \t]*(?:{PART}))*"
HEADER = re.compile(rf"[ \t]*(\[\[?)[ \t]*({DOTTED})[ \t]*\]")
KEY = re.compile(rf"[ \t]*({DOTTED})[ \t]*=")


def lines_of_keys(text: str) -> dict[Path, int]:
    """Return the line (from 1) of every table header and of every key that begins a line.

    A path is the keys from the top; an element of an array of tables is its index from 0. Keys inside an
    inline table have no entry: ``line_of`` falls back to the table's own line.
    """
    lines: dict[Path, int] = {}
    arrays: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.split("\n"), start=1):
        if match := HEADER.match(line):
            table = ()
            *outer, last = _parts(match[2])
            for part in outer:
                table = _entered((*table, part), arrays)
            table = (*table, last)
            if match[1] == "[[":
                arrays[table] = arrays.get(table, -1) + 1
            table = _entered(table, arrays)
            lines.setdefault(table, number)
        elif match := KEY.match(line):
            path = table
            for part in _parts(match[1]):
                path = (*path, part)
                lines.setdefault(path, number)
    return lines


def line_of(path: Path, lines: dict[Path, int]) -> int | None:
    """Return the line of a key, or of the closest table around it; None at the top of the file."""
    while path:
        if path in lines:
            return lines[path]
        path = path[:-1]
    return None


def _parts(dotted: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(PART, dotted)]


def _entered(path: Path, arrays: dict[Path, int]) -> Path:
    return (*path, arrays[path]) if path in arrays else path
