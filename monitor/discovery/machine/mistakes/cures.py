"""The test of a mistake of the file: undone, it lets the residual fall to the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.exceptions import MonitorError
from monitor.methods.chain.least_squares import RANK_TOLERANCE
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.records import Campaign

#: Undone, a mistake leaves less than this part of the residual, and no more than so many standard uncertainties:
#: beside the mistake a machine still has its effects.
CURED_SHARE, CURED_TIMES = 0.05, 20.0
#: What is left at the noise is a cure as well, where the residual was little more to begin with.
NOISE_TIMES, WORTH_SHARE = 1.3, 0.5
#: Readings that fit converge in some eight steps; a trial that does not is none.
MOST_STEPS = 15
#: A gross reading is one of many; of a target or a run that loses more of its rows all of it may be wrong.
MOST_GROSS = 0.1

#: Makes the problem of a campaign.
Maker = Callable[[Campaign], ChainProblem]


@dataclass(frozen=True)
class Mistake:
    """A likely mistake of the file: ``what`` in words, and the RMS of all coordinates in mm with it and without. Where
    it is not ``enough``, it comes nearest of all that are tried and leaves more than effects of a machine may.
    ``untried`` setups or instruments contradict besides, less than those that were tried."""

    what: str
    rms_as_recorded: float
    rms_undone: float
    enough: bool = True
    untried: int = 0


def fitted(campaign: Campaign, problem_of: Maker) -> Fit | None:
    """The fit of a corrected campaign; None where it does not converge within few steps."""
    problem = problem_with(campaign, problem_of)
    return None if problem is None else fitted_problem(problem)


def problem_with(campaign: Campaign, problem_of: Maker) -> ChainProblem | None:
    """The problem of a corrected campaign; None where that is no machine of the file either."""
    try:
        with np.errstate(all="ignore"):
            return problem_of(campaign)
    except (MonitorError, np.linalg.LinAlgError):
        return None


def sum_after_one_step(problem: ChainProblem) -> float:
    """The sum of squares that one step of a fit foresees; infinite where there is none."""
    try:
        with np.errstate(all="ignore"):
            at = problem.linearise(problem.start, problem.common_start)
    except (MonitorError, np.linalg.LinAlgError):
        return float("inf")
    total = 0.0
    for residual, local, common in zip(at.residual, at.local, at.common, strict=True):
        columns = np.hstack([local, common])
        size = np.linalg.norm(columns, axis=0)
        columns = columns / np.where(size > 0.0, size, 1.0)
        rest = residual - columns @ np.linalg.lstsq(columns, residual, rcond=RANK_TOLERANCE)[0]
        total += float(rest @ rest)
    return total


def fitted_problem(problem: ChainProblem) -> Fit | None:
    """The fit of the problem of a corrected campaign; None where it does not converge within few steps."""
    try:
        with np.errstate(all="ignore"):
            solution = solve_problem(problem, most=MOST_STEPS)
    except (MonitorError, np.linalg.LinAlgError):
        return None
    return Fit(problem, solution, np.zeros(len(problem.context), dtype=bool))


def without_gross(campaign: Campaign, first: Fit) -> Campaign:
    """The campaign without the readings that its first fit left out: one of them would hide what a mistake undone does.

    Those of a target or a run that lost many are kept, since the mistake may be why.
    """
    gross, probings = first.left_out.copy(), campaign.probings
    for names in (probings.target, probings.run):
        for name in np.unique(names[first.left_out]):
            rows = names == name
            if first.left_out[rows].sum() > max(1.0, MOST_GROSS * rows.sum()):
                gross[rows] = False
    return replace(campaign, probings=probings.rows(~gross)) if gross.any() else campaign


def cured_rms(campaign: Campaign, problem_of: Maker, before: float) -> float | None:
    """The residual of a corrected campaign in mm, None where it is still too large."""
    fit = fitted(campaign, problem_of)
    return fit.rms if fit is not None and np.isfinite(fit.rms) and is_cure(fit, before) else None


def is_cure(fit: Fit, before: float) -> bool:
    """Whether a fit leaves next to nothing of the residual before, in mm."""
    enough = max(CURED_SHARE * before, min(NOISE_TIMES * fit.sigma, WORTH_SHARE * before))
    return fit.rms < min(enough, CURED_TIMES * fit.sigma)
