"""A campaign from files of instruments and their mapping, with what was understood of each file."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from monitor.exceptions import CampaignError, Fault
from monitor.readers.axes import axes_of_machine
from monitor.readers.campaign import probings_file, runs_file
from monitor.readers.campaign.campaign_parts import Head, campaign_of, read_head, read_parts
from monitor.readers.doubts.repeated_rows import repeated_sequences
from monitor.readers.export import LARGEST_EXPORT, Export, ExportFile
from monitor.readers.exports import table as plain_table
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.files import LARGEST_TOML, decode, read_bytes
from monitor.readers.mapping.mapping_file import FILE, Entry, ExportMapping, read_mapping
from monitor.readers.mapping.pointing import DIRECTION
from monitor.readers.mapping.positions import joined
from monitor.readers.mapping.rows import TARGET, TIME, Rows, Wanted, rows_of
from monitor.readers.mapping.stated import compare
from monitor.readers.mapping.understood import UnderstoodFile, columns_of
from monitor.readers.setups.file import FORMATS
from monitor.readers.tables.csv_table import MOST_LINES, CsvTable
from monitor.readers.toml_table import parse_toml
from monitor.records import Campaign, Setup, SourceFile

_LINE = re.compile(r"\bline ([0-9]+)\b")


@dataclass(frozen=True)
class Exports:
    """A campaign from files of instruments: what was understood of each file, and what may be a mistake."""

    campaign: Campaign
    files: tuple[UnderstoodFile, ...]
    notes: tuple[str, ...]
    parts: tuple[_Part, ...] = ()

    def place(self, run: int, sequence: int) -> tuple[str, int] | None:
        """Return the file and the line that a row came from; None where there is no such row."""
        for part in self.parts:
            if part.entry.run == run and sequence <= len(part.rows):
                return part.file.name, int(part.rows.lines[sequence - 1])
            sequence -= len(part.rows) if part.entry.run == run else 0
        return None


@dataclass(frozen=True)
class _Part:
    """The rows of one file, under the entry of the mapping that they belong to."""

    entry: Entry
    file: ExportFile
    export: Export
    rows: Rows


def read_exports(mapping: Path, paths: Sequence[Path], name: str | None = None) -> Exports:
    """Read files of instruments by a mapping; ``name`` takes the place of the campaign's name in the mapping.

    Raises CampaignError with all faults, by file and line; nothing is read half.
    """
    faults = Faults((FILE, *(path.name for path in paths)))
    content = read_bytes(mapping.parent, mapping.name, LARGEST_TOML, faults)
    text = None if content is None else decode(mapping.name, content, faults)
    top = None if text is None else parse_toml(FILE, text, faults)
    if content is None or top is None:
        raise CampaignError(str(mapping), faults.sorted())
    if name is not None:
        top.data["campaign"] = name
    read = read_mapping(top)
    head = read_head(top)
    files = _files(paths, faults)
    parts = _parts(read, head, files, faults)
    runs = _runs_table(read, parts, faults)
    if len(faults):
        raise CampaignError(str(mapping), _under(faults.sorted(), mapping.name))
    head = _without_unread(head, read, parts)
    probings, places = _probings_table(parts)
    understood = read_parts(head, runs, probings, faults)
    if len(faults):
        raise CampaignError(str(mapping), _under(_at_home(faults.sorted(), parts, places), mapping.name))
    used = {part.file.name for part in parts} | {part.entry.positions for part in parts}
    sources = [SourceFile(mapping.name, content)]
    sources += [SourceFile(file.name, file.content) for file in files.values() if file.name in used]
    campaign = campaign_of(head, understood, tuple(sources))
    exports = Exports(campaign, tuple(map(_understood, parts)), (), tuple(parts))
    notes = (*_repeated(exports), *_notes(parts, [file for file in files if file not in used]))
    return replace(exports, notes=notes)


def _notes(parts: Sequence[_Part], unused: Sequence[str]) -> tuple[str, ...]:
    """Return what may be a mistake in the files."""
    notes = [f"{part.file.name}: {note}" for part in parts for note in part.export.notes]
    notes += [f"{file} is named by no [[exports]] of the mapping and was not read" for file in unused]
    return tuple(dict.fromkeys(notes))


def _repeated(exports: Exports) -> tuple[str, ...]:
    """Return sentences on lines of files that equal another in every cell, but for the block of rows that
    ``repeated_rows`` tells of."""
    again = {part.file.name: part.export.repeated for part in exports.parts if part.export.repeated}
    block = repeated_sequences(exports.campaign) if again else None
    if block is not None:
        run, sequences = block
        lines_of_block = {exports.place(run, sequence) for sequence in sequences}
        again = {
            name: lines
            for name, lines in again.items()
            if any((name, line) not in lines_of_block for line in lines)
        }
    return tuple(
        f"{name}: {len(lines)} rows equal an earlier one in every cell (line {', '.join(map(str, lines[:5]))}"
        f"{', ...' if len(lines) > 5 else ''}); were they exported twice?"
        for name, lines in again.items()
    )


def _files(paths: Sequence[Path], faults: Faults) -> dict[str, ExportFile]:
    """Return the files by their names, in alphabetical order with numbers as numbers."""
    files: dict[str, ExportFile] = {}
    for path in sorted(
        paths,
        key=lambda path: [int(part) if part.isdigit() else part for part in re.split(r"([0-9]+)", path.name)],
    ):
        if path.name in files:
            faults.add(path.name, None, None, "two files have this name; give each a name of its own")
            continue
        content = read_bytes(path.parent, path.name, LARGEST_EXPORT, faults)
        if content is not None:
            files[path.name] = ExportFile(path.name, content)
    return files


def _parts(read: ExportMapping, head: Head, files: Mapping[str, ExportFile], faults: Faults) -> list[_Part]:
    """Return the rows of every file of every entry, in the order of the mapping."""
    parts: list[_Part] = []
    exports: dict[tuple[str, str, str], Export | None] = {}
    for entry in read.entries:
        wanted = _wanted(entry, head)
        names = [name for name in files if fnmatch.fnmatch(name, entry.pattern)]
        if not names and not entry.optional:
            entry.table.fault("file", f"no file is called {quoted(entry.pattern)}; there are {one_of(files)}")
        for name in names:
            key = (name, entry.format.name, repr(entry.settings))
            if key not in exports:
                exports[key] = entry.format.read(files[name], entry.settings, faults)
            export = exports[key]
            if export is not None and entry.positions is not None:
                export = _with_positions(entry, name, export, files, wanted, faults)
            part = None if export is None else _part(entry, files[name], export, wanted, faults)
            parts += [] if part is None else [part]
    if sum(len(part.rows) for part in parts) > MOST_LINES:
        faults.add(FILE, None, None, f"the files have more than {MOST_LINES} rows; split the campaign")
    return parts


def _part(
    entry: Entry, file: ExportFile, export: Export, wanted: Wanted | None, faults: Faults
) -> _Part | None:
    """Return the rows of a file with what is to be said of them; None with the faults noted."""
    rows = None if wanted is None else rows_of(entry, file.name, export, wanted, faults)
    if rows is None or wanted is None:
        return None
    notes = (*export.notes, *rows.notes, *compare(entry, file.name, export, rows, wanted))
    return _Part(entry, file, replace(export, notes=notes), rows)


def _without_unread(head: Head, read: ExportMapping, parts: Sequence[_Part]) -> Head:
    """Return the head without the setups of optional exports that had no file."""
    if head.artefact is None:
        return head
    rows_of_setup = {part.entry.setup for part in parts}
    absent = {entry.setup for entry in read.entries if entry.optional} - rows_of_setup
    setups = tuple(setup for setup in head.artefact.setups if setup.id not in absent)
    return replace(head, artefact=replace(head.artefact, setups=setups))


def _with_positions(
    entry: Entry,
    name: str,
    export: Export,
    files: Mapping[str, ExportFile],
    wanted: Wanted | None,
    faults: Faults,
) -> Export | None:
    file = files.get(entry.positions or "")
    if file is None:
        entry.table.fault(
            "positions", f"no file is called {quoted(entry.positions)}; there are {one_of(files)}"
        )
        return None
    positions = plain_table.read(file, plain_table.TableSettings(), faults)
    if positions is None or wanted is None:
        return None
    return joined(entry, name, export, file.name, positions, wanted.axes)


def _wanted(entry: Entry, head: Head) -> Wanted | None:
    """Return what the campaign asks of the rows of an entry; None where the head is damaged or has no such setup."""
    if head.rules is None or head.machine.machine is None or head.artefact is None:
        return None
    machine = head.machine.machine
    axes = axes_of_machine(machine)
    setups = head.artefact.setups
    if not head.rules.needs_setups:
        if entry.setup is not None:
            entry.table.fault("setup", f"the method {head.rules.name} has no setups; leave this out")
            return None
        return Wanted(machine, axes, None, (TARGET, *head.rules.measured_columns), ())
    setup = _setup(entry, setups)
    if setup is None:
        return None
    form = FORMATS[setup.reading]
    computed = () if entry.pointing is None else DIRECTION
    columns = tuple(name for name in form.columns if name not in computed)
    return Wanted(machine, axes, setup, columns, form.optional)


def _setup(entry: Entry, setups: Sequence[Setup]) -> Setup | None:
    ids = [setup.id for setup in setups]
    if entry.setup is None and len(setups) == 1:
        return setups[0]
    if entry.setup in ids:
        return setups[ids.index(entry.setup)]
    what = (
        "nothing says whose readings these are"
        if entry.setup is None
        else f"there is no setup {quoted(entry.setup)}"
    )
    example = ids[0] if ids else "laser-x"
    entry.table.fault("setup", f'{what}; write setup = "{example}"; the setups are {one_of(ids)}')
    return None


def _runs_table(read: ExportMapping, parts: Sequence[_Part], faults: Faults) -> CsvTable | None:
    """Return the runs as the mapping lists them, or one for each run of the exports, elapsed when its files say."""
    rows: list[dict[str, str]] = []
    lines: list[int] = []
    first_day = None
    for table in read.runs:
        row = {key: _cell(value) for key, value in table.data.items()}
        for key in table.data:
            table.raw(key, required=False, example="")
        rows.append({"run": "1", "day": "1", "warm_up": "false", **row})
        lines.append(len(rows))
    if not read.runs:
        for run in sorted({part.entry.run for part in parts}):
            started = _started(read, [part for part in parts if part.entry.run == run], run, faults)
            if started is not None:
                first_day = first_day or started.date()
                day = (started.date() - first_day).days + 1
                rows.append(
                    {"run": str(run), "started_at": started.isoformat(), "day": str(day), "warm_up": "false"}
                )
                lines.append(len(rows))
    if not rows:
        return None
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns: dict[str, Sequence[str]] = {name: [row.get(name, "") for row in rows] for name in names}
    return CsvTable(runs_file.FILE, columns, lines, ())


def _started(read: ExportMapping, parts: Sequence[_Part], run: int, faults: Faults) -> datetime | None:
    """Return when the first file of a run was elapsed; None with the fault noted."""
    moments: list[datetime] = []
    for part in parts:
        if part.export.started is None:
            continue
        moment = read.dates.moment(part.export.started)
        if isinstance(moment, str):
            started = part.export.started
            line = next((fact.line for fact in part.export.facts if fact.value == started), None)
            faults.add(part.file.name, line, "date", moment)
            return None
        moments.append(moment)
    if not moments:
        faults.add(
            FILE, None, "runs",
            f"no file says when run {run} began; write [[runs]] with run = {run} and started_at = "
            f'"{runs_file.EXAMPLE}"',
        )  # fmt: skip
        return None
    return min(moments)


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return value.isoformat() if isinstance(value, datetime) else str(value)


def _probings_table(parts: Sequence[_Part]) -> tuple[CsvTable, list[tuple[int, int]]]:
    """Return the rows of all files as one table, and for each of its lines the part and the row it came from."""
    places: list[tuple[int, int]] = []
    columns: dict[str, list[str]] = {"run": [], "sequence": [], TIME: []}
    with_setups = any(part.entry.setup is not None for part in parts)
    names = list(dict.fromkeys(name for part in parts for name in part.rows.cells if name not in columns))
    if with_setups:
        columns[probings_file.SETUP] = []
    columns |= {name: [] for name in names}
    numbered: dict[int, int] = {}
    clock: dict[int, float] = {}
    for index, part in sorted(enumerate(parts), key=lambda pair: pair[1].entry.run):
        run, setup = part.entry.run, part.entry.setup or ""
        count, before = len(part.rows), numbered.get(run, 0)
        numbered[run] = before + count
        columns["run"] += [str(run)] * count
        columns["sequence"] += [str(before + row + 1) for row in range(count)]
        times, clock[run] = _times(part, clock.get(run, 0.0))
        columns[TIME] += times
        if with_setups:
            columns[probings_file.SETUP] += [setup] * count
        for name in names:
            # Rows that name no target are readings of their setup, as in a campaign without that column.
            columns[name] += part.rows.cells.get(name, [setup if name == TARGET else ""] * count)
        places += [(index, row) for row in range(count)]
    lines = range(2, len(places) + 2)
    return CsvTable(probings_file.FILE, dict(columns), lines, ()), places


def _times(part: _Part, elapsed: float) -> tuple[list[str], float]:
    """Return the times of a part from the start of its run, behind the parts before it, and when the next may begin."""
    interval = part.entry.interval
    cells = part.rows.cells.get(TIME)
    if cells is None:
        times = [repr(round(elapsed + row * interval, 6)) for row in range(len(part.rows))]
        return times, elapsed + len(part.rows) * interval
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError:
        return list(cells), elapsed
    if elapsed == 0.0:
        return list(cells), max(numbers, default=0.0) + interval
    shift = elapsed - numbers[0]
    return [repr(round(number + shift, 6)) for number in numbers], max(numbers) + shift + interval


def _at_home(
    faults: Sequence[Fault], parts: Sequence[_Part], places: Sequence[tuple[int, int]]
) -> list[Fault]:
    """Return faults of the two tables as faults of the files, lines and columns that their cells came from."""
    translated = []
    for fault in _without_consequences(faults):
        if fault.file == probings_file.FILE and fault.line is not None and fault.line >= 2:
            translated.append(_of_row(fault, parts, places))
        elif fault.file in (probings_file.FILE, runs_file.FILE):
            where = "exports" if fault.file == probings_file.FILE else "runs"
            number = f"[{fault.line}]" if fault.file == runs_file.FILE and fault.line is not None else ""
            column = f"{where}{number}" + ("" if fault.column is None else f".{fault.column}")
            message = fault.message.replace(probings_file.FILE, "the exports").replace(
                runs_file.FILE, "[[runs]]"
            )
            translated.append(replace(fault, file=FILE, line=None, column=column, message=message))
        elif fault.file == "campaign.toml":
            translated.append(
                replace(fault, file=FILE, message=fault.message.replace(probings_file.FILE, "the exports"))
            )
        else:
            translated.append(fault)
    return translated


def _without_consequences(faults: Sequence[Fault]) -> list[Fault]:
    """Return the faults without setups that have no row because none of their rows could be read."""
    if not any(fault.file == probings_file.FILE and fault.line is not None for fault in faults):
        return list(faults)
    return [fault for fault in faults if not (fault.column == "setups" and "has no row" in fault.message)]


def _of_row(fault: Fault, parts: Sequence[_Part], places: Sequence[tuple[int, int]]) -> Fault:
    def line_of(number: int) -> tuple[str, int]:
        if not 0 <= number - 2 < len(places):
            return "", number
        part, row = places[number - 2]
        return parts[part].file.name, int(parts[part].rows.lines[row])

    assert fault.line is not None
    part = parts[places[fault.line - 2][0]]
    file, line = line_of(fault.line)

    def named(match: re.Match[str]) -> str:
        other, at = line_of(int(match[1]))
        return f"line {at}" if other in ("", file) else f"line {at} of {other}"

    origin = part.rows.origins.get(fault.column or "")
    column = fault.column if origin is None or origin.column is None else f"{origin.column} ({fault.column})"
    message = _LINE.sub(named, fault.message).replace("runs.csv", "[[runs]] of the mapping")
    return Fault(file, line, column, message)


def _under(faults: Sequence[Fault], mapping: str) -> list[Fault]:
    """Return faults of the mapping under the name of its file."""
    return [replace(fault, file=mapping) if fault.file == FILE else fault for fault in faults]


def _understood(part: _Part) -> UnderstoodFile:
    facts = tuple(f"{fact.key}: {fact.value}" for fact in part.export.facts[:12])
    axes = [name for name in part.rows.cells if probings_file.READING.fullmatch(name)]
    sources = {name: origin.how for name, origin in part.rows.origins.items()}
    return UnderstoodFile(
        part.file.name, SourceFile(part.file.name, part.file.content).sha256, part.entry.format.name,
        part.export.layout, part.entry.setup, part.entry.run, len(part.rows), part.export.started, facts,
        columns_of({**part.rows.angles, **part.rows.cells}, sources, axes),
    )  # fmt: skip
