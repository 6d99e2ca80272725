"""The gradient of the sum of squares for many trials at once, from an expansion of the rows to second order.

Near its least-squares point a whitened row is r0 + J d + d' Q d / 2, to third order in d. The errors of a machine are
some 1e-5 rad, so what is left out is some 1e-13 mm where Q itself moves 1e-8 mm; ``sensitivity`` compares with the
exact gradient before it is used. Most rows depend on few of the unknowns, and those that depend on the same ones are
computed together, as products of matrices. Unknowns that never meet in a row share the differences from which Q is
made, so that hundreds of points cost no more than a few.

A problem may leave products of errors out of the derivatives that it gives (a bar's across its plane): then the slope
of a row is another one than the derivative of its number, and both are expanded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.uncertainty.runs.row_run import RowRun

#: The unknowns are moved by so many steps of the sensitivity (3 µm at the tip): 0.1 mm. The fourth order is below 1e-6
#: of the second there, and the rounding of a double below 1e-11 of it.
_STEPS = 30.0
#: Trials that are computed together: what a setup of 150 rows and 12 unknowns needs stays in the cache.
_TRIALS = 256
#: A derivative below this part of its column's largest is none.
_NOTHING = 1e-13


@dataclass(frozen=True)
class _Group:
    """The n ``rows`` that depend on the same a unknowns ``at``: ``residual`` (n,), ``jacobian`` (n, a), ``bend`` (n, k)
    by the products ``first`` times ``second`` (k,) of two unknowns; ``slope`` (n, a) and ``turn`` (n, a, a) are what
    counts as the derivative of a row and that by the unknowns. Without ``bend`` the rows are straight."""

    rows: npt.NDArray[np.int64]
    at: npt.NDArray[np.int64]
    residual: Array
    jacobian: Array
    slope: Array
    first: npt.NDArray[np.int64]
    second: npt.NDArray[np.int64]
    bend: Array
    turn: Array

    def gradient(self, moved: Array, added: Array) -> Array:
        """What the rows give to their unknowns (a, B), moved by (a, B) and with (n, B) added to their numbers."""
        residual = self.jacobian @ moved
        residual += added
        residual += self.residual[:, None]
        if not self.bend.size:
            return np.asarray(self.slope.T @ residual)
        residual += self.bend @ (moved[self.first] * moved[self.second])
        count = len(self.at)
        turned = (self.turn.reshape(len(self.rows), -1).T @ residual).reshape(count, count, -1)
        return np.asarray(self.slope.T @ residual + np.einsum("klb,lb->kb", turned, moved))


@dataclass(frozen=True)
class Expansion:
    """The whitened rows of a ``run`` about the ``centre`` (p,), in ``groups``."""

    run: RowRun
    centre: Array
    groups: tuple[_Group, ...]

    def gradient(self, unknowns: Array, inputs: Array) -> Array:
        """J^T r (p, B), whitened, at ``unknowns`` (p, B) and ``inputs`` (N, B)."""
        expanded = np.zeros(unknowns.shape)
        for first in range(0, unknowns.shape[1], _TRIALS):
            these = slice(first, first + _TRIALS)
            moved = unknowns[:, these] - self.centre[:, None]
            added = self.run.whitened(inputs[:, these])
            for group in self.groups:
                expanded[group.at, these] += group.gradient(moved[group.at], added[group.rows])
        return expanded


def expansion_of(run: RowRun, unknowns: Array, steps: Array) -> Expansion:
    """The expansion of a run about ``unknowns`` (p,); ``steps`` (p,) each move the tip by about 3 µm."""
    moves = _STEPS * steps
    whole = replace(run, problem=run.problem.with_products())
    leaves_out = whole.problem is not run.problem
    residual, slope = (rows[0] for rows in _linearised(run, unknowns[:, None]))
    jacobian = _linearised(whole, unknowns[:, None])[1][0] if leaves_out else slope
    # Which rows an unknown acts on: at the centre, and away from it in all unknowns, lest a derivative be zero there.
    away = _linearised(whole, (unknowns + moves * np.cos(np.arange(len(moves))))[:, None])[1][0]
    size = np.maximum(np.abs(jacobian), np.abs(away))
    acts = size > _NOTHING * size.max(axis=0, initial=0.0)
    acts |= size > _NOTHING * size.max(axis=1, initial=0.0)[:, None]
    acts &= size > 0.0
    colours = _colours(acts)
    bends = _bends(whole, unknowns, moves, acts, colours)
    turns = _bends(run, unknowns, moves, acts, colours) if leaves_out else bends
    reach = np.abs(slope * moves).max(initial=0.0)
    patterns, kinds = np.unique(acts, axis=0, return_inverse=True)
    groups = []
    for number, pattern in enumerate(patterns):
        at, rows = np.flatnonzero(pattern), np.flatnonzero(kinds.reshape(-1) == number)
        within = np.ix_(rows, at, colours[at])
        bend, turn = bends[within], turns[within]
        bend = 0.5 * (bend + np.swapaxes(bend, 1, 2))
        moved = np.abs(moves[at][:, None] * bend * moves[at])
        # A second derivative that moves nothing over the largest step is rounding: such rows are straight.
        if not np.any(moved > 1e-9 * reach):
            bend, turn = np.zeros((2, len(rows), 0, 0))
        first, second = np.triu_indices(bend.shape[1])
        groups.append(
            _Group(
                rows=rows,
                at=at,
                residual=residual[rows],
                jacobian=jacobian[rows][:, at],
                slope=slope[rows][:, at],
                first=first,
                second=second,
                bend=np.ascontiguousarray(bend[:, first, second] * np.where(first == second, 0.5, 1.0)),
                turn=turn if leaves_out else bend,
            )
        )
    return Expansion(run, unknowns.copy(), tuple(groups))


def _bends(
    run: RowRun,
    unknowns: Array,
    moves: Array,
    acts: npt.NDArray[np.bool_],
    colours: npt.NDArray[np.int64],
) -> Array:
    """Derivatives (N, p, c) of the rows' slopes by the unknowns of every colour."""
    bends = np.zeros((*acts.shape, int(colours.max(initial=-1)) + 1))
    for colour in range(bends.shape[2]):
        mine = colours == colour
        move = np.where(mine, moves, 0.0)
        both = _linearised(run, np.column_stack([unknowns + move, unknowns - move]))[1]
        # In every row at most one unknown of the colour acts: its step is the one that counts.
        step = np.where(acts & mine, moves, 0.0).sum(axis=1)
        bends[:, :, colour] = (both[0] - both[1]) / np.where(step > 0.0, 2.0 * step, 1.0)[:, None]
    return bends


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
