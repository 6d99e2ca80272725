"""What runs and days scatter in the added effects of a model beyond what their readings do.

The fit has one number for all runs. Where a run or a day has its own, that number is known less well than the readings
say, and a run takes up in its parameters what its own value is off the mean of all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.methods.chain.poses import widening_of_common
from monitor.records import Array
from monitor.reporting.budget import HoldsFor
from monitor.statistics.tails import chi_square_quantile, f_quantile
from monitor.uncertainty import OutputContribution
from monitor.uncertainty.parts import Estimated
from monitor.workflow.uncertainty.inputs import FEWEST_DAYS
from monitor.workflow.uncertainty.with_effects import EffectLine, EffectOutputs

#: The added effects of a campaign scatter from a size on that chance makes of readings in this part of campaigns.
_BY_CHANCE = 0.05


@dataclass(frozen=True)
class _Beyond:
    """What a number of runs, or of the means of days, scatters in an effect beyond its readings.

    ``variance`` of one of them, ``count`` of them, ``has_run``: whether the evaluated run is one, or of one.
    """

    variance: float
    count: int
    has_run: bool

    def added(self, of_run: Array, of_effect: Array) -> Array:
        """What it adds to all outputs (m + a, m + a), of which the parameters of the run answer the effect by
        ``of_run`` and the effects by ``of_effect`` (m + a,).

        The fit gives the run the mean of all, so that its own parameters take up what its own value is off that mean:
        nearly all of what one scatters. The mean itself has the part of the number of them.
        """
        of_mean = self.variance / self.count
        off_mean = self.variance - of_mean if self.has_run else self.variance + of_mean
        added = off_mean * np.outer(of_run, of_run) + of_mean * np.outer(of_effect, of_effect)
        if not self.has_run:
            added += of_mean * (np.outer(of_run, of_effect) + np.outer(of_effect, of_run))
        return np.asarray(added)


def scatter_of_effects(
    effects: EffectOutputs,
    fit: Fit,
    day_of: Mapping[int, int],
    of_readings: Array,
    dof: float,
    holds_for: HoldsFor,
) -> OutputContribution | None:
    """What runs and days scatter in the effects beyond their readings, or poses that share what no model has.

    ``of_readings`` (m + a, m + a) is what the readings of all runs give, estimated with ``dof`` degrees of freedom.
    None where they scatter no more than chance makes of readings in ``_BY_CHANCE`` of campaigns. What is to hold over
    a campaign of three days or more has what the days of an effect differ by whatever its size, where three of them or
    more determine it, and nothing of it in the parameters of the run, whose days and readings have it already.
    """
    problem, solution, followed = fit.problem, fit.solution, effects.followed
    first = len(of_readings) - len(effects.names)
    widened = widening_of_common(problem, solution)[effects.columns]
    days = np.array([day_of[int(number)] for number in problem.runs])
    over_days = holds_for is HoldsFor.CAMPAIGN and len(np.unique(days)) >= FEWEST_DAYS
    is_effect = np.arange(len(of_readings)) >= first
    covariance, fewest = np.zeros_like(of_readings), math.inf
    for column, name in enumerate(effects.names):
        variance = float(of_readings[first + column, first + column])
        response = effects.response[:, column]
        of_run, of_effect = np.where(is_effect, 0.0, response), np.where(is_effect, response, 0.0)
        beyond: list[_Beyond] = []
        if name in followed.names:
            values = followed.estimate[:, followed.names.index(name)]
            tail = _BY_CHANCE / len(effects.names)
            if over_days:
                of_run = np.zeros_like(of_run)
            # Days on which no run determines the effect say nothing of how it scatters: its own days count.
            if over_days and len(np.unique(days[np.isfinite(values)])) >= FEWEST_DAYS:
                beyond = _between_days(values, days, variance)
            else:
                beyond = _beyond(values, days, effects.index, variance, dof, tail)
        poses = (float(widened[column]) ** 2 - 1.0) * variance
        larger = [each for each in beyond if each.variance / each.count > poses]
        if larger:
            # Of runs and of days the one that adds most: what days scatter is in what runs scatter, too.
            added = [each.added(of_run, of_effect) for each in larger]
            most = int(np.argmax([np.trace(each) for each in added]))
            covariance = covariance + added[most]
            fewest = min(fewest, larger[most].count - 1.0)
        elif poses > 0.0:
            covariance = covariance + poses * np.outer(response, response)
    if not np.any(covariance):
        return None
    return OutputContribution(EffectLine.SCATTER.value, covariance, fewest, Estimated.SCALE)


def _beyond(
    values: Array, days: npt.NDArray[np.int64], index: int, variance: float, dof: float, tail: float
) -> list[_Beyond]:
    """What runs, and what the means of days, scatter beyond the ``variance`` of their mean by readings alone, estimated
    with ``dof`` degrees of freedom; those of them that do so with a probability of ``tail`` at most by chance.

    ``values`` (R,) of an effect, NaN where a run says nothing of it. Two runs or days have one degree of freedom, which
    the coverage factors pay for.
    """
    stated = np.isfinite(values)
    has_run = bool(stated[index])
    values, means = values[stated], _day_means(values, days)
    samples = [values] if len(means) in (1, len(values)) else [values, means]
    if len(values) < 2:
        return []
    beyond = []
    for sample in samples:
        limit = _largest_ratio(tail / len(samples), len(sample) - 1, dof)
        of_mean = float(sample.var(ddof=1)) / len(sample)
        if of_mean > limit * variance:
            beyond.append(_Beyond(len(sample) * (of_mean - variance), len(sample), has_run))
    return beyond


def _between_days(values: Array, days: npt.NDArray[np.int64], variance: float) -> list[_Beyond]:
    """What the means of ``FEWEST_DAYS`` or more days scatter beyond the ``variance`` of their mean by readings alone,
    if anything; no test decides, since one misses most scatter of the size of that of the readings."""
    means = _day_means(values, days)
    of_mean = float(means.var(ddof=1)) / len(means)
    return [_Beyond(len(means) * (of_mean - variance), len(means), True)] if of_mean > variance else []


def _day_means(values: Array, days: npt.NDArray[np.int64]) -> Array:
    """The mean of every day that has a value."""
    stated = np.isfinite(values)
    return np.array([values[stated & (days == day)].mean() for day in np.unique(days[stated])])


def _largest_ratio(tail: float, freedom: float, dof: float) -> float:
    """The ratio of two estimates of one variance that is exceeded with probability ``tail``."""
    if math.isinf(dof):
        return float(chi_square_quantile(tail, freedom)) / freedom
    return float(f_quantile(tail, freedom, dof))
