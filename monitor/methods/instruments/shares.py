"""What each instrument does for each parameter: its part of the variance in the joint fit, and what it says alone.

The joint estimate is C J' r, linear in the whitened readings r, each of variance 1: so the variance of a parameter is
the sum of the squares of its row of C J', and the readings of one instrument have their part of that sum (GUM, 5.1.3).
What an instrument says alone is one Gauss-Newton step from the joint point on its own rows: where instruments disagree
by five times U, a tenth of u beside the fit of its own campaign. What its rows do not separate on the nominal machine
is left out of that step, as in ``InstrumentProblem.linearise``. Of bars and scales it knows what is stated, not what
the instruments of other runs made of them. Where its readings, after that step, scatter more than
it states, their own scatter counts, with its degrees of freedom (JCGM 100:2008, 4.2 and G.4.1); less never makes it
surer. Setups whose ``instrument`` is written the same are one instrument.
"""

from __future__ import annotations

import numpy as np

from monitor.methods.chain.least_squares import RANK_TOLERANCE, Solution, inverse_of
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.run_rows import instruments_of, run_rows
from monitor.methods.method import InstrumentShare
from monitor.records import Array


def shares(problem: ChainProblem, solution: Solution, run: int) -> tuple[tuple[InstrumentShare, ...], Array]:
    """The share of every instrument in a run, and the part (k,) of the variance from what is known beforehand."""
    at = run_rows(problem, solution, run)
    jacobian, residual, index = at.jacobian, at.residual, int(np.searchsorted(problem.runs, run))
    count = len(problem.base_names)
    inverse = inverse_of(run_rows(problem, solution, run, knows_others=True).jacobian, RANK_TOLERANCE)
    joint = solution.local[index, :count]
    free = solution.local_free[index, :count]
    squares = np.where(free[:, None], inverse[:count] ** 2, np.nan)
    instruments = []
    for name, setups in instruments_of(at.problem).items():
        rows = at.of_setups(setups)
        mine = np.concatenate([rows, at.known_of(setups)])
        separated_by_mine = at.separated(mine)
        separated = separated_by_mine.projector
        by_mine = inverse_of(jacobian[mine] @ separated, RANK_TOLERANCE)
        determined = separated_by_mine.determined[:count] & free
        remaining = residual[mine] - jacobian[mine] @ (separated @ (by_mine @ residual[mine]))
        leverage = np.einsum("mp,pm->m", jacobian[mine] @ separated, by_mine)
        numbers = int(np.count_nonzero(at.is_read[rows]))
        of_rows = slice(0, len(rows))
        scatter, freedom = scatter_of(remaining[of_rows], numbers - float(leverage[of_rows].sum()))
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
    return tuple(instruments), np.asarray(squares[:, at.extras :].sum(axis=1))


def scatter_of(remaining: Array, freedom: float) -> tuple[float, float]:
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
