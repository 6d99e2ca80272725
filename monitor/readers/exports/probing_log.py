"""Protocols of probing cycles as HEIDENHAIN controls write them (``TCHPR421.TXT``): ``key: value`` under headings.

Each protocol, from its heading to its end mark, is a row; several may stand behind each other in one file. A column is
the heading and the key, ``Actual values/Center in reference axis``. The line "Type of dimension (0 = MM / 1 = INCH)"
says the unit.

Source: the manuals of the TNC controls, "Recording the results of measurement", log file of touch probe cycle 421.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.tables.foreign_text import decode_foreign

_BEGIN = re.compile(r"\s*(measuring log|messprotokoll)\b.*", re.IGNORECASE)
_END = re.compile(r"\s*(end of measuring log|ende (des )?messprotokolls?)\b.*", re.IGNORECASE)
_DIMENSION = re.compile(r"\s*(?:type of dimension|ma(?:ss|ß)art)\b.*?\)?\s*:\s*([01])\s*", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]*)?")
_PAIR = re.compile(r"\s*([^:]+?)\s*:\s*(.*?)\s*")
_DATES = ("date", "datum", "time", "uhrzeit")
_ANGLE = re.compile(r"angle|winkel", re.IGNORECASE)


@dataclass
class _Record:
    """One protocol: numbers by heading and key with their lines, its words, and the unit that it states."""

    title: str
    line: int
    cells: dict[str, str] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    unit: str | None = None
    ended: bool = False
    heading: str = ""
    waiting: str = ""
    twice: str | None = None

    def read(self, text: str) -> None:
        """Read one line: a heading, a key with its value, or the value of the key above."""
        dimension = _DIMENSION.fullmatch(text)
        pair = _PAIR.fullmatch(text)
        if dimension is not None:
            self.unit = ("mm", "inch")[int(dimension[1])]
        elif self.waiting and _NUMBER.fullmatch(text):
            # The value may stand on the line below its key.
            self._note(self.waiting, text)
            self.waiting = ""
        elif pair is not None and not pair[2]:
            self.heading, self.waiting = self.waiting or self.heading, pair[1]
        elif pair is not None:
            self.heading, self.waiting = self.waiting or self.heading, ""
            if _NUMBER.fullmatch(pair[2]):
                self._note(pair[1], pair[2])
            else:
                self.texts[pair[1]] = pair[2]

    def facts(self) -> tuple[Fact, ...]:
        """Return its heading and its words."""
        return (Fact("protocol", self.title, self.line), *(Fact(*text) for text in self.texts.items()))

    def _note(self, key: str, number: str) -> None:
        name = f"{self.heading}/{key}" if self.heading else key
        if self.cells.setdefault(name, number) != number:
            self.twice = name

    def no_number(self, names: Iterable[str]) -> tuple[str, str] | None:
        """Return the first of the names under which this protocol has a text instead, and that text."""
        lacking = (name for name in names if name not in self.cells)
        return next(
            ((name, text) for name in lacking if (text := self.texts.get(name.rpartition("/")[2]))), None
        )


def read(file: ExportFile, settings: None, faults: Faults) -> Export | None:
    """Read the protocols of a file; None with the faults noted."""
    decoded = decode_foreign(file.name, file.content, faults)
    if decoded is None:
        return None
    lines = decoded[0].split("\n")
    records = _records(lines)
    begin = next((number for number, line in enumerate(lines, start=1) if line.strip()), 1)
    if not records or records[0].line != begin:
        faults.add(
            file.name,
            begin,
            None,
            'no protocol begins here; its first line is such as "Measuring log for ..."',
        )
        return None
    if not _sound(file.name, records, faults):
        return None
    first = records[0]
    columns = {name: [record.cells[name].replace(",", ".") for record in records] for name in first.cells}
    stated = {name: "deg" if _ANGLE.search(name) else first.unit or "" for name in columns}
    date = " ".join(value for key, value in first.texts.items() if key.casefold() in _DATES)
    return Export(
        columns, {name: unit for name, unit in stated.items() if unit}, [record.line for record in records],
        decoded[1], first.facts(), date or None,
    )  # fmt: skip


def _records(lines: list[str]) -> list[_Record]:
    records: list[_Record] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if _BEGIN.fullmatch(text):
            records.append(_Record(text, number))
        elif records and _END.fullmatch(text):
            records[-1].ended = True
        elif records and text:
            records[-1].read(text)
    return records


def _sound(name: str, records: list[_Record], faults: Faults) -> bool:
    """Refuse protocols that are cut, of other cycles than the first, or in another unit."""
    before = len(faults)
    first = records[0]
    names = dict.fromkeys(name for record in records for name in record.cells)
    for record in records:
        if record.twice is not None:
            faults.add(
                name, record.line, None,
                f"{quoted(record.twice)} stands twice in this protocol with two values; write the log again",
            )  # fmt: skip
            return False
        if (odd := record.no_number(names)) is not None:
            faults.add(
                name, record.line, None,
                f"{quoted(odd[0])} of this protocol is {quoted(odd[1])} and no number; measure this point again, or "
                "take its protocol out",
            )  # fmt: skip
            return False
        if not record.ended:
            faults.add(
                name, record.line, None, 'this protocol has no end mark ("End of measuring log"): it is cut'
            )
        elif not record.cells:
            faults.add(
                name, record.line, None, "this protocol has no number; write the log of a measuring cycle"
            )
        elif list(record.cells) != list(first.cells):
            other = next(iter(set(record.cells) ^ set(first.cells)), "another order")
            faults.add(
                name, record.line, None,
                f"{quoted(other)} stands in one of this protocol and that on line {first.line} alone; put protocols of "
                f"different cycles into files of their own (this one has {one_of(list(record.cells)[:3])})",
            )  # fmt: skip
        elif record.unit != first.unit:
            faults.add(
                name, record.line, None,
                f"this protocol is in {record.unit or 'no stated unit'}, that on line {first.line} in "
                f"{first.unit or 'none'}; measure all of them in one",
            )  # fmt: skip
    return len(faults) == before


EXPORT = ExportFormat(
    "probing log",
    "protocols of probing cycles (TCHPR421.TXT): key and value under headings; a column is heading/key",
    read,
)
