"""Plays and lags of the drives that a campaign moves, beside which a mistake of its file is judged.

Nearly every machine has them, and what they leave hides whether a mistake undone explains the readings: a play looks
otherwise there and back, and so do readings with another sign or in another order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.cures import Maker, fitted
from monitor.discovery.search.projection import orthonormal, without
from monitor.effects import ParsedEffect, parse_effect
from monitor.exceptions import EffectError
from monitor.machine import COMPONENTS
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array, Campaign

SHAPES = ("reversal", "lag")
#: A setup shows an effect of so many standard uncertainties, by its own readings and their scatter.
SHOWN = 6.0
#: What the unknowns of a setup leave less of than this part is theirs.
SMALL = 1e-4


def beside_plays(problem_of: Maker) -> Maker:
    """What makes the problem of a campaign with the play and the lag of every drive that moves as common effects."""

    def problem_with_plays(campaign: Campaign) -> ChainProblem:
        problem = problem_of(campaign)
        return replace(problem, added=(*problem.added, *plays_of(problem)))

    return problem_with_plays


def beside_shown_plays(campaign: Campaign, problem_of: Maker) -> Maker | None:
    """The same with the plays and lags alone that the readings of some setup show by themselves, which those of another
    may contradict; None where none does."""
    fit = fitted(campaign, beside_plays(problem_of))
    if fit is None:
        return None
    shown = _shown(fit, campaign.probings.channels["setup"])

    def problem_with_shown_plays(changed: Campaign) -> ChainProblem:
        problem = problem_of(changed)
        effects = [effect for effect in plays_of(problem) if effect.text in shown]
        return replace(problem, added=(*problem.added, *effects))

    return problem_with_shown_plays if shown else None


def _shown(fit: Fit, setup: Array) -> set[str]:
    """The plays and lags of a fit that the rows of a single setup (n,) show in some run."""
    problem, solution = fit.problem, fit.solution
    residual, by_local, by_common = problem.of_rows(solution.local, solution.common)
    names = problem.added_names
    shown: set[str] = set()
    for run in problem.runs:
        for number in np.unique(setup[problem.context.run == run]):
            rows = (problem.context.run == run) & (setup == number)
            rest, plays = residual[rows].ravel(), by_common[rows].reshape(-1, len(names))
            basis = orthonormal(by_local[rows].reshape(len(rest), -1))
            # As they were without any of them.
            rest = without(basis, rest - plays @ solution.common)
            shown.update(names[each] for each in _shown_by(rest, basis, plays))
    return shown


def _shown_by(rest: Array, basis: Array, plays: Array) -> list[int]:
    """The columns (N, k) that what is left of a setup (N,) shows beside a ``basis`` of its unknowns, the plainest
    first."""
    least = SMALL * np.linalg.norm(plays, axis=0)
    plays = without(basis, plays)
    columns: list[int] = []
    while len(columns) < plays.shape[1]:
        size = np.linalg.norm(plays, axis=0)
        is_left = size > least
        along = np.where(is_left, rest @ plays / np.where(is_left, size, 1.0), 0.0)
        best = int(np.argmax(np.abs(along)))
        free = max(len(rest) - basis.shape[1] - len(columns) - 1, 1)
        scatter = (float(rest @ rest) - along[best] ** 2) / free
        if along[best] ** 2 <= SHOWN**2 * max(scatter, 1.0):
            break
        unit = plays[:, best] / size[best]
        rest, plays = rest - along[best] * unit, plays - np.outer(unit, unit @ plays)
        columns.append(best)
    return columns


def plays_of(problem: ChainProblem) -> list[ParsedEffect]:
    """The play and the lag of every drive that moves within a run, as far as the problem lacks and can show them."""
    context = problem.context
    present = {effect.text for effect in (*problem.base, *problem.added)}
    effects = []
    for index, joint in enumerate(context.chain.joints):
        if not any(np.ptp(context.positions[rows, index]) > 0.0 for rows in context.stretches):
            continue
        for shape in SHAPES:
            text = f"E{COMPONENTS[joint.main + 3 * joint.turns]}{joint.name}:{shape}"
            try:
                effect = parse_effect(text, context.chain)
            except EffectError:
                continue
            if text not in present and problem.can_show(effect):
                effects.append(effect)
    return effects
