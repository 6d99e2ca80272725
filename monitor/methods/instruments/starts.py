"""Where the search for the zeros of instruments begins: where a machine without errors would read what was read.

What the setups cannot separate is held where the search begins. A zero that begins hundreds of millimetres off (a laser
that counts from the first row, a dial on a square) would have to be made up by what is held with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.machine import Orientation, evaluate
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import Stance
from monitor.records import Array

ZERO = "zero"


def stance_of(r: Array, sides: Orientation, at: npt.NDArray[np.int64]) -> Stance:
    """How the sides stand at the rows ``at`` (m,) of a setup, for vectors ``r`` (m, 3) mm."""
    work, tool = sides.work[at], sides.tool[at]
    return Stance(r, np.swapaxes(work, 1, 2) @ tool, work, tool)


def with_zeros(
    parts: Sequence[Part], own_columns: Sequence[npt.NDArray[np.int64]], start: Array, nominal: Orientation
) -> Array:
    """The first guesses (R, q) with the zero of every setup where its readings put it, run by run; ``nominal`` are the
    sides of a machine without errors at all rows."""
    begin = start.copy()
    for part, columns in zip(parts, own_columns, strict=True):
        if ZERO not in part.reading.unknowns:
            continue
        zero, rows = part.reading.unknowns.index(ZERO), part.rows
        values = start[rows.run][:, columns]
        work, tool = part.reading.ends(values, rows)
        none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
        stance = stance_of(evaluate(rows.chain, rows.positions, none, work, tool).residual, nominal, part.at)
        shown = part.reading.shown(replace(stance, nominal=stance), values, rows)
        assert shown.by_own is not None
        # A reading is linear in its zero.
        off = -shown.residual[:, 0] / shown.by_own[:, 0, zero]
        for run in np.unique(rows.run):
            begin[run, columns[zero]] += float(np.nanmean(off[rows.run == run]))
    return begin
