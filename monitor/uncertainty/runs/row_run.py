"""One run of any method as a measurement model: the inputs are the numbers that its rows tell.

An input is the deviation of a row's number from what was read, in mm: 0 as measured. So every method whose problem is a
``ChainProblem`` has an uncertainty, whatever it measures. Moving the axes of a touch by the deviation instead changes
the residual by the same to products of a deviation with an error of the machine (1 µm and 100 µrad: 0.1 nm).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import Linearisation
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array
from monitor.uncertainty.runs.measured_run import MeasuredRun, rows_of_run, same_plan
from monitor.uncertainty.runs.touched_run import touch_run


@dataclass(frozen=True)
class _Shifted:
    """A problem whose runs are trials, with ``added`` (B, N) to its whitened residuals; ``is_input`` (M,) are those of
    its residuals that are numbers."""

    problem: ChainProblem
    added: Array
    is_input: npt.NDArray[np.bool_]

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """As ``ChainProblem.linearise``, at the trials' own readings."""
        at = self.problem.linearise(local, common)
        if not self.is_input.all():
            residual, by_local, by_common = (
                rows[:, self.is_input] for rows in (at.residual, at.local, at.common)
            )
            at = replace(at, residual=residual, local=by_local, common=by_common)
        return replace(at, residual=at.residual + self.added)


@dataclass(frozen=True)
class RowRun(MeasuredRun):
    """One run of any method: inputs are deviations of what its rows tell, then of its calibrated quantities.

    A calibrated quantity has no unit here: its deviation is in standard uncertainties.
    """

    @cached_property
    def reading_names(self) -> tuple[str, ...]:
        """``normal 7``: the number named normal at sequence number 7."""
        names = (f"{what} {s}" for s in self.problem.context.sequence for what in self.problem.components)
        return tuple(compress(names, self._is_number))

    @cached_property
    def _is_number(self) -> npt.NDArray[np.bool_]:
        """Which entries (n d,) of the rows are numbers."""
        return self.problem.is_number.ravel()

    @property
    def numbers(self) -> int:
        """How many numbers the rows have."""
        return int(np.count_nonzero(self._is_number))

    @property
    def stated(self) -> Array:
        """Those that the problem weighs its rows with; 0 where a row has no weight."""
        sigma = self.problem.sigma.ravel()[self._is_number]
        return np.where(np.isfinite(sigma), sigma, 0.0)

    @property
    def calibrated(self) -> tuple[tuple[str, ...], str, Array]:
        """The calibrated quantities, in standard uncertainties."""
        return self.problem.extra_names, "1", np.ones(len(self.problem.extra_names))

    @cached_property
    def inputs(self) -> Array:
        """No deviation (N,)."""
        return np.zeros(self.numbers + len(self.problem.extra_names))

    def whitened(self, inputs: Array) -> Array:
        """What inputs (N, B) add to the whitened residuals (N, B)."""
        return np.asarray(inputs / self.weighed_by[:, None])

    @property
    def weighed_by(self) -> Array:
        """The standard uncertainty (N,) by which each input is whitened: infinite where it has no weight."""
        sigma = self.problem.sigma.ravel()[self._is_number]
        return np.concatenate([sigma, np.ones(len(self.problem.extra_names))])

    def by_inputs(self, unknowns: Array, by_residual: Array) -> Array:
        """As ``MeasuredRun.by_inputs``; inputs only add to the residuals."""
        is_input = np.concatenate([self._is_number, np.ones(len(self.problem.extra_names), dtype=bool)])
        return np.asarray(by_residual[:, is_input] / self.weighed_by)

    def by_input(self, unknowns: Array) -> Array:
        """Derivatives (p, N) of J^T r at ``unknowns`` (p,) by the inputs, exact: they only add to the residuals."""
        at = self.repeated(self.inputs[:, None]).linearise(unknowns[None], self.common)
        return np.asarray(at.local[0].T / self.weighed_by)

    def repeated(self, inputs: Array) -> _Shifted:
        """The problem whose runs are the trials ``inputs`` (N, B)."""
        trials, count = inputs.shape[1], self.probings
        several = self.problem.taken(np.tile(np.arange(count), trials), np.repeat(np.arange(trials), count))
        is_input = np.concatenate([self._is_number, np.ones(len(self.problem.extra_names), dtype=bool)])
        return _Shifted(several, self.whitened(inputs).T, is_input)


def measured_run(problem: ChainProblem, run: int, common: Array | None = None) -> MeasuredRun:
    """The problem of one ``run``; ``common`` (c,) defaults to zeros, right where no effect was added.

    Raises DataError for a run that is not there.
    """
    if run not in problem.runs:
        raise DataError(f"no run {run}; there are runs {', '.join(map(str, problem.runs))}")
    held = np.zeros(len(problem.added_names)) if common is None else np.asarray(common, dtype=np.float64)
    if isinstance(problem, TouchProblem):
        return touch_run(problem, run, held)
    return RowRun(rows_of_run(problem, run), held)


def repeated_readings(problem: ChainProblem) -> Array:
    """The readings (runs, N less the calibrated quantities) of all runs of one plan, as ``overall`` and
    ``pooled_by_day`` want them.

    For rows they are the residuals of every run at one and the same state: only their differences have a meaning.
    Raises DataError where a run probed other targets or indexations than the first.
    """
    runs = [measured_run(problem, int(run)) for run in problem.runs]
    for number, single in zip(problem.runs, runs, strict=True):
        if not same_plan(single.problem, runs[0].problem):
            raise DataError(
                f"run {number} follows another plan than run {problem.runs[0]}; a covariance of the readings needs "
                f"the same targets and indexations in the same order"
            )
    if isinstance(problem, TouchProblem):
        return np.array([single.inputs[: len(single.reading_names)] for single in runs])
    start, common = runs[0].problem.start, problem.common_start
    is_number = runs[0].problem.is_number
    return np.array([single.problem.vectors(start, common)[is_number] for single in runs])
