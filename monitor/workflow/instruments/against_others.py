"""Which setup or instrument contradicts all others together, and whether it is the one that is wrong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from monitor.discovery import Fit
from monitor.discovery.machine.noise.by_setup import whitening_by_setup
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.suspects import DOUBTFUL, who_contradicts
from monitor.methods.method import Contrast, Instruments, Unable
from monitor.records import Array
from monitor.workflow.instruments.answer import AgainstOthers, Suspect


def contradiction_in(fit: Fit, ability: Instruments | Unable) -> AgainstOthers | None:
    """Who contradicts all others in the last run of a fit, with the noise of neighbours allowed for.

    Noise that follows itself moves whole setups: taken for independent, chance seems to make next to none of it.
    """
    beside = against_others(fit.problem, fit.solution, ability)
    white = None if beside is None else whitening_by_setup(fit)
    return beside if white is None else against_others(fit.problem, fit.solution, ability, white=white)


def against_others(
    problem: ChainProblem,
    solution: Solution,
    ability: Instruments | Unable,
    run: int | None = None,
    doubtful: float = DOUBTFUL,
    white: Callable[[Array], Array] | None = None,
) -> AgainstOthers | None:
    """Who contradicts all others of a run, the last one without ``run``, the least likely; None where chance makes as
    much more often than ``doubtful``, or nothing is compared. ``white`` takes out of numbers (..., R, N) what
    neighbours share."""
    if not isinstance(ability, Instruments):
        return None
    run = int(problem.runs[-1]) if run is None else run
    contradiction = who_contradicts(ability.contrasts(problem, solution, run, white), doubtful)
    if contradiction is None:
        return None
    suspects, comparisons = contradiction.suspects, contradiction.comparisons
    worst = min(suspects or contradiction.every, key=lambda contrast: (contrast.p, -contrast.size))
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
