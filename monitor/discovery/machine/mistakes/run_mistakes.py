"""Mistakes of one run: it leaves far more or far less than the others, and like them with a mistake undone in it.

Another sign, another unit or two exchanged columns in the file of a single run is no effect of the machine, and no
reading of the other runs is wrong. Each mistake is undone in that run alone, which is fitted by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import (
    Trial,
    column_mistakes,
    measured_columns,
    unit_mistakes,
)
from monitor.discovery.machine.mistakes.cures import Maker, Mistake, fitted
from monitor.methods import campaign_method
from monitor.records import Array, Campaign

#: Runs of a real machine differ by a third; a mistake leaves some of what was to be measured, which is far more than
#: noise, and a reading in the next larger unit 25 times less.
FAR_MORE, FAR_LESS = 3.0, 0.1
#: Runs that are alike differ by less.
LIKE_OTHERS = 1.5
#: A mistake that does the same leaves the same, but for rounding and the noise of a run.
AS_WELL = 1.1


def find_run_mistakes(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistakes of single runs; several of one run where its readings cannot say which it was.

    ``first`` is the fit of the campaign as recorded. Empty where no run is unlike the others, or none of the mistakes
    that are tried makes it like them.
    """
    remainders = _remainders(first)
    runs = {run: odd for run in remainders if (odd := _usual(remainders, run)) is not None}
    cured = {
        run: cures
        for run, usual in runs.items()
        if (cures := _cures(campaign, problem_of, run, remainders, usual))
    }
    # More than half of the runs are not the wrong ones.
    if not cured or 2 * len(cured) > len(remainders):
        return ()
    if len(cured) == 1:
        return next(iter(cured.values()))
    of_first = next(iter(cured.values()))[0]
    what = ", and ".join(" or ".join(cure.what for cure in cures) for cures in cured.values())
    return (replace(of_first, what=what),)


def _remainders(fit: Fit) -> dict[int, float]:
    """What every run leaves: the median of its rows, in stated standard uncertainties."""
    white = np.where(np.isfinite(fit.problem.sigma), fit.vectors / fit.problem.sigma, np.nan)
    run = fit.problem.context.run
    rows = _lengths(white)
    return {int(number): float(np.nanmedian(rows[run == number])) for number in fit.problem.runs}


def _lengths(white: Array) -> Array:
    """The root mean squares (n,) of the numbers of each row; NaN where none was read."""
    count = np.sum(np.isfinite(white), axis=1)
    return np.asarray(np.sqrt(np.nansum(white**2, axis=1) / np.where(count == 0, np.nan, count)))


def _usual(remainders: dict[int, float], run: int) -> float | None:
    """What the others leave, where a run leaves far more or far less and is farther from its statement than they."""
    others = [value for number, value in remainders.items() if number != run and value > 0.0]
    if not others or remainders[run] <= 0.0:
        return None
    usual = float(np.median(others))
    is_far = not FAR_LESS < remainders[run] / usual < FAR_MORE
    return usual if is_far and abs(np.log(remainders[run])) > abs(np.log(usual)) else None


def _cures(
    campaign: Campaign, problem_of: Maker, run: int, remainders: dict[int, float], usual: float
) -> tuple[Mistake, ...]:
    """The mistakes of a run that undone let it leave what the others do, the smallest remainder first."""
    part = run_alone(campaign, run)
    as_recorded = fitted(part, problem_of)
    cures: list[tuple[float, Mistake]] = []
    for what, undo in _trials(part, is_small=remainders[run] < usual):
        undone = fitted(undo(part), problem_of)
        if undone is None:
            continue
        leaves = _remainders(undone)[run]
        if 1.0 / LIKE_OTHERS < leaves / usual < LIKE_OTHERS:
            before = float("inf") if as_recorded is None else as_recorded.rms
            cures.append((leaves, Mistake(f"{what.split(' (`')[0]} in run {run}", before, undone.rms)))
    least = min((leaves for leaves, _ in cures), default=0.0)
    alike = [(leaves, mistake) for leaves, mistake in cures if leaves <= AS_WELL * least]
    return tuple(mistake for _, mistake in sorted(alike, key=lambda pair: float(f"{pair[0]:.2g}")))


def _trials(part: Campaign, *, is_small: bool) -> Iterator[Trial]:
    """What is tried of a run: of one that fits too well its units alone."""
    yield from unit_mistakes(measured_columns(part))
    if not is_small:
        yield from column_mistakes(part)


def run_alone(campaign: Campaign, number: int) -> Campaign:
    """One run, and of very many poses some, spread over the run."""
    probings = campaign.probings
    rows = np.flatnonzero(probings.run == number)
    most_rows = campaign_method(campaign).trial_rows
    if most_rows is not None and len(rows) > most_rows:
        joints = np.column_stack(list(probings.readings.values()))[rows]
        _, pose = np.unique(joints, axis=0, return_inverse=True)
        pose = pose.reshape(-1)
        step = int(np.ceil(len(rows) / most_rows))
        rows = rows[pose % step == 0]
    return replace(
        campaign, runs=tuple(run for run in campaign.runs if run.run == number), probings=probings.rows(rows)
    )
