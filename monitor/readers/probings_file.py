"""``probings.csv``: one row a probed target, with the axis readings and the recorded channels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.readers.axes import FARTHEST_DEG, FARTHEST_MM, Axis
from monitor.readers.csv_table import CsvTable, refuse_missing
from monitor.readers.csv_values import Mask, Numbers, numbers, wholes
from monitor.readers.faults import Faults, one_of, quoted
from monitor.readers.method_rules import MethodRules
from monitor.readers.probings_order import refuse_disorder
from monitor.readers.recorded_columns import recorded_columns
from monitor.records import Probings

FILE = "probings.csv"
FIRST = ("run", "sequence", "time_s", "target")
# A column of readings: the axis' name in small letters, and mm or degrees.
READING = re.compile(r"[a-z][0-9]*_(mm|deg)")


@dataclass(frozen=True)
class ProbingsPart:
    """The rows in which nothing is wrong (n), their lines (n,), and the runs that have a damaged row."""

    probings: Probings
    lines: npt.NDArray[np.int64]
    damaged_runs: frozenset[int]


def read_probings(
    table: CsvTable,
    axes: Sequence[Axis] | None,
    strokes: dict[str, tuple[float, float]],
    targets: Sequence[str] | None,
    runs: dict[int, int] | None,
    rules: MethodRules | None,
    faults: Faults,
) -> ProbingsPart | None:
    """The probings, or None where a column is missing or the axes are not known.

    ``axes``, ``targets``, ``runs`` and ``rules`` are None where they could not be read, or are free; what does
    not depend on them is checked all the same.
    """
    columns = {axis.column: axis for axis in axes or ()}
    allowed = MethodRules("") if rules is None else rules
    required = (*FIRST, *columns, *allowed.measured_columns)
    refuse_missing(table, required, faults)
    odd = [name for name in table.columns if READING.fullmatch(name) and name not in columns]
    if axes is not None:
        for name in odd:
            told = f"the topology has no axis for {quoted(name)}; its columns are {one_of(columns)}"
            faults.add(FILE, 1, name, told)
    names = recorded_columns(table, [*required, *odd], faults, allowed.suffixes, allowed.plain_columns)

    good: Mask = np.ones(len(table), dtype=np.bool_)
    readings: dict[str, Numbers] = {}
    for name in [*columns, *(odd if axes is None else ())]:
        if name in table.columns:
            readings[name] = numbers(table, name, faults)
            good &= readings[name].good & _within(
                table, name, readings[name], columns.get(name), strokes, faults
            )
    channels = {name: numbers(table, name, faults, may_be_empty=True) for name in names}
    for channel in channels.values():
        good &= channel.good
    for name in allowed.measured_columns:
        if name in table.columns:
            channels[name] = numbers(table, name, faults)
            good &= channels[name].good & _within(table, name, channels[name], None, strokes, faults)
    time = numbers(table, "time_s", faults) if "time_s" in table.columns else None
    sequence = wholes(table, "sequence", faults) if "sequence" in table.columns else None
    for column in (time, sequence):
        if column is not None:
            good &= column.good
    target = np.array(table.columns.get("target", ()), dtype=np.str_)
    if "target" in table.columns:
        good &= _known_targets(table, targets, faults)
    if "run" not in table.columns:
        return None
    run = wholes(table, "run", faults)
    placed = run.good & _known_runs(table, run.values, run.good, runs, faults)
    good &= placed
    if time is not None:
        good &= refuse_disorder(table, run, sequence, time, faults)
    if (
        axes is None
        or time is None
        or sequence is None
        or any(name not in table.columns for name in required)
    ):
        return None

    probings = Probings(
        run.values,
        sequence.values,
        time.values,
        target,
        {axis.name: readings[axis.column].values * axis.unit.factor for axis in axes},
        {name: channel.values for name, channel in channels.items()},
    )
    damaged = _damaged_runs(table, run.values, placed, good)
    if not good.all():
        probings = probings.rows(good)
    return ProbingsPart(probings, np.array(table.lines, dtype=np.int64)[good], frozenset(damaged))


def _within(
    table: CsvTable,
    column: str,
    read: Numbers,
    axis: Axis | None,
    strokes: dict[str, tuple[float, float]],
    faults: Faults,
) -> Mask:
    unit = column.rpartition("_")[2]
    limit = FARTHEST_MM if unit == "mm" else FARTHEST_DEG
    low, high = -limit, limit
    stroke = strokes.get(axis.name) if axis is not None else None
    if stroke is not None:
        low, high = stroke
        what = f"the stroke of axis {column.rpartition('_')[0].upper()}, {low:g} to {high:g} {unit}"
    else:
        what = f"{limit:g} {unit} (no stroke is given); is its unit {unit}?"
    outside = (read.values < low) | (read.values > high)
    for place in np.flatnonzero(outside).tolist():
        shown = table.columns[column][place]
        faults.add(FILE, table.lines[place], column, f"{quoted(shown)} is beyond {what}")
    return ~outside


def _known_targets(table: CsvTable, targets: Sequence[str] | None, faults: Faults) -> Mask:
    cells = table.columns["target"]
    lines: dict[str, list[int]] = {}
    wrong = {
        cell for cell in set(cells) if not _is_name(cell) or (targets is not None and cell not in targets)
    }
    if not wrong:
        return np.ones(len(cells), dtype=np.bool_)
    for line, cell in zip(table.lines, cells, strict=True):
        if cell in wrong:
            lines.setdefault(cell, []).append(line)
    for cell, at in lines.items():
        if not _is_name(cell):
            told = f"{quoted(cell)} is not a name; name what was probed"
        else:
            told = f"there is no target {quoted(cell)}; the targets are {one_of(targets or ())}"
        faults.add(FILE, at[0], "target", told + _and_more(at))
    return np.array([cell not in wrong for cell in cells], dtype=np.bool_)


def _known_runs(
    table: CsvTable,
    values: npt.NDArray[np.int64],
    good: Mask,
    runs: dict[int, int] | None,
    faults: Faults,
) -> Mask:
    if runs is None:
        return good
    known = np.isin(values, np.fromiter(runs, dtype=np.int64, count=len(runs)))
    unknown: dict[int, list[int]] = {}
    for place in np.flatnonzero(good & ~known).tolist():
        unknown.setdefault(int(values[place]), []).append(table.lines[place])
    for run, at in unknown.items():
        told = f"run {run} is not listed in runs.csv; list it there, or correct the number{_and_more(at)}"
        faults.add(FILE, at[0], "run", told)
    probed = set(values[good].tolist()) | _runs_of(table)
    for run, line in runs.items():
        if run not in probed:
            told = f"run {run} has no row in {FILE}; remove the run, or add its probings"
            faults.add("runs.csv", line, "run", told)
    return known


def _runs_of(table: CsvTable) -> set[int]:
    """The runs of rows with a wrong number of cells; -1 where the cell cannot be made out."""
    place = list(table.columns).index("run")
    cells = [row[place] if len(row) > place else "" for row in table.damaged]
    return {int(cell) if re.fullmatch(r"[0-9]{1,10}", cell) else -1 for cell in cells}


def _damaged_runs(table: CsvTable, runs: npt.NDArray[np.int64], placed: Mask, good: Mask) -> set[int]:
    """Runs that a faulty row belongs to, or may belong to: a missing ball there may be that row."""
    damaged = set(runs[~good].tolist()) | _runs_of(table)
    if -1 in _runs_of(table):
        return damaged | set(runs.tolist())
    lost = np.flatnonzero(~placed)
    around = np.concatenate([lost - 1, lost + 1])
    return damaged | set(runs[around[(around >= 0) & (around < len(runs))]].tolist())


def _is_name(cell: str) -> bool:
    return bool(cell) and cell.isprintable() and cell == cell.strip() and len(cell) <= 200


def _and_more(lines: Sequence[int]) -> str:
    return f" (and on {len(lines) - 1} more lines, to line {lines[-1]})" if len(lines) > 1 else ""
