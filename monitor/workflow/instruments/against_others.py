"""Which setup or instrument contradicts all others together, and whether it is the one that is wrong."""

from __future__ import annotations

import numpy as np
import scipy

from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.contrasts import comparisons_of
from monitor.methods.method import Contrast, Instruments, Unable
from monitor.workflow.instruments.answer import AgainstOthers, Suspect
from monitor.workflow.instruments.instruments import DOUBTFUL


def against_others(
    problem: ChainProblem,
    solution: Solution,
    ability: Instruments | Unable,
    run: int | None = None,
    doubtful: float = DOUBTFUL,
) -> AgainstOthers | None:
    """Who contradicts all others of a run, the last one without ``run``, the least likely; None where chance makes as
    much more often than ``doubtful``, or nothing is compared."""
    if not isinstance(ability, Instruments):
        return None
    run = int(problem.runs[-1]) if run is None else run
    every = ability.contrasts(problem, solution, run)
    comparisons = comparisons_of(every)
    if not every or min(each.p for each in every) * comparisons > doubtful:
        return None
    # Also those that contradict the others less surely: their direction may be one of many.
    explaining = [each for each in every if each.others_p is not None and each.others_p > doubtful]
    suspects = [each for each in explaining if not any(other.members < each.members for other in explaining)]
    worst = min(suspects or every, key=lambda contrast: (contrast.p, -contrast.size))
    return AgainstOthers(
        run,
        worst.name,
        worst.kind,
        worst.setups,
        worst.directions,
        worst.size,
        _limit(worst, doubtful / comparisons),
        comparisons,
        min(1.0, worst.p * comparisons),
        tuple(Suspect(each.name, each.kind, each.setups, bool(each.others_left)) for each in suspects),
    )


def _limit(contrast: Contrast, level: float) -> float:
    """The size that chance exceeds as often as ``level``."""
    directions, freedom = contrast.directions, contrast.freedom
    if not np.isfinite(freedom):
        return float(np.sqrt(scipy.special.chdtri(directions, level) / directions))
    rest = freedom - directions + 1.0
    return float(np.sqrt(scipy.special.fdtri(directions, rest, 1.0 - level) * freedom / rest))
