"""Lack of fit where readings of one run resemble their neighbours: the test on numbers that a filter made independent.

The plain F test counts every reading as one of its own. Under noise that follows itself (a correlation of 0.6 to 0.9
along the probing sequence) it calls 2 to 12 % of right models wrong at 0.1 %. Here the correlation is estimated from
what the runs do not share, and taken out before lack of fit is held against the scatter of the runs.
"""

from __future__ import annotations

import numpy as np
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.noise.plan_cells import plan_cells


def beyond_neighbours(fit: Fit) -> float | None:
    """Return the p-value of lack of fit over the scatter of the runs, with the noise of neighbours allowed for.

    None where no two runs follow the same plan, one probing after the other: then there is nothing to compare.
    """
    problem = fit.problem
    cells = problem.padded(plan_cells(problem)[:, None].astype(np.float64) + 1.0)
    runs = len(problem.runs)
    if runs < 2 or np.any(cells != cells[0]):
        return None
    white = fit.with_correlation(fit.correlation()).white
    mean = white.mean(axis=0)
    freedom = fit.degrees_of_freedom / runs
    lack, scatter = runs * float(np.sum(mean**2)), float(np.sum((white - mean) ** 2))
    if scatter <= 0.0:
        return None
    return float(scipy.special.fdtrc(freedom, freedom * (runs - 1), lack / scatter * (runs - 1)))
