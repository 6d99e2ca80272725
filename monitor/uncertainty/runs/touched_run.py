"""One run of touched balls as a measurement model: readings and calibrated distances go in.

The inputs are the readings of the linear axes at every probing, in the order of the probings, and the lengths of the
calibrated distances. Rotary readings are set values and no inputs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.machine import MOTION
from monitor.methods.chain.touch import TouchProblem
from monitor.records import Array
from monitor.uncertainty.runs.measured_run import MeasuredRun, rows_of_run


@dataclass(frozen=True)
class TouchedRun(MeasuredRun):
    """One run of touched balls: the inputs are the readings of the linear axes and the calibrated distances."""

    problem: TouchProblem

    @cached_property
    def linear(self) -> npt.NDArray[np.int64]:
        """The places of the linear axes in the chain."""
        joints = self.problem.context.chain.joints
        return np.array([i for i, joint in enumerate(joints) if not joint.turns], dtype=np.int64)

    @cached_property
    def signs(self) -> Array:
        """What turns a reading of each linear axis into its displacement."""
        return np.array([float(self.problem.context.chain.joints[i].sign) for i in self.linear])

    @cached_property
    def reading_names(self) -> tuple[str, ...]:
        """``X 1``: reading of axis X at sequence number 1."""
        joints = self.problem.context.chain.joints
        return tuple(f"{joints[a].name} {s}" for s in self.problem.context.sequence for a in self.linear)

    @property
    def stated(self) -> Array:
        """The probe's, for every linear axis."""
        sigma = self.problem.sigma
        return np.repeat(np.sqrt(np.mean(sigma**2, axis=1)), len(self.linear))

    @property
    def calibrated(self) -> tuple[tuple[str, ...], str, Array]:
        """``S1-S2``: the distance of two targets."""
        distances = self.problem.distances
        return self.problem.extra_names, "mm", np.array([d.standard_uncertainty for d in distances])

    @cached_property
    def inputs(self) -> Array:
        """The inputs (N,) as measured, in mm."""
        readings = self._read[:, self.linear] * self.signs
        return np.concatenate([readings.ravel(), [d.length[0] for d in self.problem.distances]])

    @property
    def _read(self) -> Array:
        """Where the joints (n, J) were read; the chain may stand at expected places beside them."""
        problem = self.problem
        return problem.context.positions if problem.read is None else problem.read

    def by_reading(self, by_error: Array) -> Array:
        """What a reading of each linear axis moves (n, 3, axes), from the derivatives (n, 3, J, 2, 6) by errors."""
        joints = self.problem.context.chain.joints
        along = np.array([joints[index].direction for index in self.linear]) * self.signs[:, None]
        return np.asarray(np.einsum("nrac,ac->nra", by_error[:, :, self.linear, MOTION, :3], along))

    def by_inputs(self, unknowns: Array, by_residual: Array) -> Array:
        """As ``MeasuredRun.by_inputs``; what a reading does to errors that depend on it is neglected (1e-4)."""
        pose = self.problem.evaluated(unknowns[None], self.common, jacobian=True)
        assert pose.by_error is not None
        moved = self.by_reading(pose.by_error) / self.problem.sigma[:, :, None]
        of_rows = by_residual[:, : moved.shape[0] * moved.shape[1]].reshape(-1, *moved.shape[:2])
        readings = np.einsum("knr,nra->kna", of_rows, moved).reshape(len(by_residual), -1)
        u = np.array([distance.standard_uncertainty for distance in self.problem.distances])
        lengths = -by_residual[:, by_residual.shape[1] - len(u) :] / u
        return np.concatenate([readings, lengths], axis=1)

    def repeated(self, inputs: Array) -> TouchProblem:
        """The touch problem whose runs are the trials ``inputs`` (N, B)."""
        trials, count = inputs.shape[1], self.probings
        readings = inputs[: count * len(self.linear)].T.reshape(trials * count, len(self.linear))
        several = self.problem.taken(np.tile(np.arange(count), trials), np.repeat(np.arange(trials), count))
        positions = np.tile(self._read, (trials, 1))
        positions[:, self.linear] = readings * self.signs
        positions += np.tile(self.problem.context.positions - self._read, (trials, 1))
        lengths = inputs[count * len(self.linear) :]
        return replace(
            several,
            context=replace(several.context, positions=positions),
            distances=tuple(
                replace(distance, length=lengths[i]) for i, distance in enumerate(self.problem.distances)
            ),
        )


def touch_run(problem: TouchProblem, run: int, common: Array) -> TouchedRun:
    """One ``run`` of touched balls, with the common unknowns held at ``common`` (c,)."""
    index = int(np.flatnonzero(problem.runs == run)[0])
    single = replace(
        rows_of_run(problem, run),
        distances=tuple(replace(d, length=d.length[[index]]) for d in problem.distances),
    )
    return TouchedRun(single, common)
