"""The effects that were added to a model as outputs beside the parameters of one run, and what they add to these.

Their coefficients are numbers of the whole campaign: the readings of every run determine them, and what is not known
of them moves the run's own parameters, too. ``monitor.uncertainty.runs.shared_effects`` has both to first order.
"""

from __future__ import annotations

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
from monitor.statistics.tails import chi_square_quantile
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


#: Two days, or two runs, count from a difference on that chance makes in this part of campaigns.
_TWO_DIFFER = 0.05


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

    def of_other_runs(self, inputs: Inputs) -> OutputContribution:
        """What the readings of the other runs add, each with the covariance that those of the evaluated one have."""
        evaluated = self.runs[self.index]
        readings = len(evaluated.reading_names)
        of_readings = inputs.covariance[:readings, :readings]
        source = inputs.sources[0]
        estimated = inputs.estimated_of(source)
        known_each = estimated is Estimated.SCALE
        with np.errstate(invalid="ignore", divide="ignore"):
            scale = np.sqrt(np.diag(of_readings)) / evaluated.stated
        factor = float(np.max(scale[np.isfinite(scale)], initial=0.0))
        covariance = np.zeros((len(self.by_run[0]),) * 2)
        for run in self.others:
            rows = self.by_run[run][:, : len(self.runs[run].reading_names)]
            stated = self.runs[run].stated
            alike = stated.shape == evaluated.stated.shape and bool(np.allclose(stated, evaluated.stated))
            if known_each and not alike:
                spread = rows * (factor * stated)
                covariance += spread @ spread.T
            else:
                covariance += rows @ of_readings @ rows.T
        covariance = 0.5 * (covariance + covariance.T)
        return OutputContribution(
            EffectLine.OTHER_RUNS.value, covariance, inputs.degrees_of_freedom(source), estimated
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


def scatter_of_effects(
    effects: EffectOutputs, fit: Fit, day_of: Mapping[int, int], of_readings: Array
) -> OutputContribution | None:
    """What runs and days scatter in the effects beyond their readings, or poses that share what no model has.

    ``of_readings`` (m + a, m + a) is what the readings of all runs give. None where they scatter no more.
    """
    problem, solution = fit.problem, fit.solution
    followed = followed_effects(problem, solution)
    first = len(of_readings) - len(effects.names)
    widened = widening_of_common(problem, solution)[effects.columns]
    days = np.array([day_of[int(number)] for number in problem.runs])
    missing = np.zeros(len(effects.names))
    fewest = np.inf
    for column, name in enumerate(effects.names):
        variance = float(of_readings[first + column, first + column])
        poses = (float(widened[column]) ** 2 - 1.0) * variance
        more, dof = 0.0, np.inf
        if name in followed.names:
            values = followed.estimate[:, followed.names.index(name)]
            more, dof = _beyond(values, days, variance)
        missing[column] = max(poses, more, 0.0)
        if more > poses:
            fewest = min(fewest, dof)
    if not np.any(missing):
        return None
    root = effects.response * np.sqrt(missing)
    return OutputContribution(EffectLine.SCATTER.value, root @ root.T, float(fewest), Estimated.SCALE)


def _beyond(values: Array, days: npt.NDArray[np.int64], variance: float) -> tuple[float, float]:
    """The variance of a mean by the scatter of runs or of the days' means beyond ``variance``, with its degrees of
    freedom; 0 where they scatter no more."""
    stated = np.isfinite(values)
    values, days = values[stated], days[stated]
    largest = (0.0, np.inf)
    means = np.array([values[days == day].mean() for day in np.unique(days)])
    for sample in (values, means):
        if len(sample) < 2:
            continue
        of_mean = float(sample.var(ddof=1)) / len(sample)
        # One degree of freedom says hardly anything, and would widen every interval.
        least = float(chi_square_quantile(_TWO_DIFFER, 1.0)) if len(sample) == 2 else 1.0
        if of_mean > least * variance and of_mean - variance > largest[0]:
            largest = (of_mean - variance, float(len(sample) - 1))
    return largest
