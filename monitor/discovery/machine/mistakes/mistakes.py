"""Mistakes of the file where the residual is far beyond any effect: exchanged targets or columns, signs, units.

What a machine hides is micrometres to tenths of a millimetre; a residual of millimetres is first of all a column or a
target that was exchanged. The simple mistakes are undone one at a time and the campaign is fitted again: where one
of them lets the residual fall to the noise, it is reported, and nothing else is. Nothing is changed in the data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from monitor.discovery.machine.evidence.robust import RobustFit
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import (
    Trial,
    column_mistakes,
    direction_mistakes,
    reading_mistakes,
    signs_of_turning,
)
from monitor.discovery.machine.mistakes.cures import Maker, Mistake, cured_rms, without_gross
from monitor.discovery.machine.mistakes.run_mistakes import run_alone
from monitor.discovery.machine.mistakes.target_mistakes import relabelled
from monitor.methods import campaign_method
from monitor.records import Campaign

#: So many mm are left by no effect that a search should begin with, whatever the stated standard uncertainty.
GROSS_MM = 0.3
#: A statement is seldom wrong by a factor of three; a column with the other sign leaves more.
FAR_TIMES = 3.0


def is_gross(campaign: Campaign, fit: Fit) -> bool:
    """Whether a residual is beyond what effects of a machine leave."""
    return fit.rms > campaign_method(campaign).gross_times * fit.sigma or fit.rms > GROSS_MM


def is_far(fit: Fit) -> bool:
    """Whether a residual is so far beyond what is stated that a wrong column may be why, as well as an effect."""
    return fit.rms > FAR_TIMES * fit.sigma


def find_mistakes(campaign: Campaign, problem_of: Maker, fit: Fit | None) -> tuple[Mistake, ...]:
    """The mistakes that undone let the residual fall to the noise, the smallest remainder first.

    ``fit`` is that of the campaign as recorded, None where it does not converge. Several are reported where data
    cannot say which it was. Empty where none of those tried is enough.
    """
    # Quick, and what it finds no exchange of whole columns would bring to the noise.
    other_names = relabelled(campaign, problem_of, fit)
    if other_names is not None:
        return (other_names,)
    mistakes: tuple[Mistake, ...] = ()
    for trials in (column_mistakes, direction_mistakes):
        mistakes = mistakes or _cures(campaign, problem_of, fit, trials)
    return mistakes


def find_reading_mistakes(campaign: Campaign, problem_of: Maker, fit: Fit) -> tuple[Mistake, ...]:
    """The mistakes of the columns of what was measured, as ``find_mistakes``: deviations of micrometres with another
    sign leave no more than micrometres. Where one of them is enough, so may be the sign of an axis that turns."""
    campaign = without_gross(campaign, fit)
    of_columns = _cures(campaign, problem_of, fit, reading_mistakes)
    return of_columns and (*_cures(campaign, problem_of, fit, signs_of_turning), *of_columns)


def _cures(
    campaign: Campaign, problem_of: Maker, fit: Fit | None, trials: Callable[[Campaign], Iterable[Trial]]
) -> tuple[Mistake, ...]:
    """Those of the trials that let the residual fall to the noise: in the worst run, and in all of them."""
    before = float("inf") if fit is None else fit.rms
    part = _worst_run(campaign, fit)
    cures = [
        (what, undo, rms)
        for what, undo in trials(campaign)
        if (rms := cured_rms(undo(part), problem_of, before)) is not None
    ]
    best = min((rms for *_, rms in cures), default=0.0)
    mistakes = [
        Mistake(what, before, after)
        for what, undo, rms in cures
        if rms <= 2.0 * best and (after := cured_rms(undo(campaign), problem_of, before)) is not None
    ]
    # Those that do the same leave the same, but for rounding; they stay in the order in which they are tried.
    return tuple(sorted(mistakes, key=lambda mistake: float(f"{mistake.rms_undone:.2g}")))


def find_other_names(campaign: Campaign, problem_of: Maker, first: RobustFit) -> tuple[Mistake, ...]:
    """The mistake that the gross readings of a first fit stand under the name of another target; empty where not."""
    if not first.gross:
        return ()
    fit = first.fit
    # With the weight that the rows had as recorded: what is tried is that they are right, but for their names.
    as_recorded = Fit(problem_of(campaign), fit.solution, np.zeros_like(fit.left_out))
    other_names = relabelled(campaign, problem_of, as_recorded)
    return () if other_names is None else (other_names,)


def _worst_run(campaign: Campaign, fit: Fit | None) -> Campaign:
    """The run that is fitted worst, and of very many poses some, spread over the run."""
    worst = int(campaign.probings.run[0])
    if fit is not None:
        squares, run = np.sum(fit.vectors**2, axis=1), fit.problem.context.run
        runs = np.unique(run)
        worst = int(runs[int(np.argmax([squares[run == number].mean() for number in runs]))])
    return run_alone(campaign, worst)
