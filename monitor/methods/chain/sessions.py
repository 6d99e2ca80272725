"""Own unknowns that stay for a session: the runs of a campaign are measured with one bar, whose length is one number.

The solver knows unknowns of a run and unknowns of all runs. An unknown that stays is one of the latter, and what is
known of it beforehand counts once. Its column is first freed of what the other unknowns of each run do alike (a bar's
length and all gains together), or its rank would be judged by that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from monitor.methods.chain.least_squares import (
    MEMBER_SHARE,
    Linearisation,
    Solution,
    eliminate,
    project_out,
    solve,
)
from monitor.records import Array


@dataclass(frozen=True)
class Stays:
    """Which unknowns stay: ``columns`` (t,) among those of a run (p,), and ``rows`` (t,) of what is known of them,
    counted among the calibrated quantities of a run."""

    columns: npt.NDArray[np.int64]
    rows: npt.NDArray[np.int64]

    def as_common(self, at: Linearisation, calibrated: int) -> Linearisation:
        """Derivatives with the columns that stay among the common ones, behind these.

        ``calibrated`` are the last rows of each run; what is known of an unknown that stays weighs in each run by the
        part that makes it count once.
        """
        residual, local = at.residual.copy(), at.local.copy()
        share = 1.0 / np.sqrt(len(residual))
        rows = residual.shape[1] - calibrated + self.rows
        residual[:, rows] *= share
        local[:, rows] *= share
        columns = local[:, :, self.columns]
        local[:, :, self.columns] = 0.0
        return Linearisation(residual, local, np.concatenate([at.common, columns], axis=2))


@dataclass(frozen=True)
class KnownFromOthers:
    """What the calibration and the other runs say of unknowns of one run: they are ``values`` (t,), with
    the inverse covariance ``root.T @ root``; ``columns`` (t,) and ``rows`` (t,) as in ``Stays``."""

    columns: npt.NDArray[np.int64]
    rows: npt.NDArray[np.int64]
    values: Array
    root: Array


def solve_sessions(
    linearise: Callable[[Array, Array], Linearisation],
    stays: Stays,
    calibrated: int,
    local: Array,
    common: Array,
    most: int,
) -> Solution:
    """As ``solve``, with unknowns that stay. ``last`` has them among its common columns, behind the others."""
    count, at_start = len(common), local[:, stays.columns].mean(axis=0)
    begin = local.copy()
    begin[:, stays.columns] = at_start
    first = stays.as_common(linearise(begin, common), calibrated)
    space = eliminate(first.local)
    # (R, p, t): how the other unknowns of a run answer those that stay, so that little of the readings changes.
    answer = -space.inverse @ (np.swapaxes(space.basis, 1, 2) @ first.common[:, :, count:])

    def whole(of_runs: Array, shared: Array) -> Array:
        unknowns = of_runs + answer @ (shared[count:] - at_start)
        unknowns[:, stays.columns] = shared[count:]
        return np.asarray(unknowns)

    def freed(of_runs: Array, shared: Array) -> Linearisation:
        at = stays.as_common(linearise(whole(of_runs, shared), shared[:count]), calibrated)
        columns = at.common.copy()
        columns[:, :, count:] += at.local @ answer
        return replace(at, common=columns)

    solution = solve(freed, begin, np.concatenate([common, at_start]), most)
    at_end = whole(solution.local, solution.common)
    last = stays.as_common(linearise(at_end, solution.common[:count]), calibrated)
    return _restored(replace(solution, local=at_end, last=last), stays, count)


def _restored(solution: Solution, stays: Stays, count: int) -> Solution:
    """The solution with the unknowns that stay among those of every run again."""
    runs, unknowns = solution.local.shape
    others = np.setdiff1d(np.arange(unknowns), stays.columns)
    space = eliminate(solution.last.local[:, :, others])
    # An unknown that stays is the same in every run; all others answer it and the common ones.
    number = count + np.arange(len(stays.columns))
    response = np.zeros((runs, unknowns, len(solution.common)))
    response[:, others] = -space.inverse @ (np.swapaxes(space.basis, 1, 2) @ solution.last.common)
    response[:, stays.columns, number] = 1.0
    covariance = response @ solution.common_covariance @ np.swapaxes(response, 1, 2)
    covariance[:, others[:, None], others] += space.inverse @ np.swapaxes(space.inverse, 1, 2)
    null_space = np.zeros((runs, unknowns, unknowns))
    null_space[:, : len(others), others] = space.null_space
    free = np.abs(null_space).max(axis=1) < MEMBER_SHARE
    free[:, stays.columns] &= solution.common_free[number]
    return replace(
        solution,
        common=solution.common[:count],
        common_covariance=solution.common_covariance[:count, :count],
        common_free=solution.common_free[:count],
        local_covariance=covariance,
        local_free=free,
        null_space=null_space,
        rank=solution.rank + len(stays.columns),
    )


def known_from_others(solution: Solution, stays: Stays, index: int, calibrated: int) -> KnownFromOthers:
    """What a run has from outside: with it the run by itself has the solution and, the common unknowns held, the
    uncertainty that it has beside the others. ``calibrated`` as in ``as_common``."""
    last = solution.last
    # What the other unknowns of each run leave of the columns that stay.
    remainder = project_out(eliminate(last.local).basis, last.common[:, :, len(solution.common) :])
    of_readings = remainder[index].copy()
    of_readings[last.residual.shape[1] - calibrated + stays.rows] = 0.0
    flat = remainder.reshape(-1, len(stays.columns))
    information = flat.T @ flat - of_readings.T @ of_readings
    # At the solution what this run's readings pull is what the others hold.
    pull = of_readings.T @ last.residual[index]
    values = solution.local[index, stays.columns] + np.linalg.solve(information, pull)
    return KnownFromOthers(stays.columns, stays.rows, values, np.linalg.cholesky(information).T)
