"""What each instrument does for each parameter: its part of the variance in the joint fit, and what it says alone.

The joint estimate is C J' r, linear in the whitened readings r, each of variance 1: so the variance of a parameter is
the sum of the squares of its row of C J', and the readings of one instrument have their part of that sum (GUM, 5.1.3).
What an instrument says alone is one Gauss-Newton step from the joint point on its own rows: where instruments disagree
by five times U, a tenth of u beside the fit of its own campaign. What its rows do not separate on the nominal machine
is left out of that step, as in ``InstrumentProblem.linearise``. Where its readings, after that step, scatter more than
it states, their own scatter counts, with its degrees of freedom (JCGM 100:2008, 4.2 and G.4.1); less never makes it
surer. Setups whose ``instrument`` is written the same are one instrument.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.methods.chain.least_squares import MEMBER_SHARE, RANK_TOLERANCE, Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.method import InstrumentShare
from monitor.records import Array

#: Of an unknown that an instrument does not show, its rows have this part of the derivatives, or less, by rounding.
ROUNDING = 1e-7


def shares(problem: ChainProblem, solution: Solution, run: int) -> tuple[tuple[InstrumentShare, ...], Array]:
    """The share of every instrument in a run, and the part (k,) of the variance from what is known beforehand."""
    assert isinstance(problem, InstrumentProblem)
    index = int(np.searchsorted(problem.runs, run))
    # By itself a run has its covariance in the joint fit once it knows what the others say of what they share.
    at = problem.beside_others(solution, run).linearise(solution.local, solution.common)
    jacobian, residual = np.hstack([at.local[index], at.common[index]]), at.residual[index]
    count = len(problem.base_names)
    whole = replace(problem, is_whole=True).linearise(problem.start, problem.common_start)
    nominal = np.hstack([whole.local[index], whole.common[index]])
    inverse = _inverse(jacobian, RANK_TOLERANCE)
    joint = solution.local[index, :count]
    free = solution.local_free[index, :count]
    squares = np.where(free[:, None], inverse[:count] ** 2, np.nan)
    extras = len(residual) - len(problem.extra_names)
    several = len(problem.parts) > 1
    instruments = []
    for name, setups in _instruments(problem).items():
        rows = _whitened_rows(problem, run, setups)
        priors = [
            extras + number
            for number, extra in enumerate(problem.extra_names)
            if not several or any(extra.startswith(f"{setup} ") for setup in setups)
        ]
        mine = np.concatenate([rows, np.array(priors, dtype=np.int64)])
        separated, determined = _separated(nominal[mine], np.linalg.norm(nominal, axis=0))
        by_mine = _inverse(jacobian[mine] @ separated, RANK_TOLERANCE)
        determined = determined[:count] & free
        remaining = residual[mine] - jacobian[mine] @ (separated @ (by_mine @ residual[mine]))
        leverage = np.einsum("mp,pm->m", jacobian[mine] @ separated, by_mine)
        numbers = int(np.count_nonzero(np.any(jacobian[rows] != 0.0, axis=1)))
        of_rows = slice(0, len(rows))
        scatter, freedom = _scatter(remaining[of_rows], numbers - float(leverage[of_rows].sum()))
        by_readings = scatter * np.sum(by_mine[:count, of_rows] ** 2, axis=1)
        variance = by_readings + np.sum(by_mine[:count, len(rows) :] ** 2, axis=1)
        step = -by_mine[:count] @ residual[mine]
        instruments.append(
            InstrumentShare(
                name=name,
                setups=setups,
                numbers=numbers,
                chi_square=float(residual[rows] @ residual[rows]),
                variance=squares[:, rows].sum(axis=1),
                alone=np.where(determined, joint + step, np.nan),
                alone_variance=np.where(determined, variance, np.nan),
                # What is known beforehand has no end of them (Welch and Satterthwaite, JCGM 100:2008, G.2b).
                alone_freedom=freedom * (variance / np.where(by_readings > 0.0, by_readings, np.nan)) ** 2,
            )
        )
    return tuple(instruments), np.asarray(squares[:, extras:].sum(axis=1))


def _scatter(remaining: Array, freedom: float) -> tuple[float, float]:
    """The variance of whitened readings (m,) by themselves and its degrees of freedom; 1, and no end of them, where
    they do not scatter more than stated.

    By chance half of right instruments scatter more, and Student's law is careful with them. With a test beforehand
    (5 %) up to 3 % of right campaigns whose readings scatter 1.3 to 2 times as stated would be called at 0.1 %, without
    it 0.3 % (simulated: two instruments of 5 to 100 degrees of freedom, eleven comparisons).
    """
    square = float(remaining @ remaining)
    if freedom < 1.0 or square <= freedom:
        return 1.0, float("inf")
    return square / freedom, freedom


def _instruments(problem: InstrumentProblem) -> dict[str, tuple[str, ...]]:
    """The setups of each instrument, by its words; by its id where a setup says none."""
    groups: dict[str, tuple[str, ...]] = {}
    for setup in problem.setups:
        name = setup.instrument or setup.id
        groups[name] = (*groups.get(name, ()), setup.id)
    return groups


def _whitened_rows(problem: InstrumentProblem, run: int, setups: tuple[str, ...]) -> npt.NDArray[np.int64]:
    """Where the numbers of setups stand among the whitened residuals of a run."""
    at = np.concatenate([part.at for part in problem.parts if part.id in setups])
    of_run = np.flatnonzero(problem.context.run == run)
    within = np.flatnonzero(np.isin(of_run, at))
    numbers = problem.sigma.shape[1]
    return np.asarray((within[:, None] * numbers + np.arange(numbers)).ravel(), dtype=np.int64)


def _separated(nominal: Array, size: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The projector (p, p) on the unknowns that rows (m, p) separate, and which unknowns (p,) these are; ``size`` (p,)
    is that of the derivatives by all rows, beside which the small ones are rounding."""
    matrix = np.where(np.linalg.norm(nominal, axis=0) < ROUNDING * size, 0.0, nominal)
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    _, strength, vectors = np.linalg.svd(np.linalg.qr(matrix / scale, mode="r"))
    rank = int(np.count_nonzero(strength > RANK_TOLERANCE * strength.max(initial=0.0)))
    left_open = vectors[rank:]
    projector = np.eye(len(scale)) - left_open.T @ left_open
    projector *= np.linalg.norm(projector, axis=0) > ROUNDING
    determined = np.abs(left_open).max(axis=0, initial=0.0) < MEMBER_SHARE
    return projector * scale[None, :] / scale[:, None], determined


def _inverse(jacobian: Array, tolerance: float) -> Array:
    """The pseudo-inverse (p, m) of derivatives (m, p), columns scaled to unit length first."""
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    return np.asarray(np.linalg.pinv(jacobian / scale, rcond=tolerance) / scale[:, None])
