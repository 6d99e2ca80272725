"""``probings.csv``: one row a probed target, with the axis readings and the recorded channels."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.readers.axes import FARTHEST_DEG, FARTHEST_MM, Axis
from monitor.readers.campaign.probings_order import refuse_disorder
from monitor.readers.campaign.recorded_columns import recorded_columns
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.method_rules import MethodRules
from monitor.readers.tables.csv_table import CsvTable, refuse_missing
from monitor.readers.tables.csv_values import Mask, Numbers, Wholes, numbers, wholes
from monitor.records import Probings

FILE = "probings.csv"
FIRST = ("run", "sequence", "time_s", "target")
#: The column that names a row's setup, and the channel that holds its number, from 1 in the order of campaign.toml.
SETUP = "setup"
# A column of readings: the axis' name in small letters, and mm or degrees.
READING = re.compile(r"[a-z][0-9]*_(mm|deg)")


@dataclass(frozen=True)
class ProbingsPart:
    """The rows in which nothing is wrong (n), their lines (n,), and the runs that have a damaged row."""

    probings: Probings
    lines: npt.NDArray[np.int64]
    damaged_runs: frozenset[int]


@dataclass(frozen=True)
class Expected:
    """What the other files of the folder ask of the probings; None where it could not be read, or is free.

    ``strokes`` are in the units of the file; ``runs`` has the line of every run that is listed; ``setups`` names those
    of a method whose rows belong to setups: a row then need not name a target.
    """

    axes: Sequence[Axis] | None
    strokes: Mapping[str, tuple[float, float]]
    targets: Sequence[str] | None
    runs: Mapping[int, int] | None
    rules: MethodRules | None
    setups: Sequence[str] | None = None

    @property
    def allowed(self) -> MethodRules:
        """The rules of the method, those that hold for all where it could not be read."""
        return MethodRules("") if self.rules is None else self.rules

    @property
    def first(self) -> tuple[str, ...]:
        """The columns that every row needs before its readings; with one setup none has to name it."""
        if not self.allowed.needs_setups:
            return FIRST
        several = self.setups is not None and len(self.setups) > 1
        return (*FIRST[:-1], *((SETUP,) if several else ()))

    @property
    def columns(self) -> dict[str, Axis]:
        """The axes by the column of their readings."""
        return {axis.column: axis for axis in self.axes or ()}

    @property
    def listed(self) -> tuple[str, ...]:
        """The required columns as the manual lists them: X, Y and Z before the rotary axes of the chain."""
        columns = self.columns
        lines = sorted(name for name, axis in columns.items() if axis.kind == "linear")
        turning = [name for name in columns if name not in lines]
        return (*self.first, *lines, *turning, *self.allowed.measured_columns)


@dataclass(frozen=True)
class _Columns:
    """The columns of a table that has all of them, over its rows (n)."""

    run: Wholes
    sequence: Wholes
    time: Numbers
    target: Sequence[str]
    setup: npt.NDArray[np.float64]
    readings: Mapping[str, Numbers]
    channels: Mapping[str, Numbers]

    @property
    def good(self) -> Mask:
        """The rows (n,) whose values can be read and whose setup there is; their runs are judged elsewhere."""
        read: list[Numbers | Wholes] = [
            *self.readings.values(),
            *self.channels.values(),
            self.time,
            self.sequence,
        ]
        return np.asarray(np.logical_and.reduce([*(column.good for column in read), self.setup != 0.0]))

    def probings(self, expected: Expected) -> Probings:
        """Return the rows in internal units, damaged ones among them."""
        channels = {name: channel.values for name, channel in self.channels.items()}
        return Probings(
            self.run.values,
            self.sequence.values,
            self.time.values,
            np.array(list(self.target), dtype=np.str_),
            {
                axis.name: self.readings[name].values * axis.unit.factor
                for name, axis in expected.columns.items()
            },
            {SETUP: self.setup, **channels} if expected.allowed.needs_setups else channels,
        )


def read_probings(table: CsvTable, expected: Expected, faults: Faults) -> ProbingsPart | None:
    """Read the probings; None where a column is missing or the axes could not be read.

    What does not depend on the missing column is checked all the same.
    """
    required = (*expected.first, *expected.columns, *expected.allowed.measured_columns)
    named = refuse_missing(table, expected.listed, faults)
    taken = (*required, "target", SETUP) if expected.allowed.needs_setups else required
    readings, channels = _cells(table, taken, named, expected, faults)
    time = numbers(table, "time_s", faults) if "time_s" in table.columns else None
    sequence = wholes(table, "sequence", faults) if "sequence" in table.columns else None
    setup, target = _setups(table, expected, faults)
    known_target = _known_targets(table, target, expected.targets, faults)
    if "run" not in table.columns:
        return None
    run = wholes(table, "run", faults)
    known_run = run.good & _known_runs(table, run, expected.runs, faults)
    in_order = run.good if time is None else refuse_disorder(table, run, sequence, time, faults)
    read = not expected.allowed.needs_setups or expected.setups is not None
    complete = read and expected.axes is not None and all(name in table.columns for name in required)
    if not complete or time is None or sequence is None:
        return None
    columns = _Columns(run, sequence, time, target, setup, readings, channels)
    good: Mask = columns.good & known_target & known_run & in_order
    probings = columns.probings(expected)
    damaged = _damaged_runs(table, run.values, known_run, good)
    if not good.all():
        probings = probings.rows(good)
    return ProbingsPart(probings, np.array(table.lines, dtype=np.int64)[good], frozenset(damaged))


def _setups(
    table: CsvTable, expected: Expected, faults: Faults
) -> tuple[npt.NDArray[np.float64], Sequence[str]]:
    """Return the number of each row's setup (n,), 0 where there is none of its name, and the targets of the rows.

    A row that names no target is a reading of its setup, whose other rows name none either: else it was forgotten.
    Methods without setups have one that nobody names.
    """
    targets = table.columns.get("target", ())
    if not expected.allowed.needs_setups or expected.setups is None:
        return np.ones(len(table)), targets
    names = list(expected.setups)
    cells = table.columns.get(SETUP, names[:1] * len(table))
    number = np.array([names.index(cell) + 1.0 if cell in names else 0.0 for cell in cells])
    for cell in dict.fromkeys(cell for cell in cells if cell not in names):
        lines = [line for line, other in zip(table.lines, cells, strict=True) if other == cell]
        message = f"there is no setup {quoted(cell)}; the setups are {one_of(names)}"
        faults.add(FILE, lines[0], SETUP, message + _and_more(lines))
    if not targets:
        return number, cells
    with_targets = {cell for cell, target in zip(cells, targets, strict=True) if target}
    return number, [
        target if target or cell in with_targets else cell
        for cell, target in zip(cells, targets, strict=True)
    ]


def _cells(
    table: CsvTable, required: Sequence[str], named: frozenset[str], expected: Expected, faults: Faults
) -> tuple[dict[str, Numbers], dict[str, Numbers]]:
    """Return the readings and the channels by column; readings of an axis that is not in the topology are refused."""
    columns, allowed = expected.columns, expected.allowed
    odd = [name for name in table.columns if READING.fullmatch(name) and name not in columns]
    if expected.axes is not None:
        for name in odd:
            message = f"the topology has no axis for {quoted(name)}; its columns are {one_of(columns)}"
            faults.add(FILE, 1, name, message)
    names = recorded_columns(table, [*required, *odd], faults, named, allowed.suffixes, allowed.plain_columns)
    readings = {}
    for name in [*columns, *(odd if expected.axes is None else ())]:
        if name in table.columns:
            axis = columns.get(name)
            stroke = None if axis is None else expected.strokes.get(axis.name)
            readings[name] = _within(table, name, stroke, faults)
            _let_go(table, name)
    channels = {}
    for name in names:
        channels[name] = numbers(table, name, faults, may_be_empty=True)
        _let_go(table, name)
    for name in allowed.measured_columns:
        if name in table.columns:
            channels[name] = _within(table, name, None, faults)
            _let_go(table, name)
    return readings, channels


def _let_go(table: CsvTable, column: str) -> None:
    """Empty a column that was read, whose cells nothing else looks at: the text of a million is 60 MB."""
    table.columns[column] = ()


def _within(table: CsvTable, column: str, stroke: tuple[float, float] | None, faults: Faults) -> Numbers:
    """Read a column of lengths or angles; those beyond the stroke, or beyond any machine, are refused."""
    cells = numbers(table, column, faults)
    unit = column.rpartition("_")[2]
    limit = FARTHEST_MM if unit == "mm" else FARTHEST_DEG
    low, high = stroke or (-limit, limit)
    if stroke is not None:
        range_text = f"the stroke of axis {column.rpartition('_')[0].upper()}, {low:g} to {high:g} {unit}"
    else:
        range_text = f"{limit:g} {unit} (no stroke is given); is its unit {unit}?"
    outside = (cells.values < low) | (cells.values > high)
    for row in np.flatnonzero(outside).tolist():
        cell = quoted(table.columns[column][row])
        faults.add(FILE, table.lines[row], column, f"{cell} is beyond {range_text}")
    return Numbers(cells.values, cells.good & ~outside)


def _known_targets(
    table: CsvTable, cells: Sequence[str], targets: Sequence[str] | None, faults: Faults
) -> Mask:
    """Return which rows name a target that there is, in ``cells``; a name that is unknown is reported once, with its
    lines."""
    if "target" not in table.columns:
        return np.ones(len(table), dtype=np.bool_)
    wrong = {
        cell for cell in set(cells) if not _is_name(cell) or (targets is not None and cell not in targets)
    }
    if not wrong:
        return np.ones(len(table), dtype=np.bool_)
    lines: dict[str, list[int]] = {}
    for line, cell in zip(table.lines, cells, strict=True):
        if cell in wrong:
            lines.setdefault(cell, []).append(line)
    for cell, cell_lines in lines.items():
        if not _is_name(cell):
            message = f"{quoted(cell)} is not a name; name what was probed"
        else:
            message = f"there is no target {quoted(cell)}; the targets are {one_of(targets or ())}"
        faults.add(FILE, cell_lines[0], "target", message + _and_more(cell_lines))
    return np.array([cell not in wrong for cell in cells], dtype=np.bool_)


def _known_runs(table: CsvTable, run: Wholes, listed: Mapping[int, int] | None, faults: Faults) -> Mask:
    """Return which rows belong to a listed run; runs that are not listed, or not probed, are refused."""
    if listed is None:
        return run.good
    is_listed: Mask = np.isin(run.values, np.fromiter(listed, dtype=np.int64, count=len(listed)))
    unknown: dict[int, list[int]] = {}
    for row in np.flatnonzero(run.good & ~is_listed).tolist():
        unknown.setdefault(int(run.values[row]), []).append(table.lines[row])
    for number, lines in unknown.items():
        message = f"run {number} is not listed in runs.csv; list it there, or correct the number"
        faults.add(FILE, lines[0], "run", message + _and_more(lines))
    probed = set(run.values[run.good].tolist()) | _runs_of(table)
    for number, line in listed.items():
        if number not in probed:
            message = f"run {number} has no row in {FILE}; remove the run, or add its probings"
            faults.add("runs.csv", line, "run", message)
    return is_listed


def _runs_of(table: CsvTable) -> set[int]:
    """Return the runs of rows with a wrong number of cells; -1 where the cell cannot be read."""
    index = list(table.columns).index("run")
    cells = [row[index] if len(row) > index else "" for row in table.damaged]
    return {int(cell) if re.fullmatch(r"[0-9]{1,10}", cell) else -1 for cell in cells}


def _damaged_runs(table: CsvTable, runs: npt.NDArray[np.int64], known_run: Mask, good: Mask) -> set[int]:
    """Return the runs that a faulty row belongs to, or may belong to: a ball missing from a run may be that row."""
    damaged = set(runs[~good].tolist()) | _runs_of(table)
    if -1 in _runs_of(table):
        return damaged | set(runs.tolist())
    lost = np.flatnonzero(~known_run)
    around = np.concatenate([lost - 1, lost + 1])
    return damaged | set(runs[around[(around >= 0) & (around < len(runs))]].tolist())


def _is_name(cell: str) -> bool:
    return bool(cell) and cell.isprintable() and cell == cell.strip() and len(cell) <= 200


def _and_more(lines: Sequence[int]) -> str:
    return f" (and on {len(lines) - 1} more lines, to line {lines[-1]})" if len(lines) > 1 else ""
