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
from monitor.exceptions import InputError
from monitor.machine import MOTION
from monitor.records import Array
from monitor.uncertainty.volumetric import middle, volumetric_error
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.figure_files import make_folder
from monitor.workflow.volumetric.volumetric import Mapped

Row = list[Any]
FORMATS = ("positioning-csv", "volumetric-csv")
# Compensation points along an axis; straight lines between them leave 1/4000 of a quadratic error of the stroke.
TABLE_POINTS = 33


def write_tables(mapped: Mapped, form: str, folder: Path) -> list[str]:
    """Write the tables of a format; the names of the files. Raises InputError for a format that there is not."""
    if form not in FORMATS:
        raise InputError(f"--compensation {form}: there are {' and '.join(FORMATS)}")
    make_folder(folder)
    document = mapped.evaluated
    name = f"{document.campaign.name}-run-{document.run}-{form.removesuffix('-csv')}.csv"
    rows = _positioning(mapped) if form == "positioning-csv" else _volumetric(mapped)
    path = folder / name
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
    return [str(path)]


def _number(value: float, digits: int = 4) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"


def _along(mapped: Mapped, place: int) -> tuple[Array, Array, Array]:
    """Readings (n,) of a linear axis, the error of its own motion along itself and its u, mm."""
    known = mapped.known
    joint = known.chain.joints[place]
    readings = np.linspace(*mapped.ranges[joint.name], TABLE_POINTS)
    positions = np.tile(middle(known.chain, mapped.ranges), (TABLE_POINTS, 1))
    positions[:, place] = joint.sign * readings
    component = joint.main
    chosen = [
        effect.term.joint == place and effect.term.stage == MOTION and effect.term.component == component
        for effect in known.effects
        for _ in effect.parameters(known.context)
    ]
    mine = np.array(chosen)
    only = volumetric_error(known, positions, None, np.where(mine, known.estimate, 0.0))
    # An error of the carriage moves the tip with the tool, against it with the workpiece; in readings it is the same.
    axis = np.array(joint.direction) * joint.sign * (1.0 if joint.branch == "tool" else -1.0)
    slopes = np.einsum("nik,i->nk", only.sensitivity[:, :, mine], axis)
    covariance = known.covariance[np.ix_(mine, mine)]
    return readings, only.vectors @ axis, np.sqrt(np.einsum("nk,kl,nl->n", slopes, covariance, slopes))


def _positioning(mapped: Mapped) -> Iterator[Row]:
    yield ["axis", "reading_mm", "error_um", "correction_um", "u_um"]
    um = MICROMETRE.factor
    for place, joint in enumerate(mapped.known.chain.joints):
        if joint.turns or not _has_own(mapped, place):
            continue
        for reading, error, u in zip(*_along(mapped, place), strict=True):
            yield [joint.name, _number(reading), _number(error / um), _number(-error / um), _number(u / um)]


def _has_own(mapped: Mapped, place: int) -> bool:
    component = mapped.known.chain.joints[place].main
    return any(
        isinstance(effect, ChainEffect)
        and (effect.term.joint, effect.term.stage, effect.term.component) == (place, MOTION, component)
        for effect in mapped.known.effects
    )


def _volumetric(mapped: Mapped) -> Iterator[Row]:
    chain, error, um = mapped.known.chain, mapped.error, MICROMETRE.factor
    shown = [place for place, joint in enumerate(chain.joints) if joint.kind != "spindle"]
    yield [
        *(f"{chain.joints[i].name.lower()}_{'deg' if chain.joints[i].turns else 'mm'}" for i in shown),
        *(f"error_{axis}_um" for axis in "xyz"),
        *(f"correction_{axis}_um" for axis in "xyz"),
        *(f"u_{axis}_um" for axis in "xyz"),
    ]
    u = np.sqrt(np.maximum(np.diagonal(error.covariance, axis1=1, axis2=2), 0.0))
    for position, vector, own in zip(error.positions, error.vectors, u, strict=True):
        where = [
            chain.joints[i].sign
            * (DEGREE.to_display(float(position[i])) if chain.joints[i].turns else float(position[i]))
            for i in shown
        ]
        yield [*map(_number, where), *(_number(v / um) for v in (*vector, *-vector, *own))]
