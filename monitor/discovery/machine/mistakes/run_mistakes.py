"""Mistakes of one run: it leaves far more or far less than the others, and like them with a mistake undone in it.

Another sign, another unit or two exchanged columns in the file of a single run is no effect of the machine, and no
reading of the other runs is wrong. Each mistake is undone in that run alone, which is fitted by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtr, fdtrc

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import (
    Trial,
    column_mistakes,
    measured_columns,
    unit_mistakes,
)
from monitor.discovery.machine.mistakes.cures import Maker, Mistake, fitted, without_gross
from monitor.methods import campaign_method
from monitor.records import Array, Campaign

#: Runs of a real machine differ by a third; a mistake leaves some of what was to be measured, which is far more than
#: noise, and a reading in the next larger unit 25 times less.
FAR_MORE, FAR_LESS = 3.0, 0.1
#: Runs that are alike differ by less.
LIKE_OTHERS = 1.5
#: A mistake that does the same leaves the same, but for rounding and the noise of a run.
AS_WELL = 1.25
#: Two readings at one place have one degree of freedom: they leave a tenth of what is usual in one of twelve runs. So
#: rarely does noise make one of all runs as unlike the others as one that is tried.
BY_CHANCE = 1e-3


@dataclass(frozen=True)
class _Odd:
    """A run unlike the others, what it should leave in stated standard uncertainties, whether it leaves far less, and
    whether most of the others are alike."""

    run: int
    usual: float
    is_small: bool
    by_most: bool = False


def find_run_mistakes(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistakes of single runs; several of one run where its readings cannot say which it was.

    ``first`` is the fit of the campaign as recorded, whose gross readings take no part. Empty where no run is unlike
    the others, or none of the mistakes that are tried makes it like them.
    """
    remainders = _remainders(first)
    campaign = without_gross(campaign, first)
    for tried in _odd_runs(remainders):
        odd_runs = [odd for odd in tried if not _is_chance(odd, tried, remainders, first)]
        cured = {
            odd.run: cures for odd in odd_runs if (cures := _cures(campaign, problem_of, odd, remainders))
        }
        # More than half of the runs are not the wrong ones.
        if cured and 2 * len(cured) <= len(remainders):
            break
    else:
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


def _odd_runs(remainders: Mapping[int, float]) -> Iterator[tuple[_Odd, ...]]:
    """The runs that are tried together: those unlike most; where two halves differ, the larger ones before the smaller.

    A statement may be wrong by ten times, so most runs decide and not what is stated. Of two runs, or two halves, the
    larger ones must be brought to the level of the smaller; the smaller ones, in a larger unit, to their own statement.
    """
    by_run = {run: value for run, value in remainders.items() if value > 0.0}
    if len(by_run) < 2:
        return
    ordered = sorted(by_run.values())
    lower, upper = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    if upper < FAR_MORE * lower:
        usual = float(np.sqrt(lower * upper))
        yield tuple(
            _Odd(run, usual, value < usual, by_most=True)
            for run, value in by_run.items()
            if not FAR_LESS < value / usual < FAR_MORE
        )
        return
    smaller = float(np.median([value for value in ordered if value <= lower]))
    yield tuple(_Odd(run, smaller, is_small=False) for run, value in by_run.items() if value >= upper)
    if lower < FAR_LESS * upper:
        yield tuple(_Odd(run, 1.0, is_small=True) for run, value in by_run.items() if value <= lower)


def _is_chance(odd: _Odd, tried: tuple[_Odd, ...], remainders: Mapping[int, float], first: Fit) -> bool:
    """Whether noise alone makes a run as unlike those it is held against, by the degrees of freedom of both."""
    freedom = _degrees_of_freedom(first)
    beside = {odd.run} if odd.by_most else {each.run for each in tried}
    others = sum(number for run, number in freedom.items() if run not in beside)
    of_odd = freedom[odd.run]
    if min(of_odd, others) < 1:
        return True
    level = odd.usual
    if odd.is_small and not odd.by_most:
        level = float(np.median([value for run, value in remainders.items() if run not in beside]))
    ratio = (remainders[odd.run] / level) ** 2
    chance = fdtr(of_odd, others, ratio) if ratio < 1.0 else fdtrc(of_odd, others, ratio)
    return bool(len(remainders) * chance > BY_CHANCE)


def _degrees_of_freedom(fit: Fit) -> dict[int, int]:
    """The numbers with weight of every run, less what its own unknowns take of them."""
    of_run = fit.nuisance.basis
    taken = np.rint(np.sum(of_run**2, axis=(1, 2))).astype(int)
    count = fit.has_weight.sum(axis=1)
    calibrated = len(fit.problem.extra_names)
    run = fit.problem.context.run
    return {
        int(number): int(count[run == number].sum()) + calibrated - int(less)
        for number, less in zip(fit.problem.runs, taken, strict=True)
    }


def _cures(
    campaign: Campaign, problem_of: Maker, odd: _Odd, remainders: Mapping[int, float]
) -> tuple[Mistake, ...]:
    """The mistakes of a run that undone let it leave what the others do, the smallest remainder first."""
    part = run_alone(campaign, odd.run)
    as_recorded = fitted(part, problem_of)
    read = _read(part)
    others = float(np.median([_read(run_alone(campaign, run)) for run in remainders if run != odd.run]))
    cures: list[tuple[float, Mistake]] = []
    for what, undo in _trials(part, is_small=odd.is_small):
        corrected = undo(part)
        scaled = _read(corrected)
        of_unit = not np.isclose(scaled, read)
        if of_unit and not _is_nearer(scaled, read, others):
            continue
        undone = fitted(corrected, problem_of)
        if undone is None:
            continue
        leaves = _remainders(undone)[odd.run]
        # Either of two runs may be in another unit: that is decided by what is stated.
        if of_unit and not odd.by_most and not _is_nearer(leaves, remainders[odd.run], 1.0):
            continue
        if 1.0 / LIKE_OTHERS < leaves / odd.usual < LIKE_OTHERS:
            before = float("inf") if as_recorded is None else as_recorded.rms
            cures.append((leaves, Mistake(f"{what.split(' (`')[0]} in run {odd.run}", before, undone.rms)))
    least = min((leaves for leaves, _ in cures), default=0.0)
    alike = [(leaves, mistake) for leaves, mistake in cures if leaves <= AS_WELL * least]
    return tuple(mistake for _, mistake in sorted(alike, key=lambda pair: float(f"{pair[0]:.2g}")))


def _read(part: Campaign) -> float:
    """The root mean square of all that was measured in a run: in a larger unit all of it is smaller, not only what a
    fit leaves of it. 1 where nothing but directions and positions was read, which have no unit to be mistaken."""
    channels = part.probings.channels
    measured = np.concatenate([np.zeros(0), *(channels[name] for name in measured_columns(part))])
    measured = measured[np.isfinite(measured)]
    return float(np.sqrt(np.mean(measured**2))) if measured.size else 1.0


def _is_nearer(undone: float, recorded: float, others: float) -> bool:
    """Whether a size is nearer to that of others, as a ratio, with a mistake undone than as recorded."""
    return bool(abs(np.log(undone / others)) < abs(np.log(recorded / others)))


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
