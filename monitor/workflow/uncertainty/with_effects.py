"""The effects that were added to a model as outputs beside the parameters of one run, and what they add to these.

Their coefficients are numbers of the whole campaign: the readings of every run determine them, and what is not known
of them moves the run's own parameters, too. ``monitor.uncertainty.runs.shared_effects`` has both to first order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.methods.chain.poses import widening_of_common
from monitor.methods.chain.shared_effects import followed_effects, shared_parameters
from monitor.records import Array
from monitor.reporting.certificate.model_effect import Outside
from monitor.sources import Sharing
from monitor.statistics.tails import chi_square_quantile, f_quantile
from monitor.uncertainty import Inputs, OutputContribution
from monitor.uncertainty.parts import Estimated
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.row_run import measured_run
from monitor.uncertainty.runs.shared_effects import shared_answer
from monitor.uncertainty.type_b import SourceColumns
from monitor.units import Unit


class EffectLine(StrEnum):
    """Lines of the budget: readings of the other runs, and effects that scatter more than readings do."""

    OTHER_RUNS = "readings of the other runs"
    SCATTER = "scatter of the added effects"


#: The added effects of a campaign scatter from a size on that chance makes of readings in this part of campaigns.
_BY_CHANCE = 0.05
#: Of so many runs or days a scatter is not taken: one degree of freedom.
_FEWEST_SCATTERED = 2


@dataclass(frozen=True)
class EffectOutputs:
    """The a stated coefficients of added effects, after the m parameters of the run at ``index`` of ``runs``.

    ``estimate`` (a,) in internal units; ``columns`` (a,) where they stand among the c common unknowns, of
    which ``by_logarithm`` (c,) is the value of a time constant, that is searched by its logarithm, else 1; ``response``
    (m + a, a): all outputs by these coefficients; ``by_run``: what the inputs of every run do through the common
    unknowns to all outputs, (m + a, N) each. ``unknowns`` (R, p).
    """

    runs: tuple[MeasuredRun, ...]
    unknowns: Array
    index: int
    names: tuple[str, ...]
    units: tuple[Unit, ...]
    estimate: Array
    columns: npt.NDArray[np.int64]
    by_logarithm: Array
    response: Array
    by_run: tuple[Array, ...]

    @property
    def others(self) -> tuple[int, ...]:
        """The runs but the evaluated one."""
        return tuple(run for run in range(len(self.runs)) if run != self.index)

    def padded(self, rows: Array) -> Array:
        """Rows (m, k) of the run's parameters, with zeros for the effects (m + a, k)."""
        return np.pad(rows, ((0, len(self.names)), (0, 0)))

    def contribution(self, part: OutputContribution) -> OutputContribution:
        """What acts on the run's parameters (m, m) alone, among all outputs."""
        return replace(part, covariance=np.pad(part.covariance, (0, len(self.names))))

    @property
    def linear(self) -> Array:
        """What the inputs (N,) of the evaluated run do to all outputs through the common unknowns (m + a, N).

        A calibrated quantity is the same in every run, so its columns are those of all runs.
        """
        readings = len(self.runs[self.index].reading_names)
        linear = self.by_run[self.index].copy()
        for run in self.others:
            linear[:, readings:] += self.by_run[run][:, len(self.runs[run].reading_names) :]
        return linear

    def of_other_runs(self, inputs: Inputs, covariances: Sequence[Array]) -> OutputContribution:
        """What the readings of the other runs add, of which each has one of the ``covariances`` (R).

        They follow from the estimate that those of the evaluated run in ``inputs`` follow from.
        """
        source = inputs.sources[0]
        covariance = np.zeros((len(self.by_run[0]),) * 2)
        for run in self.others:
            rows = self.by_run[run][:, : len(self.runs[run].reading_names)]
            covariance += rows @ covariances[run] @ rows.T
        return OutputContribution(
            EffectLine.OTHER_RUNS.value,
            0.5 * (covariance + covariance.T),
            inputs.degrees_of_freedom(source),
            inputs.estimated_of(source),
            estimated_with=source,
        )


def why_outside(fit: Fit, *, linear_axes: bool) -> Outside | None:
    """Why the added effects of a fit cannot be outputs; None where they can, or there are none.

    Runs that share a length of several instruments answer one another through it, too, which is not propagated.
    ``linear_axes``: stated errors of these are the same in every run, which a covariance of one run does not say.
    """
    if not fit.problem.added_names:
        return None
    if fit.problem.stays is not None:
        return Outside.SHARED_LENGTHS
    return Outside.LINEAR_AXES if linear_axes else None


def effect_outputs(fit: Fit, index: int, places: Sequence[int]) -> EffectOutputs | None:
    """The added effects of a fit beside the parameters at ``places`` of the run at ``index``; None where it has none.

    Only those that the plan determines are outputs; what is not known of the others moves the parameters as well.
    """
    problem, solution = fit.problem, fit.solution
    if not problem.added_names:
        return None
    fixed, coefficients = problem.resolved(solution.common)
    runs = tuple(measured_run(fixed, int(number), coefficients) for number in problem.runs)
    shared = shared_parameters(problem, solution)
    columns = np.flatnonzero(np.isfinite(shared.estimate))
    searched = np.array([name.endswith(".tau") for name in problem.added_names])
    by_logarithm = np.where(searched & np.isfinite(shared.estimate), shared.estimate, 1.0)
    scale = by_logarithm[columns]
    rows = np.zeros((len(columns), len(problem.added_names)))
    rows[np.arange(len(columns)), columns] = scale
    answer = shared_answer(runs, solution, index)
    outputs = answer.of_outputs(places, rows)
    return EffectOutputs(
        runs=runs,
        unknowns=solution.local,
        index=index,
        names=tuple(shared.names[column] for column in columns),
        units=tuple(shared.units[column] for column in columns),
        estimate=shared.estimate[columns],
        columns=columns,
        by_logarithm=by_logarithm,
        response=outputs[:, columns] / scale,
        by_run=tuple(outputs @ by_inputs for by_inputs in answer.by_run),
    )


@dataclass(frozen=True)
class SourceEffect:
    """What a Type B source does to all outputs: its line, and for trials what its own values do (m + a, q) beside what
    they do through the readings, and what values of other runs and days add."""

    line: OutputContribution
    drawn: OutputContribution
    beside: Array
    rest: OutputContribution


def source_effect(
    effects: EffectOutputs, of_run: Array, parts: Sequence[SourceColumns], days: Sequence[int]
) -> SourceEffect:
    """What a source adds, of which every run has one of the ``parts``; ``of_run`` (m, N) are the rows of the run at
    held effects, ``days`` (R,) those of the runs.

    Runs that share its values are moved together. Where their plans differ, so that its values are not the same ones,
    they count as others.
    """
    part = parts[effects.index]
    through = effects.padded(of_run @ part.columns)
    sharing = part.source.shared_by
    beside = effects.by_run[effects.index] @ part.columns
    groups: dict[object, Array] = {}
    for run in effects.others:
        moved = effects.by_run[run] @ parts[run].columns
        together = sharing is Sharing.ALL_RUNS or (
            sharing is Sharing.DAY and days[run] == days[effects.index]
        )
        if together and moved.shape == beside.shape:
            beside = beside + moved
            continue
        group = ("day", days[run], moved.shape) if sharing is Sharing.DAY else ("run", run)
        groups[group] = groups[group] + moved if group in groups else moved
    both = through + beside
    rest = sum((moved @ moved.T for moved in groups.values()), np.zeros((len(both), len(both))))
    plain = part.contribution(of_run)
    return SourceEffect(
        replace(plain, covariance=both @ both.T + rest),
        replace(plain, covariance=part.law_factor**2 * (both @ both.T)),
        beside,
        replace(plain, source=f"{plain.source} in other runs", covariance=rest),
    )


@dataclass(frozen=True)
class _Beyond:
    """What a number of runs, or of the means of days, scatters in an effect beyond its readings.

    ``variance`` of one of them, ``count`` of them, ``has_run``: whether the evaluated run is one, or of one.
    """

    variance: float
    count: int
    has_run: bool

    def added(self, of_run: Array, of_effect: Array) -> Array:
        """What it adds to all outputs (m + a, m + a), of which the parameters of the run answer the effect by ``of_run``
        and the effects by ``of_effect`` (m + a,).

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
    dof: float = math.inf,
) -> OutputContribution | None:
    """What runs and days scatter in the effects beyond their readings, or poses that share what no model has.

    ``of_readings`` (m + a, m + a) is what the readings of all runs give, estimated with ``dof`` degrees of freedom. None
    where they scatter no more than chance makes of readings in ``_BY_CHANCE`` of campaigns.
    """
    problem, solution = fit.problem, fit.solution
    followed = followed_effects(problem, solution)
    first = len(of_readings) - len(effects.names)
    widened = widening_of_common(problem, solution)[effects.columns]
    days = np.array([day_of[int(number)] for number in problem.runs])
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

    ``values`` (R,) of an effect, NaN where a run says nothing of it. Two runs or days, one degree of freedom, say
    hardly anything of how much a third would differ, and are left out.
    """
    stated = np.isfinite(values)
    has_run = bool(stated[index])
    values, days = values[stated], days[stated]
    means = np.array([values[days == day].mean() for day in np.unique(days)])
    samples = [values] if len(means) == len(values) else [values, means]
    samples = [sample for sample in samples if len(sample) > _FEWEST_SCATTERED]
    beyond = []
    for sample in samples:
        freedom = len(sample) - 1
        of_mean = float(sample.var(ddof=1)) / len(sample)
        limit = _largest_ratio(tail / len(samples), freedom, dof)
        if of_mean > limit * variance:
            beyond.append(_Beyond(len(sample) * (of_mean - variance), len(sample), has_run))
    return beyond


def _largest_ratio(tail: float, freedom: float, dof: float) -> float:
    """The ratio of two estimates of one variance that is exceeded with probability ``tail``."""
    if math.isinf(dof):
        return float(chi_square_quantile(tail, freedom)) / freedom
    return float(f_quantile(tail, freedom, dof))
