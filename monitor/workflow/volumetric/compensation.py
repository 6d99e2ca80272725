"""Compensation tables from a volumetric map, as plain CSV; a controller's own format is made from them.

``positioning-csv``: one file with a table for every linear axis, along the line through the datum with the rotary
axes at zero: the positioning error of the axis itself (its EXX and what was added to it) as a function of its
reading. ``volumetric-csv``: the error of the tip relative to the workpiece at every point of the map. Errors are
actual less commanded; the correction, to be added to the commanded reading, is the negative. No controller's own
format is written: none could be tried on a controller.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from monitor.effects import ChainEffect
from monitor.machine import MOTION
from monitor.records import Array
from monitor.uncertainty.volumetric import middle, volumetric_error
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.figure_files import make_folder
from monitor.workflow.volumetric.error_map import VolumetricMap

Row = list[Any]
# Compensation points along an axis; straight lines between them leave 1/4000 of a quadratic error of the stroke.
TABLE_POINTS = 33


def write_tables(mapped: VolumetricMap, form: str, folder: Path) -> tuple[str, ...]:
    """Write the tables of a format; the names of the files."""
    make_folder(folder)
    evaluated = mapped.evaluated
    name = f"{evaluated.campaign.name}-run-{evaluated.run}-{form.removesuffix('-csv')}.csv"
    rows = _positioning(mapped) if form == "positioning-csv" else _volumetric(mapped)
    path = folder / name
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
    return (str(path),)


def _number(value: float, digits: int = 4) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"


def _along(mapped: VolumetricMap, axis: int) -> tuple[Array, Array, Array]:
    """Readings (n,) of the linear axis at an index of the chain, its positioning error along itself, its u; mm."""
    errors = mapped.errors
    joint = errors.chain.joints[axis]
    readings = np.linspace(*mapped.ranges[joint.name], TABLE_POINTS)
    positions = np.tile(middle(errors.chain, mapped.ranges), (TABLE_POINTS, 1))
    positions[:, axis] = joint.sign * readings
    of_axis = np.array(
        [
            _is_positioning(mapped, effect, axis)
            for effect in errors.effects
            for _ in effect.parameters(errors.context)
        ]
    )
    only = volumetric_error(errors, positions, None, np.where(of_axis, errors.estimate, 0.0))
    # An error of the carriage moves the tip with the tool, against it with the workpiece; in readings it is the same.
    direction = np.array(joint.direction) * joint.sign * (1.0 if joint.branch == "tool" else -1.0)
    slopes = np.einsum("nik,i->nk", only.sensitivity[:, :, of_axis], direction)
    covariance = errors.covariance[np.ix_(of_axis, of_axis)]
    return readings, only.vectors @ direction, np.sqrt(np.einsum("nk,kl,nl->n", slopes, covariance, slopes))


def _is_positioning(mapped: VolumetricMap, effect: ChainEffect, axis: int) -> bool:
    """Whether an effect is a positioning error of the axis at an index of the chain."""
    term = effect.term
    return (term.joint, term.stage, term.component) == (axis, MOTION, mapped.errors.chain.joints[axis].main)


def _positioning(mapped: VolumetricMap) -> Iterator[Row]:
    yield ["axis", "reading_mm", "error_um", "correction_um", "u_um"]
    um = MICROMETRE.factor
    for axis, joint in enumerate(mapped.errors.chain.joints):
        if joint.turns or not any(_is_positioning(mapped, effect, axis) for effect in mapped.errors.effects):
            continue
        for reading, error, u in zip(*_along(mapped, axis), strict=True):
            yield [joint.name, _number(reading), _number(error / um), _number(-error / um), _number(u / um)]


def _volumetric(mapped: VolumetricMap) -> Iterator[Row]:
    chain, error, um = mapped.errors.chain, mapped.error, MICROMETRE.factor
    shown = [index for index, joint in enumerate(chain.joints) if joint.kind != "spindle"]
    yield [
        *(f"{chain.joints[i].name.lower()}_{'deg' if chain.joints[i].turns else 'mm'}" for i in shown),
        *(f"error_{axis}_um" for axis in "xyz"),
        *(f"correction_{axis}_um" for axis in "xyz"),
        *(f"u_{axis}_um" for axis in "xyz"),
    ]
    u = np.sqrt(np.maximum(np.diagonal(error.covariance, axis1=1, axis2=2), 0.0))
    for position, vector, u_vector in zip(error.positions, error.vectors, u, strict=True):
        readings = [
            chain.joints[i].sign
            * (DEGREE.to_display(float(position[i])) if chain.joints[i].turns else float(position[i]))
            for i in shown
        ]
        yield [*map(_number, readings), *(_number(v / um) for v in (*vector, *-vector, *u_vector))]
