"""Q-DAS ASCII transfer format (``.dfq``): K-fields of parts and characteristics, and values by characteristic.

Values are coded (``K0001/2 10,023``) or stand in lines that 0x0F separates into characteristics and 0x14 into value,
attribute, date, event and more (K0001, K0002, K0004, ...). Where all characteristics are coordinates (``P1.X``,
``P1_Y``, ``P1 Z``) the rows are points with ``target``, ``x``, ``y``, ``z`` and nominal values (K2101); else each
characteristic is a column by its name (K2002). Attributes of 255 and above mark a value that does not count.

Each value of a coordinate is a record: a part, or the same one clamped again. The format does not say which, and two
clampings have no common frame: ``record`` says which record is read, or that all stood in one clamping.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from monitor.readers.export import Export, ExportFile, ExportFormat, Fact
from monitor.readers.faults import Faults, quoted
from monitor.readers.foreign_units import foreign_unit
from monitor.readers.tables.cut_files import CUT, is_cut
from monitor.readers.tables.foreign_text import decode_foreign
from monitor.readers.toml_table import Table

_FIELD = re.compile(r"K([0-9]{4})(?:/([0-9]{1,6}))?(?:\s+(.*?))?\s*")
_COORDINATE = re.compile(r"(.+?)[ ._-]?([XYZ])", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]*)?(?:[eE][+-]?[0-9]+)?")
#: Attributes from here on mean that there is no valid value (K0002).
_INVALID = 255
#: More characteristics than any part has.
_MOST = 100_000
#: What ``record`` says where all records are of one clamping.
ONE_CLAMPING = "one clamping"
_NAME, _NOMINAL, _UNIT, _VALUE, _ATTRIBUTE, _DATE = "2002", "2101", "2142", "0001", "0002", "0004"


class _Beside(NamedTuple):
    """A K-field that stands above its value or below it: how many ``values`` of its characteristic stand above it, its
    ``text``, its ``line``."""

    values: int
    text: str
    line: int


#: Fields that stand beside values, by the number of their characteristic, 0 for all of them.
_Besides = dict[int, list[_Beside]]


@dataclass
class _Part:
    """What has been read: fields of each characteristic by its number, its values with their lines, the records that
    its attributes mark invalid, its attributes and dates, and of each line of values how many fields every one of them
    has. ``started`` has the date of a record."""

    fields: dict[tuple[str, int], tuple[str, int]] = field(default_factory=dict)
    values: dict[int, list[tuple[str, int]]] = field(default_factory=dict)
    facts: list[Fact] = field(default_factory=list)
    started: dict[int, str] = field(default_factory=dict)
    invalid: dict[int, dict[int, str]] = field(default_factory=dict)
    attributes: _Besides = field(default_factory=dict)
    dates: _Besides = field(default_factory=dict)
    lines: dict[int, list[int]] = field(default_factory=dict)

    def text(self, key: str, number: int) -> str | None:
        """Return a field of a characteristic, or that of all of them."""
        entry = self.fields.get((key, number)) or self.fields.get((key, 0))
        return None if entry is None else entry[0]

    def records(self, number: int) -> int:
        """Return how many values of a characteristic have been read; of 0, how many records of the part."""
        return len(self.values.get(number, ())) if number else max(map(len, self.values.values()), default=0)

    def mark(self, number: int, record: int, attribute: str) -> None:
        """Note that a record of a characteristic does not count."""
        self.invalid.setdefault(number, {})[record] = f"attribute K0002 = {attribute}"

    def withdraw(self, number: int, record: int, attribute: str) -> None:
        """Take a value back that an attribute of another line marks invalid, where there is one."""
        values = self.values.get(number, [])
        if 0 <= record < len(values):
            values[record] = ("", values[record][1])
            self.mark(number, record, attribute)

    def add(self, number: int, cells: list[str], line: int) -> str | None:
        """Note a value with its attribute and date; what is wrong with it."""
        value = cells[0].strip()
        attribute = cells[1].strip() if len(cells) > 1 else ""
        if is_invalid(attribute):
            self.mark(number, len(self.values.get(number, ())), attribute)
            value = ""
        elif value and not _NUMBER.fullmatch(value):
            # An empty one may be marked invalid on the line below.
            return f"{quoted(value)} is not a value; attributive characteristics have none"
        of_number = self.values.setdefault(number, [])
        if len(cells) > 2 and cells[2].strip():
            self.started.setdefault(len(of_number), cells[2].strip().replace("/", " "))
        of_number.append((value.replace(",", "."), line))
        return None


def is_invalid(attribute: str) -> bool:
    """Return whether an attribute says that the value beside it does not count."""
    return attribute.isdigit() and int(attribute) >= _INVALID


def settings(table: Table) -> int | str | None:
    """Read the key of a file of points with several records: ``record = 2``, or ``record = "one clamping"``."""
    value = table.raw("record", required=False, example="1")
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    if value is None or value == ONE_CLAMPING:
        return None if value is None else ONE_CLAMPING
    table.fault("record", f'{quoted(value)} is no record; write its number from 1 on, or "{ONE_CLAMPING}"')
    return None


def read(file: ExportFile, record: int | str | None, faults: Faults) -> Export | None:
    """Read the values of all characteristics; None with the faults noted."""
    decoded = decode_foreign(file.name, file.content, faults)
    if decoded is None:
        return None
    before = len(faults)
    coded = "\n".join(line for line in decoded[0].split("\n") if line.startswith(f"K{_VALUE}"))
    if coded and decoded[0].endswith(coded.rpartition("\n")[2]) and is_cut(coded):
        faults.add(file.name, decoded[0].count("\n") + 1, None, CUT)
        return None
    part = _Part()
    for number, line in enumerate(decoded[0].split("\n"), start=1):
        if line.strip():
            fault = _line(part, line, number)
            if fault is not None:
                faults.add(file.name, number, None, fault)
        if len(faults) > before + 20:
            return None
    if len(faults) == before:
        _mark(part, file.name, faults)
        _complete(part, file.name, faults)
    if len(faults) > before:
        return None
    notes = (*_dated(part), *_unmeasured(part))
    points = _points(part, file.name, decoded[1], record, faults)
    export = points or _table(part, decoded[1])
    return None if len(faults) > before else replace(export, notes=notes)


class _Sides(NamedTuple):
    """Whether some field stands above the first value of its characteristic, and some below the last."""

    above: bool
    below: bool


def _sides(part: _Part, fields: _Besides) -> _Sides:
    ends = [(each[0].values, each[-1].values, part.records(number)) for number, each in fields.items()]
    return _Sides(
        any(first == 0 for first, _, records in ends if records),
        any(last == records for _, last, records in ends if records),
    )


def _records_of(part: _Part, number: int, fields: list[_Beside], sides: _Sides) -> list[int] | None:
    """Return the records of the fields of a characteristic, None where the file does not say whose they are.

    As many fields as values are theirs in turn. Fewer are told apart where some field of the file stands above the
    first value of its characteristic or below the last.
    """
    above = [each.values for each in fields]
    if len(set(above)) == part.records(number) == len(above):
        return list(range(len(above)))
    return [values - sides.below for values in above] if sides.above != sides.below else None


def _dated(part: _Part) -> tuple[str, ...]:
    """Give the records the dates of K-fields; a sentence on those of which the file does not say whose they are."""
    sides = _sides(part, part.dates)
    unclear: list[int] = []
    # A value's own date counts before one of all values, as that of a head.
    for number, dates in sorted(part.dates.items(), key=lambda of: (of[0] == 0, of[0])):
        records = _records_of(part, number, dates, sides)
        if records is None:
            unclear.append(dates[0].line)
            continue
        for record, date in zip(records, dates, strict=True):
            if date.text and 0 <= record < part.records(number):
                part.started.setdefault(record, date.text)
    if not unclear:
        return ()
    return (
        f"K0004 on line {min(unclear)} may be the date of the value above it or of that below it, and is taken for "
        "neither; write [[runs]] with started_at where no other date stands",
    )


def _mark(part: _Part, name: str, faults: Faults) -> None:
    """Mark the values that attributes of K-fields say are none; refuse an attribute of which the file does not say
    whether it is of the value above it or of that below it."""
    sides, of_dates = (_sides(part, fields) for fields in (part.attributes, part.dates))
    for number, attributes in sorted(part.attributes.items()):
        records: Sequence[int | None] | None = _records_of(part, number, attributes, sides)
        if records is None and not sides.above:
            records = _beside_dates(part, number, of_dates)
        for index, attribute in enumerate(attributes):
            if not is_invalid(attribute.text):
                continue
            record = None if records is None else records[index]
            if record is None:
                faults.add(
                    name, attribute.line, f"K{_ATTRIBUTE}",
                    "the attribute marks the value above it or that below it invalid, and the file does not say which; "
                    "export attributes with every value, or in one line with them",
                )  # fmt: skip
                return
            for which in [number] if number else part.values:
                part.withdraw(which, record, attribute.text)


def _beside_dates(part: _Part, number: int, sides: _Sides) -> Sequence[int | None] | None:
    """Return the records of attributes whose places their like do not tell: where dates stand above their values, that
    of the date above it, else that of the value above it, as the format has it; None where that is not sure."""
    attributes = part.attributes[number]
    if not part.dates or (sides.below and not sides.above):
        return [attribute.values - 1 for attribute in attributes]
    if sides.below or not sides.above:
        return None
    first: dict[int, int] = {}
    for date in (*part.dates.get(number, ()), *part.dates.get(0, ())):
        first[date.values] = min(date.line, first.get(date.values, date.line))
    return [
        attribute.values if first.get(attribute.values, attribute.line) < attribute.line else None
        for attribute in attributes
    ]


def _unmeasured(part: _Part) -> tuple[str, ...]:
    """Return a sentence on the last characteristics where they are named and have no value."""
    named = {number for key, number in part.fields if key == _NAME}
    most = max(part.values)
    if most >= max(named, default=0):
        return ()
    line = part.fields[_NAME, min(number for number in named if number > most)][1]
    return (
        f"characteristics from {most + 1} on (line {line}) are named and have no value: were they measured, "
        "the file is cut",
    )


def _line(part: _Part, line: str, number: int) -> str | None:
    """Read one line; what is wrong with it."""
    if not line.startswith("K"):
        return _values(part, line, number)
    match = _FIELD.fullmatch(line)
    if match is None:
        return f"{quoted(line.strip())} is no K-field; write for example K2002/1 P1.X"
    key, which, value = match[1], int(match[2] or 0), match[3] or ""
    if key == _VALUE:
        return part.add(which, [value], number)
    if key in (_ATTRIBUTE, _DATE):
        fields = part.attributes if key == _ATTRIBUTE else part.dates
        text = value.replace("/", " ")
        fields.setdefault(which, []).append(_Beside(part.records(which), text, number))
    elif key.startswith("1") and value:
        part.facts.append(Fact(f"K{key}", value, number))
    part.fields[key, which] = (value, number)
    return None


def _values(part: _Part, line: str, number: int) -> str | None:
    """Read a line of values, one a characteristic; what is wrong with it."""
    part.lines[number] = [value.count("\x14") + 1 for value in line.split("\x0f")]
    for index, value in enumerate(line.split("\x0f"), start=1):
        if index > _MOST:
            return "the line has more characteristics than any part"
        fault = part.add(index, value.split("\x14"), number)
        if fault is not None:
            return fault
    return None


def _complete(part: _Part, name: str, faults: Faults) -> None:
    """Refuse a file without values, with fewer characteristics than it says, or with values of unequal number."""
    if not part.values:
        faults.add(
            name, 1, None, "the file has no value; export the measurement with its values, not the test plan"
        )
        return
    for number, values in part.values.items():
        for record, (value, line) in enumerate(values):
            if not value and record not in part.invalid.get(number, {}):
                faults.add(
                    name, line, None,
                    f"characteristic {number} has no value here and no attribute that marks it invalid (K0002 = 255); "
                    "export the measurement again",
                )  # fmt: skip
                return
    stated = part.fields.get(("0100", 0))
    named = {number for key, number in part.fields if key == _NAME}
    if stated is not None and stated[0].isdigit() and int(stated[0]) != len(named):
        faults.add(
            name,
            stated[1],
            "K0100",
            f"{stated[0]} characteristics are announced and {len(named)} named; the file is cut",
        )
    _whole_line(part, named, name, faults)
    nameless = sorted(set(part.values) - named)
    if nameless:
        line = part.values[nameless[0]][0][1]
        faults.add(
            name, line, None, f"characteristic {nameless[0]} has values and no name (K2002/{nameless[0]})"
        )
    counts = {number: len(values) for number, values in part.values.items()}
    if len(set(counts.values())) > 1:
        most = max(counts.values())
        short = next(number for number, count in counts.items() if count < most)
        faults.add(
            name, part.values[short][-1][1], None,
            f"characteristic {short} has {counts[short]} values where others have {most}; the file is cut",
        )  # fmt: skip


def _whole_line(part: _Part, named: set[int], name: str, faults: Faults) -> None:
    """Refuse lines of values that end before the last characteristic, and the last line where it ends within the fields
    of its last value: no other line can be cut there."""
    end = max(part.lines, default=0)
    for line, fields in part.lines.items():
        if len(fields) < max(named, default=0):
            faults.add(
                name, line, None,
                f"the line has values of {len(fields)} characteristics where {max(named)} are named; the file is cut "
                "here: export it again",
            )  # fmt: skip
            return
        if line == end and len(fields) > 1 and fields[-1] < min(fields[:-1]):
            faults.add(
                name, line, None,
                f"the last value of the line has {fields[-1]} fields where the others have {min(fields[:-1])}; the "
                "file is cut here: export it again",
            )  # fmt: skip
            return


def _coordinates(part: _Part) -> dict[str, dict[str, int]] | None:
    """Return the characteristics of the points by target and letter; None where one is no coordinate of a point."""
    points: dict[str, dict[str, int]] = {}
    for number in sorted(part.values):
        match = _COORDINATE.fullmatch(part.text(_NAME, number) or "")
        if match is None or match[2].lower() in points.get(match[1], {}):
            return None
        points.setdefault(match[1], {})[match[2].lower()] = number
    letters = set(next(iter(points.values())))
    return points if all(set(numbers) == letters for numbers in points.values()) else None


def _records(part: _Part, name: str, record: int | str | None, faults: Faults) -> range:
    """Return the records that are read; empty with the fault noted where that is not said."""
    values = next(iter(part.values.values()))
    if record == ONE_CLAMPING or (len(values) == 1 and record in (None, 1)):
        return range(len(values))
    if isinstance(record, int) and record <= len(values):
        return range(record - 1, record)
    if isinstance(record, int):
        faults.add(name, None, "record", f"there is no record {record}; the file has {len(values)}")
    else:
        faults.add(
            name, values[1][1], None,
            f"every coordinate has {len(values)} records (parts, or clampings of one), which would share one frame; "
            "write one [[exports]] a record, each with its own run and record = 1, record = 2, ..., or "
            f'record = "{ONE_CLAMPING}" where the part was not moved in between',
        )  # fmt: skip
    return range(0)


def _points(part: _Part, name: str, layout: str, record: int | str | None, faults: Faults) -> Export | None:
    """Return the rows of points where every characteristic with values is a coordinate of one; None otherwise."""
    points = _coordinates(part)
    if points is None:
        if record is not None:
            faults.add(
                name, None, "record", "the characteristics are no coordinates of points; leave record out"
            )
        return None
    units = {part.text(_UNIT, number) for number in part.values}
    if len(units) > 1:
        shown = ", ".join(sorted(map(str, units)))
        faults.add(
            name, None, "K2142", f"the coordinates are in different units ({shown}); export them in one"
        )
        return None
    columns: dict[str, list[str]] = {}
    lines: list[int] = []
    invalid: dict[str, dict[int, str]] = {}
    records = _records(part, name, record, faults)
    if not records:
        return None
    for visit in records:
        for target, numbers in points.items():
            columns.setdefault("target", []).append(target)
            for letter, number in sorted(numbers.items()):
                nominal = (part.text(_NOMINAL, number) or "").replace(",", ".")
                columns.setdefault(letter, []).append(part.values[number][visit][0])
                columns.setdefault(f"nominal_{letter}", []).append(nominal)
                if visit in part.invalid.get(number, {}):
                    why = f"{part.invalid[number][visit]} of {target}"
                    invalid.setdefault(letter, {})[len(lines)] = why
            lines.append(part.values[min(numbers.values())][visit][1])
    columns = _without_empty(columns, invalid)
    unit = next(iter(units)) or ""
    stated = dict.fromkeys(columns.keys() - {"target"}, unit) if foreign_unit(unit) else {}
    started = next((part.started[visit] for visit in records if visit in part.started), None)
    return Export(columns, stated, lines, layout, tuple(part.facts), started, invalid=invalid)


def _without_empty(
    columns: Mapping[str, list[str]], invalid: Mapping[str, Mapping[int, str]]
) -> dict[str, list[str]]:
    """Return the columns that have a cell, or whose cells are marked invalid."""
    return {key: cells for key, cells in columns.items() if any(cells) or key in invalid}


def _table(part: _Part, layout: str) -> Export:
    columns: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    invalid: dict[str, dict[int, str]] = {}
    for number in sorted(part.values):
        label = part.text(_NAME, number) or str(number)
        label = label if label not in columns else f"{label} {number}"
        invalid[label] = part.invalid.get(number, {})
        columns[label] = [value for value, _ in part.values[number]]
        unit = part.text(_UNIT, number)
        if unit is not None and foreign_unit(unit) is not None:
            units[label] = unit
    lines = [line for _, line in part.values[min(part.values)]]
    started = part.started[min(part.started)] if part.started else None
    return Export(columns, units, lines, layout, tuple(part.facts), started, invalid=invalid)


EXPORT = ExportFormat(
    "q-das",
    "Q-DAS ASCII transfer format: points (target, x, y, z) or a column a characteristic",
    read,
    settings,
    suffixes=(".dfq",),
)
