"""Which setup or instrument contradicts all others together, and whether it is the one that is wrong."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri, fdtri

from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.method import Contrast, Instruments, Unable
from monitor.workflow.instruments.answer import AgainstOthers
from monitor.workflow.instruments.instruments import DOUBTFUL


def against_others(
    problem: ChainProblem,
    solution: Solution,
    ability: Instruments | Unable,
    run: int | None = None,
    doubtful: float = DOUBTFUL,
) -> AgainstOthers | None:
    """The setup or instrument of a run, the last one without ``run``, that is the least likely beside all others; None
    where chance makes as much more often than ``doubtful``, or nothing is compared."""
    if not isinstance(ability, Instruments):
        return None
    run = int(problem.runs[-1]) if run is None else run
    of_all = ability.contrasts(problem, solution, run)
    every = frozenset(setup for contrast in of_all for setup in contrast.setups)
    comparisons = len(
        {frozenset({mine, every - mine}) for mine in (frozenset(each.setups) for each in of_all)}
    )
    worst = min(of_all, key=lambda contrast: (contrast.p, -contrast.size), default=None)
    if worst is None or worst.p * comparisons > doubtful:
        return None
    suspects = [each for each in of_all if each.p * comparisons <= doubtful and each.others_p > doubtful]
    return AgainstOthers(
        run,
        worst.name,
        worst.setups,
        worst.directions,
        worst.size,
        _limit(worst, doubtful / comparisons),
        comparisons,
        min(1.0, worst.p * comparisons),
        _smallest(suspects),
    )


def _smallest(suspects: list[Contrast]) -> tuple[str, ...]:
    """The names of suspects of which no part is one."""
    setups = {each.name: frozenset(each.setups) for each in suspects}
    return tuple(name for name, mine in setups.items() if not any(other < mine for other in setups.values()))


def _limit(contrast: Contrast, level: float) -> float:
    """The size that chance exceeds as often as ``level``."""
    directions, freedom = contrast.directions, contrast.freedom
    if not np.isfinite(freedom):
        return float(np.sqrt(chdtri(directions, level) / directions))
    rest = freedom - directions + 1.0
    return float(np.sqrt(fdtri(directions, rest, 1.0 - level) * freedom / rest))
