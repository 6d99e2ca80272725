"""The effects that were added to a model as outputs beside the parameters of one run, and what they add to these.

Their coefficients are numbers of the whole campaign: the readings of every run determine them, and what is not known
of them moves the run's own parameters, too. ``monitor.uncertainty.runs.shared_effects`` has both to first order.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from monitor.discovery import Fit
from monitor.methods.chain.shared_effects import FollowedEffects, followed_effects, shared_parameters
from monitor.records import Array
from monitor.reporting.certificate.model_effect import Outside
from monitor.reporting.run_coefficient import run_of
from monitor.sources import Sharing
from monitor.uncertainty import Inputs, OutputContribution
from monitor.uncertainty.runs.measured_run import MeasuredRun, same_plan
from monitor.uncertainty.runs.row_run import measured_run
from monitor.uncertainty.runs.shared_effects import shared_answer
from monitor.uncertainty.type_b import SourceColumns
from monitor.units import Unit


class EffectLine(StrEnum):
    """Lines of the budget: readings of the other runs, and effects that scatter more than readings do."""

    OTHER_RUNS = "readings of the other runs"
    OTHER_KNOWN = "calibrated quantities of the other runs"
    SCATTER = "scatter of the added effects"


@dataclass(frozen=True)
class EffectOutputs:
    """The a stated coefficients of added effects, after the m parameters of the run at ``index`` of ``runs``.

    ``estimate`` (a,) in internal units; ``columns`` (a,) where they stand among the c common unknowns, of
    which ``by_logarithm`` (c,) is the value of a time constant, that is searched by its logarithm, else 1; ``response``
    (m + a, a): all outputs by these coefficients; ``by_run``: what the inputs of every run do through the common
    unknowns to all outputs, (m + a, N) each. ``unknowns`` (R, p). ``followed`` has the effects as each run alone
    determines them.
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
    followed: FollowedEffects

    @property
    def others(self) -> tuple[int, ...]:
        """The runs but the evaluated one."""
        return tuple(run for run in range(len(self.runs)) if run != self.index)

    @property
    def said_by_every_run(self) -> FollowedEffects:
        """The stated effects that every run determines by itself."""
        followed = self.followed
        every = [bool(np.isfinite(values).all()) for values in followed.estimate.T]
        columns = [
            column
            for column, (name, by_every) in enumerate(zip(followed.names, every, strict=True))
            if by_every and name in self.names
        ]
        return FollowedEffects(
            tuple(followed.names[column] for column in columns),
            tuple(followed.units[column] for column in columns),
            followed.estimate[:, columns],
            followed.covariance[np.ix_(range(len(self.runs)), columns, columns)],
        )

    def padded(self, rows: Array) -> Array:
        """Rows (m, k) of the run's parameters, with zeros for the effects (m + a, k)."""
        return np.pad(rows, ((0, len(self.names)), (0, 0)))

    def contribution(self, part: OutputContribution) -> OutputContribution:
        """What acts on the run's parameters (m, m) alone, among all outputs."""
        return replace(part, covariance=np.pad(part.covariance, (0, len(self.names))))

    @property
    def linear(self) -> Array:
        """What the inputs (N,) of the evaluated run do to all outputs through the common unknowns (m + a, N).

        A calibrated quantity that is the same in every run has the columns of all runs.
        """
        readings = len(self.runs[self.index].reading_names)
        linear = self.by_run[self.index].copy()
        for run in self.others:
            of_run = self.by_run[run][:, len(self.runs[run].reading_names) :]
            linear[:, readings:] += np.where(self.runs[run].problem.extras_in_common, of_run, 0.0)
        return linear

    @property
    def known_in_other_runs(self) -> OutputContribution | None:
        """What is stated of quantities that every other run has by itself (a tool point, a drift); None where nothing
        is."""
        columns = []
        for run in self.others:
            measured = self.runs[run]
            by_itself = ~measured.problem.extras_in_common
            of_run = self.by_run[run][:, len(measured.reading_names) :] * measured.calibrated[2]
            columns.append(of_run[:, by_itself])
        moved = np.concatenate([np.zeros((len(self.by_run[0]), 0)), *columns], axis=1)
        if not moved.size:
            return None
        return OutputContribution(EffectLine.OTHER_KNOWN.value, moved @ moved.T)

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

    Only those that the plan determines, and that are not of another run alone, are outputs; what is not known of the
    others moves the parameters as well.
    """
    problem, solution = fit.problem, fit.solution
    if not problem.added_names:
        return None
    fixed, coefficients = problem.resolved(solution.common)
    runs = tuple(measured_run(fixed, int(number), coefficients) for number in problem.runs)
    shared = shared_parameters(problem, solution)
    of_this_run = [run_of(name) in (None, int(problem.runs[index])) for name in shared.names]
    columns = np.flatnonzero(np.isfinite(shared.estimate) & of_this_run)
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
        followed=followed_effects(problem, solution),
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

    Runs that share its values are moved together by those that are the same: of one target, pose or angle.
    """
    part = parts[effects.index]
    through = effects.padded(of_run @ part.columns)
    sharing = part.source.shared_by
    beside = effects.by_run[effects.index] @ part.columns
    column_of = {name: column for column, name in enumerate(_value_names(effects, parts, effects.index))}
    others: dict[Hashable, Array] = {}
    for run in effects.others:
        moved = effects.by_run[run] @ parts[run].columns
        of_day = sharing is Sharing.DAY
        together = sharing is Sharing.ALL_RUNS or (of_day and days[run] == days[effects.index])
        group: Hashable = "together" if together else ("day", days[run]) if of_day else ("run", run)
        for name, column in zip(_value_names(effects, parts, run), moved.T, strict=True):
            if together and name in column_of:
                beside[:, column_of[name]] += column
            else:
                others[group, name] = others.get((group, name), 0.0) + column
    both = through + beside
    elsewhere = np.array(list(others.values())).reshape(-1, len(both))
    rest = elsewhere.T @ elsewhere
    plain = part.contribution(of_run)
    return SourceEffect(
        replace(plain, covariance=both @ both.T + rest),
        replace(plain, covariance=part.law_factor**2 * (both @ both.T)),
        beside,
        replace(plain, source=f"{plain.source} in other runs", covariance=rest),
    )


def _value_names(effects: EffectOutputs, parts: Sequence[SourceColumns], run: int) -> tuple[Hashable, ...]:
    """The names of the values of a source in a run: those of the evaluated run where it follows the same plan (angles
    as read differ in their last digits), else its own."""
    of_run, evaluated = parts[run], parts[effects.index]
    count = of_run.columns.shape[1]
    problems = effects.runs[run].problem, effects.runs[effects.index].problem
    if count == evaluated.columns.shape[1] and same_plan(*problems):
        return tuple(range(count)) if evaluated.values is None else evaluated.values
    if of_run.values is None:
        return tuple((run, number) for number in range(count))
    return of_run.values
