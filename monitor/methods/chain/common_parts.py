"""What the parameters of runs have of calibrated quantities that outlast a campaign: a laser's scale, a bar's length.

The joint estimate is linear in what is known beforehand: where the stated value of a quantity is larger by its standard
uncertainty u, the estimate changes by C h, with the covariance C of the unknowns and the row h of derivatives of the
whitened statement (JCGM 100:2008, 5.1.3). Two results with parts p1 and p2 of one quantity have the covariance p1 p2
(F.1.2.3), whichever campaigns they are of. Neglected: that runs which share an added effect know it by each other's
statement of one quantity too.
"""

from __future__ import annotations

import numpy as np

from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.sources import CommonQuantity


def common_parts(problem: ChainProblem, solution: Solution) -> dict[CommonQuantity, Array]:
    """Changes (R, k) of the base parameters, in internal units, for one standard uncertainty of each quantity; NaN
    where a parameter has no number."""
    quantities = problem.common_quantities
    if not any(quantities):
        return {}
    count = len(problem.base_names)
    _, by_own = problem.extras(problem.own_of(solution.local))
    covariance = solution.local_covariance[:, :count, count : count + by_own.shape[2]]
    changes = np.einsum("rkq,req->rek", covariance, by_own)
    changes = np.where(solution.local_free[:, None, :count], changes, np.nan)
    return {quantity: changes[:, index] for index, quantity in enumerate(quantities) if quantity is not None}
