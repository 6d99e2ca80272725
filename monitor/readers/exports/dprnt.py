"""Logs of probing macros as controllers print them (``DPRNT`` of Fanuc, Haas and others): letters and numbers in lines.

``X123.4567 Y-12.0 Z 1.544``: a letter, a number, spaces in between or none, since leading places may be blanks. Each
line with the same letters is a row. ``G20`` and ``G21`` (or INCH and MM) in a line say inches and millimetres; A, B, C
are degrees.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from monitor.readers.export import Export, ExportFile, ExportFormat
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.foreign_text import decode_foreign
from monitor.readers.toml_table import Table

_WORD = re.compile(
    r"([A-Z]{1,2}|[A-Z][0-9](?==))\s*=?\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?=[A-Z]|[\s,;*]|$)"
)
_ROW = re.compile(rf"(?:{_WORD.pattern}[\s,;*]*)+")
#: A line that begins as a row does; where it is none it is damaged.
_BEGINS = re.compile(r"[A-Z]{1,2}\s*=?\s*[+-]?[0-9]*\.[0-9]")
#: A power of ten behind a number, which would read as a letter of its own.
_POWER = re.compile(r"[0-9.]+E[+-]?[0-9]{1,3}(?=[A-Z\s,;*]|$)")
_UNITS = {"G20": "inch", "INCH": "inch", "G70": "inch", "G21": "mm", "MM": "mm", "G71": "mm", "METRIC": "mm"}
_UNIT = re.compile(r"\b(G20|G21|G70|G71|INCH|MM|METRIC)\b")
_LENGTHS = frozenset("XYZUVWIJKDR")
_ANGLES = frozenset("ABC")
_DATE = re.compile(r"\b(?:DATE|DATUM)\b[\s:=]*(.+)", re.IGNORECASE)


@dataclass(frozen=True)
class WordSettings:
    """The letters that a line must have to be a row; those of most lines where the mapping names none."""

    letters: tuple[str, ...] = ()


def settings(table: Table) -> WordSettings:
    """Read the key of a log: ``words = ["X", "Y", "Z"]``."""
    letters = table.raw("words", required=False, example='["X", "Y", "Z"]')
    if letters is None:
        return WordSettings()
    if not isinstance(letters, list) or not letters or not all(isinstance(word, str) for word in letters):
        table.fault(
            "words", f'{quoted(letters)} is no list of letters; write for example words = ["X", "Y", "Z"]'
        )
        return WordSettings()
    return WordSettings(tuple(word.upper() for word in letters))


def read(file: ExportFile, how: WordSettings, faults: Faults) -> Export | None:
    """Read the lines of words; None with the faults noted."""
    decoded = decode_foreign(file.name, file.content, faults)
    if decoded is None:
        return None
    rows: list[tuple[int, dict[str, str]]] = []
    facts: list[tuple[str, str]] = []
    units: dict[str, int] = {}
    started = None
    for number, line in enumerate(decoded[0].split("\n"), start=1):
        text = line.strip().strip("%").strip()
        if not text:
            continue
        for name in _UNIT.findall(text.upper()):
            units.setdefault(_UNITS[name], number)
        body = _UNIT.sub("", text.upper()).strip()
        if "E" not in how.letters and _ROW.fullmatch(body) and (power := _POWER.search(body)):
            faults.add(
                file.name, number, None,
                f"{quoted(power[0])} may be a power of ten or a number with the letter E behind it; print decimals, or "
                'name the letter in the mapping: words = ["X", "E"]',
            )  # fmt: skip
            return None
        if _ROW.fullmatch(body):
            pairs = _WORD.findall(body)
            if len({letter for letter, _ in pairs}) < len(pairs):
                faults.add(
                    file.name,
                    number,
                    None,
                    f"{quoted(text)} has a letter twice; print each value under its own",
                )
                return None
            rows.append((number, dict(pairs)))
            continue
        if _BEGINS.match(body):
            faults.add(
                file.name, number, None, f"{quoted(text)} is damaged: a row has a number behind every letter"
            )
            return None
        if date := _DATE.search(text):
            started = date[1].strip("() ")
        facts.append(("log", text[:80]))
    if len(units) > 1:
        first, second = units
        faults.add(
            file.name, units[second], None,
            f"the log goes from {first} (line {units[first]}) to {second}; measure and print in one unit",
        )  # fmt: skip
        return None
    return _export(file.name, how, rows, facts, next(iter(units), None), decoded[1], started, faults)


def _export(
    name: str,
    how: WordSettings,
    rows: list[tuple[int, dict[str, str]]],
    facts: list[tuple[str, str]],
    unit: str | None,
    layout: str,
    started: str | None,
    faults: Faults,
) -> Export | None:
    if not rows:
        faults.add(
            name,
            1,
            None,
            "no line has letters with numbers, such as X123.4567 Y-12.0; is it that log?",
        )
        return None
    letters = how.letters or Counter(tuple(row) for _, row in rows).most_common(1)[0][0]
    taken = [(number, row) for number, row in rows if set(letters) <= set(row)]
    others = [(number, row) for number, row in rows if not set(letters) <= set(row)]
    if others and not how.letters:
        number, row = others[0]
        faults.add(
            name, number, None,
            f"the line has {one_of(row)} where others have {one_of(letters)}; the log is cut here, or say in the "
            f"mapping which lines are rows: words = {list(letters)}",
        )  # fmt: skip
        return None
    if not taken:
        faults.add(
            name,
            rows[0][0],
            None,
            f"no line has all of {one_of(letters)}; the first has {one_of(rows[0][1])}",
        )
        return None
    columns = {letter: [row[letter] for _, row in taken] for letter in letters}
    notes = (f"{len(others)} lines without {one_of(letters)} were passed over",) if others else ()
    lines = [number for number, _ in taken]
    return Export(columns, _units_of(letters, unit), lines, layout, tuple(facts), started, notes)


def _units_of(letters: Sequence[str], unit: str | None) -> dict[str, str]:
    """Return the unit of each letter: degrees, or the unit of lengths that the log states."""
    stated = dict.fromkeys(_ANGLES & set(letters), "deg")
    return stated if unit is None else stated | dict.fromkeys(_LENGTHS & set(letters), unit)


EXPORT = ExportFormat(
    "dprnt",
    "log of a probing macro: lines of letters and numbers, X123.4567 Y-12.0",
    read,
    settings,
    (".prn", ".dprnt"),
)
