"""Compensation tables from a volumetric map, as plain CSV; a controller's own format is made from them.

``positioning-csv``: a table for every axis with a positioning error of its own (EXX, ECC and what was added to them),
along the line through the middle of the strokes with the rotary axes at zero; rotary axes in a file of their own.
``volumetric-csv``: the error of the tip relative to the workpiece at every point of the map, and the corrections of
the linear axes' readings that cancel it. A correction is always of a reading as the control shows it; the lines
before the columns' names say what is added to what. No controller's own format is written: none could be tried on a
controller.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from monitor.effects.shape import DescribedShape
from monitor.exceptions import InputError
from monitor.machine import Joint
from monitor.records import Array
from monitor.uncertainty.reading_corrections import (
    PositioningError,
    parts_along,
    positioning_error,
    positions_itself,
    reading_corrections,
)
from monitor.uncertainty.volumetric import middle
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN
from monitor.workflow.figure_files import make_folder
from monitor.workflow.volumetric.compensation_header import positioning_header, volumetric_header
from monitor.workflow.volumetric.error_map import VolumetricMap

Row = list[Any]
#: Compensation points along an axis at first; straight lines between them leave 1/4000 of a quadratic error of the
#: stroke.
TABLE_POINTS = 33
#: They are doubled until straight lines leave less than this part of the largest error of the axis (or LEAST_LEFT, mm
#: and rad, below what any control interpolates), at most to MOST_POINTS: a period of 2 mm over a stroke of 500 mm.
PART_LEFT = 0.005
LEAST_LEFT = 1e-5
MOST_POINTS = 4097
#: An error that jumps has a row so far before and after it (mm, rad): ten last digits of the table. Where it bends
#: there is a row.
BESIDE = 1e-3


def write_tables(mapped: VolumetricMap, form: str, folder: Path) -> tuple[str, ...]:
    """Write the tables of a format; the names of the files.

    Raises InputError where the model has no positioning error of any axis to write.
    """
    if form == "positioning-csv":
        written = _positioning(mapped)
    else:
        written = {"volumetric": (volumetric_header(mapped), list(_volumetric(mapped)))}
    make_folder(folder)
    evaluated = mapped.evaluated
    paths = []
    for name, (header, rows) in written.items():
        path = folder / f"{evaluated.campaign.name}-run-{evaluated.run}-{name}.csv"
        with path.open("w", encoding="utf-8", newline="") as file:
            file.writelines(f"# {line}\n" for line in header)
            csv.writer(file, lineterminator="\n").writerows(rows)
        paths.append(str(path))
    return tuple(paths)


def _number(value: float, digits: int = 4) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"


def _numbers(values: Iterable[float]) -> list[str]:
    return [_number(value) for value in values]


@dataclass(frozen=True)
class _Line:
    """Readings (n,) of an axis, mm or rad, with its ``error`` there, what straight lines between them leave at most
    (``remaining``), and the readings ``jumps`` (m,) that have a row on either side."""

    readings: Array
    error: PositioningError
    remaining: float
    jumps: Array


def _breaks(mapped: VolumetricMap, axis: int, low: float, high: float) -> tuple[Array, Array]:
    """The readings at which the error of an axis along itself jumps (m,), and those at which it bends (b,); none where
    they are too many for rows of their own."""
    parts = parts_along(mapped.errors, axis)
    effects = [effect for effect, part in zip(mapped.errors.effects, parts, strict=True) if part]
    shapes = [effect.shape for effect in effects if isinstance(effect.shape, DescribedShape)]
    jumps = np.unique(np.concatenate([np.zeros(0), *(shape.jumps(low, high) for shape in shapes)]))
    kinks = np.unique(np.concatenate([np.zeros(0), *(shape.kinks(low, high) for shape in shapes)]))
    if 2 * len(jumps) + len(kinks) > MOST_POINTS - TABLE_POINTS:
        return np.zeros(0), np.zeros(0)
    return jumps, kinks


def _nodes(low: float, high: float, count: int, jumps: Array, kinks: Array) -> Array:
    """So many readings evenly from ``low`` to ``high``, two beside every jump, and every kink."""
    even = np.linspace(low, high, count)
    broken = np.concatenate([jumps, kinks])
    apart = np.abs(even[:, None] - broken).min(axis=1, initial=np.inf) > BESIDE
    beside = np.concatenate([jumps - BESIDE, jumps + BESIDE])
    return np.unique(np.concatenate([even[apart], np.clip(beside, low, high), kinks]))


def _along(mapped: VolumetricMap, axis: int) -> _Line:
    """The table of the axis at an index: rows enough for straight lines between them."""
    chain = mapped.errors.chain
    joint = chain.joints[axis]
    visited = joint.sign * mapped.errors.context.positions[:, axis]
    low, high = (visited.min(), visited.max()) if joint.turns else mapped.ranges[joint.name]
    jumps, kinks = _breaks(mapped, axis, low, high)
    count = TABLE_POINTS
    while True:
        nodes = _nodes(low, high, count, jumps, kinks)
        middles = (nodes[:-1] + nodes[1:]) / 2.0
        readings = np.concatenate([nodes, middles])
        positions = np.tile(middle(chain, mapped.ranges), (len(readings), 1))
        positions[:, axis] = joint.sign * readings
        error = positioning_error(mapped.errors, axis, positions)
        at_nodes, at_middles = np.split(error.errors, [len(nodes)])
        # Between the two rows of a jump lies the jump.
        followed = np.abs(middles[:, None] - jumps).min(axis=1, initial=np.inf) > BESIDE
        lines = (at_nodes[:-1] + at_nodes[1:]) / 2.0
        remaining = float(np.abs(at_middles - lines)[followed].max())
        if remaining <= max(PART_LEFT * np.abs(error.errors).max(), LEAST_LEFT) or count >= MOST_POINTS:
            return _Line(nodes, PositioningError(at_nodes, error.u[: len(nodes)]), remaining, jumps)
        count = 2 * count - 1


def _positioning(mapped: VolumetricMap) -> dict[str, tuple[Sequence[str], list[Row]]]:
    """The tables of the linear and of the rotary axes that have a positioning error, by the names of their files."""
    joints = mapped.errors.chain.joints
    measured = [
        axis
        for axis, joint in enumerate(joints)
        if joint.kind != "spindle" and positions_itself(mapped.errors, axis)
    ]
    if not measured:
        raise InputError(
            f"--compensation positioning-csv: no positioning error of an axis is known from run {mapped.evaluated.run} "
            f"with model {mapped.evaluated.model.name}; volumetric-csv writes what the known errors do at the tool"
        )
    tables: dict[str, tuple[Sequence[str], list[Row]]] = {}
    for name, turns in (("positioning", False), ("positioning-rotary", True)):
        axes = [axis for axis in measured if joints[axis].turns == turns]
        if axes:
            along = {axis: _along(mapped, axis) for axis in axes}
            header = positioning_header(
                mapped,
                {axis: line.remaining for axis, line in along.items()},
                {axis: len(line.jumps) for axis, line in along.items() if len(line.jumps)},
                turns,
            )
            rows = [
                row
                for axis, line in along.items()
                for row in _axis_rows(joints[axis], line.readings, line.error)
            ]
            columns = (
                ["axis", "reading_deg", "error_urad", "correction_urad", "correction_deg", "u_urad"]
                if turns
                else ["axis", "reading_mm", "error_um", "correction_um", "u_um"]
            )
            tables[name] = (header, [columns, *rows])
    return tables


def _axis_rows(joint: Joint, readings: Array, error: PositioningError) -> Iterator[Row]:
    unit = MICRORADIAN if joint.turns else MICROMETRE
    for reading, size, u in zip(readings, error.errors, error.u, strict=True):
        shown = unit.to_display(float(size))
        yield [
            joint.name,
            _number(DEGREE.to_display(float(reading)) if joint.turns else reading),
            *_numbers((shown, -shown)),
            *([_number(DEGREE.to_display(-float(size)), 8)] if joint.turns else []),
            _number(unit.to_display(float(u))),
        ]


def _volumetric(mapped: VolumetricMap) -> Iterator[Row]:
    chain, error, um = mapped.errors.chain, mapped.error, MICROMETRE.factor
    corrected = reading_corrections(mapped.errors, error)
    shown = [index for index, joint in enumerate(chain.joints) if joint.kind != "spindle"]
    linear = [chain.joints[index].name.lower() for index in corrected.joints]
    yield [
        *(f"{chain.joints[i].name.lower()}_{'deg' if chain.joints[i].turns else 'mm'}" for i in shown),
        *(f"error_{axis}_um" for axis in "xyz"),
        *(f"correction_{axis}_um" for axis in linear),
        *(f"u_{axis}_um" for axis in "xyz"),
        *(f"u_correction_{axis}_um" for axis in linear),
        "not_corrected_um",
    ]
    u = np.sqrt(np.maximum(np.diagonal(error.covariance, axis1=1, axis2=2), 0.0))
    uncorrected = np.linalg.norm(corrected.uncorrected, axis=1)
    for row, position in enumerate(error.positions):
        readings = [
            chain.joints[i].sign
            * (DEGREE.to_display(float(position[i])) if chain.joints[i].turns else float(position[i]))
            for i in shown
        ]
        yield [
            *_numbers(readings),
            *_numbers(
                np.concatenate(
                    [
                        error.vectors[row],
                        corrected.corrections[row],
                        u[row],
                        corrected.u[row],
                        uncorrected[row : row + 1],
                    ]
                )
                / um
            ),
        ]
