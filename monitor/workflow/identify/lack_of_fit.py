"""Whether the readings refute the model that they are identified by, as it is stored with the identification.

It is looked at where the readings are at hand and fitted; what reads the values later needs no fit to say it.
"""

from __future__ import annotations

import numpy as np

from monitor.discovery import Fit, robust_fit
from monitor.discovery.machine.noise.beyond_noise import beyond_neighbours
from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.store import LackOfFit


def lack_of_fit(problem: ChainProblem, solution: Solution, *, is_gross: bool) -> LackOfFit:
    """Return the lack of fit of a solution over the scatter of the runs, the noise of neighbours allowed for.

    Where readings are gross (``is_gross``) the model is fitted without them: one touch that is off by a millimetre
    would be the scatter that hides what all runs share. Costs 15 % of an identification of twenty runs. Not looked at
    where the rows are so many that they are fitted in parts.
    """
    if len(problem.runs) < 2 or problem.is_in_parts:
        return LackOfFit(None)
    try:
        fit = (
            robust_fit(problem).fit
            if is_gross
            else Fit(problem, solution, np.zeros(len(problem.context), dtype=bool))
        )
        p_value = beyond_neighbours(fit)
    except (DataError, np.linalg.LinAlgError):
        # The values are stated all the same; that nothing judges them is stored.
        return LackOfFit(None)
    return LackOfFit(p_value if p_value is not None and np.isfinite(p_value) else None)
