"""Where the search for the unknowns of a setup begins: zeros, slopes, spheres as a machine without errors leaves them.

What the readings cannot separate stays where the search begins. A straightedge that stands 0.2 m from where its setup
says leaves a zero of 0.2 m; begun at nothing, the angle of an axis that no reading tells from it went by 25 mrad, and
the gain of that axis by 400 um/m. A sphere on a turning table that its file states nowhere, 80 mm from the axis, was
found half way, the gains of X and Y by 0.5 mm/mm in its stead, and a tilt of the table wrong by 24 u.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.machine import Orientation, evaluate
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import Shown, Stance
from monitor.methods.instruments.readings.vector import WORK_POINT, VectorReading
from monitor.records import Array

#: Unknowns in which readings are linear and of which nothing is known beforehand.
LINES = frozenset({"zero", "slope"})
#: mm. A sphere that the readings put no further from its stated place begins there: errors of machines are smaller, and
#: a number that no reading separates goes by 0.015 u for each 0.1 mm (``examples/r-test``).
STATED_WITHIN = 0.1


def first_guess(part: Part, runs: int, nominal: Orientation) -> Array:
    """The first guess (R, q) of the unknowns of a setup; ``nominal`` is how the sides of a machine without errors stand
    at all rows."""
    guess = part.start(runs)
    lines = [index for index, name in enumerate(part.unknowns) if name in LINES]
    has_sphere = isinstance(part.reading, VectorReading) and not part.reading.holds("work_point")
    if not lines and not has_sphere:
        return guess
    rows, values = part.rows, guess[part.rows.run]
    none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
    pose = evaluate(rows.chain, rows.positions, none, *part.ends(values))
    stance = stance_at(pose.residual, nominal, part.at)
    shown = part.shown(replace(stance, nominal=stance), values)
    assert shown.by_own is not None
    for run in np.unique(rows.run):
        of_run = rows.run == run
        if has_sphere:
            guess[run, : len(WORK_POINT)] += _sphere(shown, of_run)
            continue
        residual, slopes = shown.residual[of_run], shown.by_own[of_run][..., lines]
        read = np.isfinite(residual)
        guess[run, lines] -= np.linalg.lstsq(slopes[read], residual[read], rcond=None)[0]
    return guess


def _sphere(shown: Shown, of_run: npt.NDArray[np.bool_]) -> Array:
    """How far (3,) mm from where the search begins the readings of a run put a sphere: the median of what each whole
    reading says, nothing where that is within what a file states."""
    assert shown.by_own is not None
    whole = of_run & np.isfinite(shown.residual).all(axis=1)
    if not whole.any():
        return np.zeros(3)
    by_point = shown.by_own[whole][..., : len(WORK_POINT)]
    off = np.median(np.linalg.solve(by_point, -shown.residual[whole][..., None])[..., 0], axis=0)
    return np.asarray(off) if np.linalg.norm(off) > STATED_WITHIN else np.zeros(3)


def stance_at(r: Array, sides: Orientation, at: npt.NDArray[np.int64]) -> Stance:
    """How the sides stand at the rows of a setup, for vectors (m, 3) mm from work point to tool point."""
    work, tool = sides.work[at], sides.tool[at]
    return Stance(r, np.swapaxes(work, 1, 2) @ tool, work, tool)
