"""The gradient of the sum of squares for many trials at once, from an expansion of the rows to second order.

Near its least-squares point a whitened row is r0 + J d + d' Q d / 2, to third order in d. The errors of a machine are
some 1e-5 rad, so what is left out is some 1e-13 mm where Q itself moves 1e-8 mm; ``sensitivity`` compares with the
exact gradient before it is used. Most rows depend on few of the unknowns, and only those are kept. Unknowns that never
meet in a row share the differences from which Q is made, so that hundreds of points cost no more than a few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array
from monitor.uncertainty.runs.row_run import RowRun

#: The unknowns are moved by so many steps of the sensitivity (3 µm at the tip): 0.1 mm. The fourth order is below 1e-6
#: of the second there, and the rounding of a double below 1e-11 of it.
_STEPS = 30.0
#: Trials that are computed together: some 10 MB at 150 rows of 12 unknowns.
_TRIALS = 256
#: A derivative below this part of its column's largest is none.
_NOTHING = 1e-13


@dataclass(frozen=True)
class Expansion:
    """N whitened rows, each with at most a unknowns: ``at`` (N, a) their places, ``residual`` (N,), ``jacobian``
    (N, a), ``hessian`` (N, a, a); ``gather`` (p, N a) sums what the rows give to each unknown. ``centre`` (p,)."""

    run: RowRun
    centre: Array
    at: npt.NDArray[np.int64]
    residual: Array
    jacobian: Array
    hessian: Array
    gather: scipy.sparse.csr_array
    bent: bool

    def gradient(self, unknowns: Array, inputs: Array) -> Array:
        """J^T r (p, B), whitened, at ``unknowns`` (p, B) and ``inputs`` (N, B)."""
        expanded = np.empty(unknowns.shape)
        for first in range(0, unknowns.shape[1], _TRIALS):
            these = slice(first, first + _TRIALS)
            moved = (unknowns[:, these] - self.centre[:, None])[self.at]  # (N, a, B)
            slope = np.broadcast_to(self.jacobian[:, :, None], moved.shape)
            residual = self.residual[:, None] + self.run.whitened(inputs[:, these])
            residual = residual + np.einsum("na,nab->nb", self.jacobian, moved)
            if self.bent:
                change = self.hessian @ moved
                residual = residual + 0.5 * np.sum(moved * change, axis=1)
                slope = slope + change
            products = (slope * residual[:, None]).reshape(self.at.size, -1)
            expanded[:, these] = self.gather @ products
        return expanded


def expansion_of(run: RowRun, unknowns: Array, steps: Array) -> Expansion:
    """The expansion of a run about ``unknowns`` (p,); ``steps`` (p,) each move the tip by about 3 µm."""
    linearised = _linearised(run, unknowns[:, None])
    jacobian = linearised[1][0]
    moves = _STEPS * steps
    # Which rows an unknown acts on: at the centre, and away from it in all unknowns, lest a derivative be zero there.
    away = _linearised(run, (unknowns + moves * np.cos(np.arange(len(moves))))[:, None])[1][0]
    size = np.maximum(np.abs(jacobian), np.abs(away))
    acts = size > _NOTHING * size.max(axis=0, initial=0.0)
    acts |= size > _NOTHING * size.max(axis=1, initial=0.0)[:, None]
    acts &= size > 0.0
    colours = _colours(acts)
    bend = np.zeros(
        (*jacobian.shape, int(colours.max(initial=-1)) + 1)
    )  # derivative of row and unknown by a colour
    for colour in range(bend.shape[2]):
        mine = colours == colour
        move = np.where(mine, moves, 0.0)
        both = _linearised(run, np.column_stack([unknowns + move, unknowns - move]))[1]
        # In every row at most one unknown of the colour acts: its step is the one that counts.
        step = np.where(acts & mine, moves, 0.0).sum(axis=1)
        bend[:, :, colour] = (both[0] - both[1]) / np.where(step > 0.0, 2.0 * step, 1.0)[:, None]
    width = int(acts.sum(axis=1).max(initial=1))
    order = np.argsort(~acts, axis=1, kind="stable")[:, :width]
    largest_acts = np.take_along_axis(acts, order, axis=1)
    rows = np.arange(len(jacobian))[:, None]
    hessian = bend[rows[:, :, None], order[:, :, None], colours[order][:, None, :]]
    hessian = np.where(largest_acts[:, :, None] & largest_acts[:, None, :], hessian, 0.0)
    hessian = 0.5 * (hessian + np.swapaxes(hessian, 1, 2))
    slope = np.where(largest_acts, jacobian[rows, order], 0.0)
    # A second derivative that moves nothing over the largest step is rounding: such rows are straight.
    reach = np.where(largest_acts, moves[order], 0.0)
    bent = bool(
        np.any(np.abs(reach[:, :, None] * hessian * reach[:, None, :]) > 1e-9 * np.abs(slope * reach).max())
    )
    gather = scipy.sparse.csr_array(
        (np.where(largest_acts, 1.0, 0.0).ravel(), (order.ravel(), np.arange(order.size))),
        shape=(len(unknowns), order.size),
    )
    return Expansion(run, unknowns.copy(), order, linearised[0][0], slope, hessian, gather, bent)


def _linearised(run: RowRun, unknowns: Array) -> tuple[Array, Array]:
    """Whitened residuals (B, N) and derivatives (B, N, p) as measured, at unknowns (p, B)."""
    nothing = np.repeat(run.inputs[:, None], unknowns.shape[1], axis=1)
    at = run.repeated(nothing).linearise(np.ascontiguousarray(unknowns.T), run.common)
    return at.residual, at.local


def _colours(acts: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """A colour (p,) for every unknown, such that two that act on the same row differ; those of most rows first."""
    meet = (acts.T.astype(np.float64) @ acts) > 0.0
    colours = np.full(acts.shape[1], -1, dtype=np.int64)
    for unknown in np.argsort(-acts.sum(axis=0), kind="stable"):
        used = set(colours[meet[unknown]].tolist())
        colours[unknown] = next(colour for colour in range(len(colours) + 1) if colour not in used)
    return colours
