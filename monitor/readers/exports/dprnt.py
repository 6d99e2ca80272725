"""Logs of probing macros as controllers print them (``DPRNT`` of Fanuc, Haas and others): letters and numbers in lines.

``X123.4567 Y-12.0 Z 1.544``: a letter, a number, spaces in between or none, since leading places may be blanks. Each
line with the same letters is a row. ``G20`` and ``G21`` (or INCH and MM) in a line say inches and millimetres; A, B, C
are degrees.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.tables.foreign_text import decode_foreign
from monitor.readers.toml_table import Table

_WORD = re.compile(
    r"([A-Z]{1,2}|[A-Z][0-9](?==))\s*=?\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?=[A-Z]|[\s,;*]|$)"
)
_ROW = re.compile(rf"(?:{_WORD.pattern}[\s,;*]*)+")
#: A line that begins as a row does; where it is none it is damaged.
_BEGINS = re.compile(r"[A-Z]{1,2}\s*=?\s*[+-]?[0-9]*\.[0-9]")
#: A power of ten behind a number, which would read as a letter of its own.
_POWER = re.compile(r"[0-9.]+E[+-]?[0-9]{1,3}(?=[A-Z\s,;*]|$)")
#: Text of the macro itself, and a bracket where a number should stand.
_PROGRAM = re.compile(
    r"\bB?D?PRNT\s*\[|\bP(?:OPEN|CLOS)\b|\bIF\s*\[|#[0-9]{1,5}\s*(?:=|\[[0-9]{2}\])", re.IGNORECASE
)
_BRACKET = re.compile(r"(?:^|[\s,;0-9.])[A-Z]{1,2}\s*=?\s*[\[({<]\s*[#+-]?\s*[0-9.]")
_COMMA = re.compile(r"(?:^|[\s;])[A-Z]{1,2}\s*=?\s*[+-]?[0-9]+,[0-9]")
#: What a serial line and a punch add to a log: DC1 to DC4 of POPEN and PCLOS, and empty places before and behind it.
_SERIAL, _LEADER = b"\x11\x12\x13\x14", b"\x00"
#: The mark that POPEN and PCLOS print around a log.
_MARK = "%"
#: Longest line that is shown as part of the log.
LONGEST_FACT = 80
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
    content = file.content.strip(_LEADER).translate(None, delete=_SERIAL)
    decoded = decode_foreign(file.name, content, faults)
    if decoded is None:
        return None
    log = _Log(file.name)
    for number, line in enumerate(decoded[0].split("\n"), start=1):
        text = line.strip().strip(_MARK).strip()
        log.marks += line.strip() == _MARK
        fault = _line(log, how, number, text) if text else None
        if fault is not None:
            faults.add(file.name, number, None, fault)
            return None
    if len(log.units) > 1:
        first, second = log.units
        faults.add(
            file.name, log.units[second], None,
            f"the log goes from {first} (line {log.units[first]}) to {second}; measure and print in one unit",
        )  # fmt: skip
        return None
    return _export(log, how, decoded[1], faults)


@dataclass
class _Log:
    """What was read of a log: its rows by line, other lines, its units by the line that says them, the date, and how
    many lines are the mark of its ends."""

    name: str
    rows: list[tuple[int, dict[str, str]]] = field(default_factory=list)
    facts: list[Fact] = field(default_factory=list)
    units: dict[str, int] = field(default_factory=dict)
    started: str | None = None
    marks: int = 0


def _line(log: _Log, how: WordSettings, number: int, text: str) -> str | None:
    """Read one line; what is wrong with it."""
    for name in _UNIT.findall(text.upper()):
        log.units.setdefault(_UNITS[name], number)
    body = _UNIT.sub("", text.upper()).strip()
    if _ROW.fullmatch(body):
        if "E" not in how.letters and (power := _POWER.search(body)):
            return (
                f"{quoted(power[0])} may be a power of ten or a number with the letter E behind it; print decimals, or "
                'name the letter in the mapping: words = ["X", "E"]'
            )
        pairs = _WORD.findall(body)
        if len({letter for letter, _ in pairs}) < len(pairs):
            return f"{quoted(text)} has a letter twice; print each value under its own"
        log.rows.append((number, dict(pairs)))
        return None
    if _BEGINS.match(body):
        return f"{quoted(text)} is damaged: a row has a number behind every letter"
    if date := _DATE.search(text):
        log.started = date[1].strip("() ")
    log.facts.append(Fact("log", text[:LONGEST_FACT], number))
    return None


def _export(log: _Log, how: WordSettings, layout: str, faults: Faults) -> Export | None:
    if not log.rows:
        _note_without_rows(log, faults)
        return None
    letters = how.letters or Counter(tuple(row) for _, row in log.rows).most_common(1)[0][0]
    if _has_damaged_row(log, letters, faults):
        return None
    taken = [(number, row) for number, row in log.rows if set(letters) <= set(row)]
    others = [(number, row) for number, row in log.rows if not set(letters) <= set(row)]
    if others and not how.letters:
        number, row = others[0]
        faults.add(
            log.name, number, None,
            f"the line has {one_of(row)} where others have {one_of(letters)}; the log is cut here, or say in the "
            f"mapping which lines are rows: words = {list(letters)}",
        )  # fmt: skip
        return None
    if not taken:
        faults.add(
            log.name, log.rows[0][0], None,
            f"no line has all of {one_of(letters)}; the first has {one_of(log.rows[0][1])}",
        )  # fmt: skip
        return None
    columns = {letter: [row[letter] for _, row in taken] for letter in letters}
    units = _units_of(letters, next(iter(log.units), None))
    lines = [number for number, _ in taken]
    notes = _notes(log, len(others), letters)
    return Export(columns, units, lines, layout, tuple(log.facts), log.started, notes)


def _note_without_rows(log: _Log, faults: Faults) -> None:
    """Note a log without a row, by the line that shows why where one does."""
    said = ((fact.line, _instead_of_numbers(fact.value)) for fact in log.facts)
    line, what = next((pair for pair in said if pair[1] is not None), (1, None))
    other = "no line has letters with numbers, such as X123.4567 Y-12.0; is it that log?"
    faults.add(log.name, line, None, what or other)


def _notes(log: _Log, others: int, letters: Sequence[str]) -> tuple[str, ...]:
    """Return sentences on rows that were passed over, and on a log without its end."""
    notes = []
    if others:
        notes.append(f"{others} lines without {one_of(letters)} were passed over")
    if log.marks % 2:
        notes.append(f"the log has {_MARK} at one end only, which POPEN and PCLOS print at both: is it cut?")
    return tuple(notes)


def _instead_of_numbers(text: str) -> str | None:
    """Say what stands behind the letters of a line where numbers should; None where no letter has such."""
    if _PROGRAM.search(text):
        return (
            f"{quoted(text)} is a line of the macro, not of what it printed: give the file that the control wrote "
            "between POPEN and PCLOS"
        )
    if _BRACKET.search(text.upper()):
        return (
            f"{quoted(text)} has a bracket behind a letter, where the number should stand: print the value itself, "
            "DPRNT[X#101[44]] prints X123.4567"
        )
    if _COMMA.search(text.upper()):
        return f"{quoted(text)} has a comma within a number: print decimal points, as DPRNT does"
    return None


def _has_damaged_row(log: _Log, letters: Sequence[str], faults: Faults) -> bool:
    """Whether a line that is no row names all letters of one and nothing else: the first is noted by its line.

    A comment in parentheses, a line that begins otherwise than a row, and letters above the first row are no rows.
    """
    row = re.compile("".join(rf"{letter}[^A-Z]*" for letter in letters))
    begin = re.compile(rf"(?:{'|'.join(letters)})(?![A-Z])")
    for fact in log.facts:
        text = fact.value.upper()
        if text.startswith("("):
            continue
        bracket = _instead_of_numbers(fact.value) if begin.match(text) or _PROGRAM.search(text) else None
        is_title = (fact.line or 0) < log.rows[0][0] and not any(map(str.isdigit, text))
        if bracket is not None or (row.fullmatch(text) and not is_title):
            wrong = f"{quoted(fact.value)} is damaged: a row has a number behind every letter"
            faults.add(log.name, fact.line, None, bracket or f"{wrong}, an empty variable prints none")
            return True
    return False


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
