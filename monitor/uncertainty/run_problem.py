"""One run of a touch problem as a measurement model: which numbers go in, and how trials are put to it.

The inputs of a run are the readings of the linear axes at every probing, in the order of the probings, and
the lengths of the calibrated distances. Rotary readings are set values and no inputs.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.effects import Context
from monitor.exceptions import DataError
from monitor.methods.least_squares import Linearisation, solve
from monitor.methods.touch import TouchProblem
from monitor.records import Array

#: Trials that are solved at once by the plain Gauss-Newton: 62 probings of 200 trials take some 100 MB.
CHUNK = 200


@dataclass(frozen=True)
class RunProblem:
    """One run: a touch problem whose context holds this run alone, with the common unknowns held.

    ``common`` (c,) are the coefficients of the effects that all runs share, at their estimates.
    """

    problem: TouchProblem
    common: Array

    @cached_property
    def linear(self) -> npt.NDArray[np.int64]:
        """The places of the linear axes in the chain."""
        joints = self.problem.context.chain.joints
        return np.array([i for i, joint in enumerate(joints) if not joint.turns], dtype=np.int64)

    @cached_property
    def signs(self) -> Array:
        """What turns a reading of each linear axis into its displacement."""
        return np.array([float(self.problem.context.chain.joints[i].sign) for i in self.linear])

    @property
    def probings(self) -> int:
        """The number of probings n."""
        return len(self.problem.context)

    @property
    def unknowns(self) -> int:
        """The number of unknowns p."""
        return len(self.problem.local_names)

    @cached_property
    def input_names(self) -> tuple[str, ...]:
        """``X 1``: reading of axis X at sequence number 1; ``S1-S2``: the distance of two targets."""
        joints = self.problem.context.chain.joints
        readings = [f"{joints[a].name} {s}" for s in self.problem.context.sequence for a in self.linear]
        return (*readings, *("-".join(d.between) for d in self.problem.distances))

    @cached_property
    def inputs(self) -> Array:
        """The inputs (N,) as measured, in mm."""
        readings = self.problem.context.positions[:, self.linear] * self.signs
        return np.concatenate([readings.ravel(), [d.length[0] for d in self.problem.distances]])

    def repeated(self, inputs: Array) -> TouchProblem:
        """The touch problem whose runs are the trials ``inputs`` (N, B)."""
        context = self.problem.context
        trials = inputs.shape[1]
        count = self.probings
        readings = inputs[: count * len(self.linear)].T.reshape(trials * count, len(self.linear))
        positions = np.tile(context.positions, (trials, 1))
        positions[:, self.linear] = readings * self.signs
        several = _rows(context, np.tile(np.arange(count), trials))
        lengths = inputs[count * len(self.linear) :]
        return replace(
            self.problem,
            context=replace(several, positions=positions, run=np.repeat(np.arange(trials), count)),
            sigma=np.tile(self.problem.sigma, (trials, 1)),
            distances=tuple(
                replace(distance, length=lengths[i]) for i, distance in enumerate(self.problem.distances)
            ),
        )

    def gradient(self, unknowns: Array, inputs: Array) -> Array:
        """J^T r (p, B), whitened, at ``unknowns`` (p, B) and ``inputs`` (N, B): plain, exact, slow."""
        at = self.repeated(inputs).linearise(np.ascontiguousarray(unknowns.T), self.common)
        return np.asarray(np.einsum("rnp,rn->pr", at.local, at.residual))

    def solve(self, inputs: Array, start: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Gauss-Newton with a fresh Jacobian in every step for trials ``inputs`` (N, B).

        From ``start`` (p,); returns the unknowns (p, B), NaN where not converged, and which converged (B,).
        """
        trials = inputs.shape[1]
        found = np.full((self.unknowns, trials), np.nan)
        for first in range(0, trials, CHUNK):
            chosen = slice(first, min(first + CHUNK, trials))
            try:
                found[:, chosen] = self._solve(inputs[:, chosen], start)
            except (DataError, np.linalg.LinAlgError):
                if inputs[:, chosen].shape[1] == 1:
                    continue
                for trial in range(chosen.start, chosen.stop):
                    found[:, [trial]] = self.solve(inputs[:, [trial]], start)[0]
        return found, np.all(np.isfinite(found), axis=0)

    def _solve(self, inputs: Array, start: Array) -> Array:
        several = self.repeated(inputs)
        fixed = np.zeros(0)

        # The common unknowns are held: they enter the residual, and take no step.
        def linearise(local: Array, _: Array) -> Linearisation:
            at = several.linearise(local, self.common)
            return replace(at, common=at.common[..., :0])

        begin = np.tile(start, (inputs.shape[1], 1))
        return np.asarray(solve(linearise, begin, fixed).local.T)


def _rows(context: Context, rows: npt.NDArray[np.int64]) -> Context:
    """A context of the chosen rows, in that order, with repetitions."""
    chosen: dict[str, Any] = {
        field.name: value[rows]
        for field in fields(Context)
        if isinstance(value := getattr(context, field.name), np.ndarray)
    }
    chosen["columns"] = {name: value[rows] for name, value in context.columns.items()}
    return replace(context, **chosen)


def run_problem(problem: TouchProblem, run: int, common: Array | None = None) -> RunProblem:
    """The problem of one ``run``; ``common`` (c,) defaults to zeros, right where no effect was added.

    Raises DataError for a run that is not there.
    """
    if run not in problem.runs:
        raise DataError(f"no run {run}; there are runs {', '.join(map(str, problem.runs))}")
    place = int(np.flatnonzero(problem.runs == run)[0])
    rows = problem.context.run == run
    single = replace(
        problem,
        context=_rows(problem.context, np.flatnonzero(rows)),
        sigma=problem.sigma[rows],
        distances=tuple(replace(d, length=d.length[[place]]) for d in problem.distances),
    )
    held = np.zeros(len(problem.added_names)) if common is None else np.asarray(common, dtype=np.float64)
    return RunProblem(single, held)


def repeated_readings(problem: TouchProblem) -> Array:
    """The readings (runs, 3n) of all runs of one plan, as ``overall`` and ``pooled_by_day`` want them.

    Raises DataError where a run probed other targets or indexations than the first.
    """
    runs = [run_problem(problem, int(run)) for run in problem.runs]
    first = runs[0]
    turning = [i for i in range(len(first.problem.context.chain.joints)) if i not in first.linear]
    for number, one in zip(problem.runs, runs, strict=True):
        same = len(one.problem.context) == len(first.problem.context) and np.array_equal(
            one.problem.context.target, first.problem.context.target
        )
        if not same or not np.allclose(
            one.problem.context.positions[:, turning], first.problem.context.positions[:, turning]
        ):
            raise DataError(
                f"run {number} follows another plan than run {problem.runs[0]}; a covariance of the readings needs "
                f"the same targets and indexations in the same order"
            )
    count = first.probings * len(first.linear)
    return np.array([one.inputs[:count] for one in runs])
