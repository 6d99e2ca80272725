"""What was understood of the rows of a campaign, for people to look at before anything is stored."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from monitor.readers.axes import axes_of_machine
from monitor.records import Array, Campaign

#: Positions closer than this are one target, in mm or degrees.
_SAME = 1e-3
#: Cells of the first and last row that are repeated to people.
_LONGEST = 60


@dataclass(frozen=True)
class UnderstoodColumn:
    """One column of a campaign: where it comes from (``source``, with the unit there), and what it holds.

    ``smallest``, ``largest`` are in the unit that the name of the column ends in; None where it holds names. ``moves``
    says which way an axis went.
    """

    column: str
    source: str
    smallest: float | None
    largest: float | None
    first: str
    last: str
    moves: str | None = None


@dataclass(frozen=True)
class UnderstoodFile:
    """One file: its hash, its format and how it is written, the setup and run of its rows, and their columns."""

    file: str
    sha256: str
    format: str
    layout: str
    setup: str | None
    run: int | None
    rows: int
    started: str | None
    facts: tuple[str, ...]
    columns: tuple[UnderstoodColumn, ...]


def column_of(name: str, source: str, cells: Sequence[str], *, is_axis: bool) -> UnderstoodColumn:
    """Return what a column holds."""
    values = np.array([_number(cell) for cell in cells])
    numeric = values[np.isfinite(values)]
    has_numbers = len(numeric) > 0 and name not in ("target", "setup")
    return UnderstoodColumn(
        name,
        source,
        float(numeric.min()) if has_numbers else None,
        float(numeric.max()) if has_numbers else None,
        cells[0][:_LONGEST] if cells else "",
        cells[-1][:_LONGEST] if cells else "",
        _moves(values) if is_axis and has_numbers else None,
    )


def _moves(values: Array) -> str:
    """Say which way an axis went: how many positions, how often up and down."""
    steps = np.diff(values)
    steps = steps[np.abs(steps) > _SAME]
    positions = len(np.unique(np.round(values / _SAME)))
    if not len(steps):
        return "stands still"
    sweeps = np.sign(steps)[np.concatenate([[True], np.diff(np.sign(steps)) != 0.0])]
    up, down = int(np.sum(sweeps > 0)), int(np.sum(sweeps < 0))
    return f"{positions} positions, {_times(up)} up, {_times(down)} down"


def _times(count: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(count, f"{count} times")


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def columns_of(
    cells: Mapping[str, Sequence[str]], sources: Mapping[str, str], axes: Sequence[str]
) -> tuple[UnderstoodColumn, ...]:
    """Return what every column of a file holds."""
    return tuple(
        column_of(name, sources[name], values, is_axis=name in axes) for name, values in cells.items()
    )


def understood_tables(campaign: Campaign) -> tuple[UnderstoodFile, ...]:
    """Return what was understood of the readings of a campaign folder, in the units of its file."""
    probings = campaign.probings
    axes = {
        axis.column: probings.readings[axis.name] / axis.unit.factor
        for axis in axes_of_machine(campaign.machine)
    }
    numbers = {**axes, **probings.channels}
    cells: dict[str, Sequence[str]] = {
        name: [f"{value:.10g}" for value in values.tolist()]
        for name, values in numbers.items()
        if name != "setup"
    }
    cells["target"] = probings.target.tolist()
    sources = {name: f"column {name}" for name in cells}
    file = next((file for file in campaign.files if file.name.startswith("probings")), campaign.files[-1])
    return (
        UnderstoodFile(
            file.name, file.sha256, "campaign folder, format 1", "", None, None, len(probings), None, (),
            columns_of(cells, sources, list(axes)),
        ),
    )  # fmt: skip
