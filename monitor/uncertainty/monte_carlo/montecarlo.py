"""The measurement model of one run for Monte Carlo: every trial is the full non-linear identification.

The estimator is the least-squares point of the true non-linear problem: J(theta)^T r(theta) = 0 with the exact
Jacobian of the exact chain at the trial's own readings. It is not the fixed point of a fixed pseudo-inverse,
which solves J_0^T r = 0 and is off by up to 3e-3 u in single trials.

A trial starts at the implicit linear map (``sensitivity``) and moves by the fixed inverse of the exact Hessian
applied to the exact gradient. Convergence is certified, not hoped for. Lengths are measured by the Hessian at the
centre; with L the Lipschitz constant of the Hessian so scaled, h = L d is a Kantorovich-type number of a trial
at distance d from the centre: for h <= 1/2 the iteration contracts by at least h, so a move of length s leaves
less than h s / (1 - h). Moves are made until that is below ``TOLERANCE`` standard uncertainties; what is really
left is some hundred times less. Trials with a larger h, or that contract less than promised, are solved by plain
Gauss-Newton and counted. L is the largest value found at random points, with a margin: an estimate, no proof.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.uncertainty.covariance import Inputs
from monitor.uncertainty.roots import covariance_root
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.program import LARGEST_ANGLE
from monitor.uncertainty.runs.sensitivity import Sensitivity, sensitivity_of

#: What a trial may be away from its least-squares point, in standard uncertainties: two and a half
#: orders below the smallest numerical tolerance of two significant digits, 0.005 u.
TOLERANCE = 1e-5
#: Contraction is guaranteed up to this Kantorovich number.
LIMIT = 0.5
#: The Lipschitz constant is the largest found at so many random points, times a margin.
_POINTS, _MARGIN = 24, 2.0
_MOST_MOVES = 6


@dataclass
class _Counts:
    """What happened to the trials so far, shared by the threads."""

    trials: int = 0
    moves: int = 0
    by_gauss_newton: int = 0
    not_converged: int = 0
    largest_number: float = 0.0
    largest_error: float = 0.0
    lock: threading.Lock = field(default_factory=threading.Lock)


@dataclass(frozen=True)
class RunEstimator:
    """The model of one run: call it with inputs (trials, N), get outputs (trials, m) and convergence.

    ``u`` (p,) are first-order standard uncertainties; ``lipschitz`` is that of the Hessian; a length by the
    Hessian is at most ``worst`` standard uncertainties of any unknown. ``counts`` runs on over all calls.
    """

    run: MeasuredRun
    sensitivity: Sensitivity
    outputs: tuple[str, ...]
    u: Array
    lipschitz: float
    worst: float
    counts: _Counts = field(default_factory=_Counts)

    @property
    def by_gauss_newton(self) -> int:
        """How many trials had to be solved by plain Gauss-Newton so far."""
        return self.counts.by_gauss_newton

    @property
    def largest_error(self) -> float:
        """The largest bound of a trial's distance from its least-squares point, in standard uncertainties."""
        return self.counts.largest_error

    def __call__(self, block: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Outputs (trials, m) and which trials converged (trials,) for inputs ``block`` (trials, N)."""
        inputs = np.ascontiguousarray(np.asarray(block).T)
        theta, converged = self.unknowns(inputs)
        return np.asarray(theta[self._places].T), converged

    @property
    def _places(self) -> npt.NDArray[np.int64]:
        return self.sensitivity.places(self.outputs)

    def unknowns(self, inputs: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """All unknowns (p, B) at ``inputs`` (N, B), and which trials converged (B,)."""
        # A trial that runs away may overflow; it is found by its numbers, not by a warning.
        with np.errstate(over="ignore", invalid="ignore"):
            return self._unknowns(inputs)

    def _unknowns(self, inputs: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        at = self.sensitivity
        theta = at.matrix @ inputs
        theta += (at.unknowns - at.matrix @ at.inputs)[:, None]
        number = self.lipschitz * _lengths(at.metric @ (theta - at.unknowns[:, None]))
        contracts = number <= LIMIT
        if at.compiled:
            contracts &= self._small_angles(theta)
        last = np.full(len(number), np.inf)
        moves = 0
        while moves < _MOST_MOVES:
            moves += 1
            move = at.half.T @ at.gradient(theta, inputs)
            theta -= at.half @ move
            length = _lengths(move)
            contracts &= (length <= LIMIT * last) | (self.worst * length < 0.1 * TOLERANCE)
            last = length
            error = self.worst * number * length / np.maximum(1.0 - number, LIMIT)
            if not np.any(contracts & (error > TOLERANCE)):
                break
        good = contracts & (error <= TOLERANCE) & np.all(np.isfinite(theta), axis=0)
        return self._finish(inputs, theta, good, number, error, moves)

    def _small_angles(self, theta: Array) -> npt.NDArray[np.bool_]:
        """Whether the error angles are those for which the compiled series are exact."""
        turns = [i for i, name in enumerate(self.run.problem.base_names) if name[1:2] in ("A", "B", "C")]
        return np.asarray(np.all(np.abs(theta[turns]) < LARGEST_ANGLE, axis=0))

    def _finish(
        self,
        inputs: Array,
        theta: Array,
        good: npt.NDArray[np.bool_],
        number: Array,
        error: Array,
        moves: int,
    ) -> tuple[Array, npt.NDArray[np.bool_]]:
        unsolved = np.flatnonzero(~good)
        if len(unsolved):
            theta[:, unsolved], solved = self.run.solve(inputs[:, unsolved], self.sensitivity.unknowns)
            good = good.copy()
            good[unsolved] = solved
        with self.counts.lock:
            self.counts.trials += len(good)
            self.counts.moves += moves * len(good)
            self.counts.by_gauss_newton += len(unsolved)
            self.counts.not_converged += int(np.sum(~good))
            self.counts.largest_number = max(self.counts.largest_number, float(np.max(number)))
            certified = np.delete(error, unsolved)
            self.counts.largest_error = max(self.counts.largest_error, float(np.max(certified, initial=0.0)))
        return theta, good


def run_estimator(
    run: MeasuredRun, inputs: Inputs, outputs: tuple[str, ...] | None = None, *, seed: int = 0
) -> RunEstimator:
    """The Monte Carlo model of one ``run`` whose ``inputs`` are its readings and distances, in that order.

    ``outputs`` names unknowns; by default every parameter of the model that the plan determines. ``seed`` is
    that of the points at which the Lipschitz constant is found. Raises DataError where the inputs are not those
    of the run, or an output is not determined by the plan.
    """
    if inputs.names != run.input_names:
        raise DataError(
            f"the inputs must be the run's {len(run.input_names)} readings and distances in order, from "
            f"'{run.input_names[0]}' to '{run.input_names[-1]}', but run from '{inputs.names[0]}' to "
            f"'{inputs.names[-1]}' ({len(inputs.names)})"
        )
    at = sensitivity_of(run, inputs.estimate)
    if outputs is None:
        pairs = zip(run.problem.local_names, at.determined, strict=True)
        reported = set(run.problem.base_names)
        outputs = tuple(name for name, determined in pairs if determined and name in reported)
        if not outputs:
            raise DataError(
                f"the plan determines none of {', '.join(run.problem.base_names)}: probe more poses"
            )
    at.places(outputs)
    root = covariance_root(inputs.covariance).root
    u = np.sqrt(np.sum((at.matrix @ root) ** 2, axis=1))
    varies = at.determined & (u > 0.0)
    worst = float(np.max(np.sqrt(np.diag(at.inverse))[varies] / u[varies], initial=0.0))
    return RunEstimator(run, at, outputs, u, _lipschitz(at, root, np.random.default_rng(seed)), worst)


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", vectors, vectors)))


def _lipschitz(at: Sensitivity, root: Array, rng: np.random.Generator) -> float:
    """Largest change of the Hessian, in its own scale at the centre, per length of the move that made it.

    In the spectral norm, at random points of the inputs' distribution thrice as far out as drawn.
    """
    moved = 3.0 * root @ rng.standard_normal((root.shape[1], _POINTS))
    centre = _hessian(at, at.unknowns, at.inputs)
    largest = 0.0
    for point in range(_POINTS):
        away = at.matrix @ moved[:, point]
        distance = float(np.linalg.norm(at.metric @ away))
        hessian = _hessian(at, at.unknowns + away, at.inputs + moved[:, point])
        change = float(np.linalg.norm(at.half.T @ (hessian - centre) @ at.half, 2))
        largest = max(largest, change / distance if distance > 0.0 else 0.0)
    return _MARGIN * largest


def _hessian(at: Sensitivity, theta: Array, x: Array) -> Array:
    count = len(theta)
    moves = np.concatenate([np.diag(at.steps), -np.diag(at.steps)], axis=1)
    gradients = at.gradient(theta[:, None] + moves, np.repeat(x[:, None], 2 * count, axis=1))
    hessian = (gradients[:, :count] - gradients[:, count:]) / (2.0 * at.steps)
    return np.asarray(0.5 * (hessian + hessian.T))
