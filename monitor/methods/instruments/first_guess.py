"""Where the search for the unknowns of a setup begins: zeros and slopes as a machine without errors leaves them.

What the readings cannot separate stays where the search begins. A straightedge that stands 0.2 m from where its setup
says leaves a zero of 0.2 m; begun at nothing, the angle of an axis that no reading tells from it went by 25 mrad, and
the gain of that axis by 400 um/m.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.machine import Orientation, evaluate
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import Stance
from monitor.records import Array

#: Unknowns in which readings are linear and of which nothing is known beforehand.
LINES = frozenset({"zero", "slope"})


def guess_with_lines(part: Part, runs: int, nominal: Orientation) -> Array:
    """The first guess (R, q) of the unknowns of a setup; ``nominal`` is how the sides of a machine without errors stand
    at all rows."""
    guess = part.start(runs)
    lines = [index for index, name in enumerate(part.unknowns) if name in LINES]
    if not lines:
        return guess
    rows, values = part.rows, guess[part.rows.run]
    none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
    pose = evaluate(rows.chain, rows.positions, none, *part.reading.ends(values, rows))
    stance = stance_at(pose.residual, nominal, part.at)
    shown = part.shown(replace(stance, nominal=stance), values)
    assert shown.by_own is not None
    for run in np.unique(rows.run):
        of_run = rows.run == run
        residual, slopes = shown.residual[of_run], shown.by_own[of_run][..., lines]
        read = np.isfinite(residual)
        guess[run, lines] -= np.linalg.lstsq(slopes[read], residual[read], rcond=None)[0]
    return guess


def stance_at(r: Array, sides: Orientation, at: npt.NDArray[np.int64]) -> Stance:
    """How the sides stand at the rows of a setup, for vectors (m, 3) mm from work point to tool point."""
    work, tool = sides.work[at], sides.tool[at]
    return Stance(r, np.swapaxes(work, 1, 2) @ tool, work, tool)
