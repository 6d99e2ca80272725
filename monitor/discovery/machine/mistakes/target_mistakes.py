"""Probings under the name of another target: those that another target explains far better."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import MOST_TARGETS, target_word
from monitor.discovery.machine.mistakes.cures import CURED_TIMES, Maker, Mistake, fitted, is_cure
from monitor.exceptions import MonitorError
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array, Campaign

#: Rows are relabelled where another target leaves less than this part of their residual.
BETTER_SHARE = 0.3
MOST_ROUNDS = 6
#: Rows that are named one by one.
MOST_NAMED = 4


def relabelled(campaign: Campaign, problem_of: Maker, fit: Fit | None) -> Mistake | None:
    """The mistake that some probings stand under the name of another target; None where that is not enough.

    Held against the fit, or the nominal machine and positions where none converges, and fitted again with their new
    names, since the wrong ones pulled at the fit, until no name changes.
    """
    before = float("inf") if fit is None else fit.rms
    try:
        problem = problem_of(campaign) if fit is None else fit.problem
    except MonitorError:
        return None
    names = np.array(problem.targets)
    if not 2 <= len(names) <= MOST_TARGETS:
        return None
    corrected, latest = campaign, fit
    for _ in range(MOST_ROUNDS):
        try:
            problem = problem_of(corrected) if latest is None else latest.problem
        except MonitorError:
            # Under the new names a target is missing that the method needs: the names were no mistake.
            return None
        if len(problem.targets) < len(names):
            return None
        target = _better_names(problem, latest, corrected.probings.target)
        if target is None:
            break
        corrected = replace(corrected, probings=replace(corrected.probings, target=target))
        latest = fitted(corrected, problem_of)
    changed = np.flatnonzero(corrected.probings.target != campaign.probings.target)
    # Where most rows would have another name, it is the fit that moved, not the names.
    few = 0 < len(changed) <= len(corrected.probings) / 2
    if latest is None or not few or not is_cure(latest, before):
        return None
    return Mistake(_in_words(campaign, corrected.probings.target, changed), before, latest.rms)


def _better_names(
    problem: ChainProblem, fit: Fit | None, recorded: npt.NDArray[np.str_]
) -> npt.NDArray[np.str_] | None:
    """The ``recorded`` targets (n,) with those replaced that another explains far better; None where none does."""
    names = np.array(problem.targets)
    local, common = problem.start, problem.common_start
    if fit is not None:
        local, common = fit.solution.local, fit.solution.common
    squares = _under_every_name(problem, local, common)
    rows = np.arange(squares.shape[1])
    as_recorded = squares[np.searchsorted(names, problem.context.target), rows]
    best = np.argmin(squares, axis=0)
    better = squares[best, rows] < BETTER_SHARE**2 * as_recorded
    better &= np.sqrt(as_recorded) > CURED_TIMES * problem.sigma[np.isfinite(problem.sigma)].max()
    return np.where(better, names[best], recorded) if better.any() else None


def _under_every_name(problem: ChainProblem, local: Array, common: Array) -> Array:
    """Squares (T, n) of the residuals in mm² at (R, p) and (c,), were every row one of each of the T targets."""
    context = problem.context
    names = np.array(problem.targets)
    recorded = np.searchsorted(names, context.target)
    squares = np.empty((len(names), len(recorded)))
    for shift in range(len(names)):
        # All names go round together, so that every target keeps its unknowns.
        target = (recorded + shift) % len(names)
        moved = replace(problem, context=replace(context, target=names[target]))
        squares[target, np.arange(len(recorded))] = np.sum(moved.vectors(local, common) ** 2, axis=1)
    return squares


def _in_words(campaign: Campaign, target: npt.NDArray[np.str_], changed: npt.NDArray[np.int64]) -> str:
    recorded, word = campaign.probings.target, target_word(campaign)
    pairs = {tuple(sorted((str(recorded[row]), str(target[row])))) for row in changed}
    rows = [
        f"run {campaign.probings.run[row]}, sequence {campaign.probings.sequence[row]}" for row in changed
    ]
    shown = "; ".join(rows[:MOST_NAMED]) + "; ..." * (len(rows) > MOST_NAMED)
    count = f"{len(changed)} probing{'s' * (len(changed) > 1)} ({shown})"
    if len(pairs) == 1 and len(changed) > 1:
        first, second = next(iter(pairs))
        return f"{word}s {first} and {second} were exchanged in {count}"
    row = int(changed[0])
    if len(changed) == 1:
        return f"{word} {target[row]} was recorded as {recorded[row]} in {count}"
    return f"the names of {word}s were mixed up in {count}"
