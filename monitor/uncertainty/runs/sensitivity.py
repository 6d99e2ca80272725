"""Sensitivity of the least-squares point to its inputs, by the implicit-function theorem, exact.

At the least-squares point g(theta, x) = J^T r is zero, so d theta / dx = -H^-1 dg/dx with H = dg/d theta, the
exact Hessian: residual curvature is in it. One factorisation, nothing is solved again. H and dg/dx are central
differences of the exact gradient; with steps of 3 µm their error is near 1e-10 of themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import MEMBER_SHARE, RANK_TOLERANCE
from monitor.records import Array
from monitor.uncertainty.runs.expansion import expansion_of
from monitor.uncertainty.runs.measured_run import MeasuredRun
from monitor.uncertainty.runs.program import compile_program
from monitor.uncertainty.runs.row_run import RowRun
from monitor.uncertainty.runs.touched_run import TouchedRun

Gradient = Callable[[Array, Array], Array]

#: Half the step of the differences, in mm at the tip: truncation falls and rounding grows below it.
STEP = 3e-3
#: What is known beforehand is moved by so many standard uncertainties at most: across the direction in which its
#: readings go a beam would have to turn by 0.1 rad to move them by ``STEP``.
KNOWN_STEP = 3.0
#: An expanded gradient may move the least-squares point of trials so many standard uncertainties out by this part of
#: one: a tenth of what a trial is solved to.
TRIALS_OUT, SAME_POINT = 3.0, 1e-6
#: Newton steps to the centre's least-squares point; each gains the digits of the one before.
_POLISH = 4


@dataclass(frozen=True)
class Sensitivity:
    """The least-squares point of one run and what it does near its inputs.

    ``unknowns`` (p,) at ``inputs`` (N,); ``matrix`` (p, N) is d theta / dx; ``inverse`` (p, p) that of the
    exact Hessian, in the space that the plan determines; ``half`` (p, rank) its root and ``metric`` (rank, p)
    what measures a distance by the Hessian, ``metric @ half`` = 1. ``determined`` (p,) says which unknowns the
    plan determines, ``rank`` how many directions; ``steps`` (p,) move the tip by about ``STEP``. ``gradient``
    computes J^T r for many trials; ``compiled`` says whether by the compiled program.
    """

    names: tuple[str, ...]
    input_names: tuple[str, ...]
    unknowns: Array
    inputs: Array
    matrix: Array
    inverse: Array
    half: Array
    metric: Array
    determined: npt.NDArray[np.bool_]
    rank: int
    steps: Array
    gradient: Gradient
    compiled: bool

    def rows(self, names: tuple[str, ...]) -> Array:
        """The rows of ``matrix`` of the named unknowns; DataError for one that the plan does not determine."""
        return np.asarray(self.matrix[self.places(names)])

    def places(self, names: tuple[str, ...]) -> npt.NDArray[np.int64]:
        """Where the named unknowns stand."""
        for name in names:
            if name not in self.names:
                raise DataError(f"no unknown '{name}'; there are {', '.join(self.names)}")
            if not self.determined[self.names.index(name)]:
                raise DataError(f"the plan does not determine {name}: it has no value and no uncertainty")
        return np.array([self.names.index(name) for name in names], dtype=np.int64)


def sensitivity_of(run: MeasuredRun, inputs: Array | None = None, start: Array | None = None) -> Sensitivity:
    """The sensitivity of one run at ``inputs`` (N,), by default the run's own readings.

    ``start`` (p,) is where the search for the least-squares point begins. Raises DataError where it fails.
    """
    x = run.inputs if inputs is None else np.asarray(inputs, dtype=np.float64)
    if x.shape != (len(run.input_names),):
        raise DataError(f"this run has {len(run.input_names)} inputs, not {x.shape}")
    solved, converged = run.solve(x[:, None], run.problem.start[0] if start is None else start)
    if not converged[0]:
        raise DataError("the identification of this run did not converge")
    theta = solved[:, 0]
    space, determined, steps = _space(run, x, theta)
    fast = _fast(run, theta, steps)
    quick = fast is not None and (isinstance(run, RowRun) or _agree(fast, run.gradient, theta, x, steps))
    gradient: Gradient = fast if fast is not None and quick else run.gradient
    begin = theta
    theta, hessian, half = _polished(gradient, begin, x, steps, space)
    if isinstance(run, RowRun) and not _same_points(gradient, run, theta, x, half):
        quick, gradient = False, run.gradient
        theta, hessian, half = _polished(gradient, begin, x, steps, space)
    inverse = half @ half.T
    if isinstance(run, RowRun):
        by_input = run.by_input(theta)
    else:
        by_input = _differences(gradient, theta, x, STEP * np.eye(len(x)), of_inputs=True) / (2.0 * STEP)
    return Sensitivity(
        names=run.problem.local_names,
        input_names=run.input_names,
        unknowns=theta,
        inputs=x,
        matrix=-inverse @ by_input,
        inverse=inverse,
        half=half,
        metric=half.T @ hessian,
        determined=determined,
        rank=space.shape[1],
        steps=steps,
        gradient=gradient,
        compiled=quick and isinstance(run, TouchedRun),
    )


def _polished(
    gradient: Gradient, theta: Array, x: Array, steps: Array, space: Array
) -> tuple[Array, Array, Array]:
    """The least-squares point (p,) of a gradient near ``theta``, the Hessian there and the root of its inverse."""
    for _ in range(_POLISH):
        hessian = _differences(gradient, theta, x, np.diag(steps), of_inputs=False) / (2.0 * steps)
        hessian = 0.5 * (hessian + hessian.T)
        half = _half(hessian, space)
        step = half @ (half.T @ gradient(theta[:, None], x[:, None])[:, 0])
        theta = theta - step
        if float(np.max(np.abs(step / steps))) < 1e-9:
            break
    return theta, hessian, half


def _same_points(gradient: Gradient, run: RowRun, theta: Array, x: Array, half: Array) -> bool:
    """Whether trials have the same least-squares point by a gradient as by the exact one; differences are measured by
    the Hessian, whose inverse has the root ``half`` (p, rank)."""
    rng = np.random.default_rng(3)
    thetas = theta[:, None] + TRIALS_OUT * half @ rng.standard_normal((half.shape[1], 3))
    weighed = np.where(np.isfinite(run.weighed_by), run.weighed_by, 0.0)
    inputs = x[:, None] + TRIALS_OUT * weighed[:, None] * rng.standard_normal((len(x), 3))
    off = half.T @ (gradient(thetas, inputs) - run.gradient(thetas, inputs))
    return bool(np.all(np.linalg.norm(off, axis=0) <= SAME_POINT))


def _fast(run: MeasuredRun, theta: Array, steps: Array) -> Gradient | None:
    """A gradient of many trials, where there is one for such a run: compiled, or expanded to second order."""
    if isinstance(run, RowRun):
        return expansion_of(run, theta, steps).gradient
    assert isinstance(run, TouchedRun)
    program = compile_program(run)
    if program is None:
        return None
    # The compiler takes half a second to import: commands that identify nothing do not wait for it.
    from monitor.uncertainty.runs.kernel import gradient_of

    return lambda unknowns, trials: gradient_of(program, unknowns, trials)


def _agree(first: Gradient, second: Gradient, theta: Array, x: Array, steps: Array) -> bool:
    """Whether both gradients are the same near the centre, to 1e-7 of their size.

    The program takes a shape of the model as straight between a reading and its trial. Where that is not good
    enough (hat functions with a node nearby, a plug-in's shape) the plain way is right.
    """
    rng = np.random.default_rng(3)
    thetas = theta[:, None] + steps[:, None] * rng.standard_normal((len(theta), 3))
    inputs = x[:, None] + STEP * rng.standard_normal((len(x), 3))
    right = second(thetas, inputs)
    size = np.max(np.abs(right), axis=1, keepdims=True)
    return bool(np.all(np.abs(first(thetas, inputs) - right) <= 1e-7 * size))


def _space(run: MeasuredRun, inputs: Array, theta: Array) -> tuple[Array, npt.NDArray[np.bool_], Array]:
    """Basis (p, rank) of what the plan determines, which unknowns that is (p,), and steps (p,) of STEP mm."""
    jacobian = run.repeated(inputs[:, None]).linearise(theta[None], run.common).local[0]
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    _, values, vectors = np.linalg.svd(jacobian / scale, full_matrices=False)
    keep = values > RANK_TOLERANCE * values[0]
    share = np.max(np.abs(vectors[~keep]), axis=0, initial=0.0)
    weighed = np.isfinite(run.problem.sigma)
    sigma = float(np.sqrt(np.mean(run.problem.sigma[weighed] ** 2)))
    largest = np.max(np.abs(jacobian[: run.numbers]), axis=0) * sigma
    steps = STEP / np.where(largest > 0.0, largest, 1.0)
    if isinstance(run, RowRun):
        by_prior = np.max(np.abs(jacobian[run.numbers :]), axis=0, initial=0.0)
        steps = np.where(
            by_prior * steps > KNOWN_STEP, KNOWN_STEP / np.where(by_prior > 0.0, by_prior, 1.0), steps
        )
    return (vectors[keep] / scale).T, share < MEMBER_SHARE, steps


def _half(hessian: Array, space: Array) -> Array:
    """The root (p, rank) of the Hessian's inverse within ``space``; DataError away from a minimum."""
    try:
        lower = np.linalg.cholesky(space.T @ hessian @ space)
    except np.linalg.LinAlgError:
        raise DataError(
            "the point found is no minimum of the sum of squares: the residuals are too large for this model"
        ) from None
    return np.asarray(space @ np.linalg.inv(lower).T)


def _differences(gradient: Gradient, theta: Array, x: Array, moves: Array, *, of_inputs: bool) -> Array:
    """gradient at plus minus that at minus ``moves`` (k, k), one column a move: (p, k)."""
    count = len(moves)
    both = np.concatenate([moves, -moves], axis=1)
    thetas = np.repeat(theta[:, None], 2 * count, axis=1)
    inputs = np.repeat(x[:, None], 2 * count, axis=1)
    if of_inputs:
        inputs = inputs + both
    else:
        thetas = thetas + both
    gradients = gradient(thetas, inputs)
    return np.asarray(gradients[:, :count] - gradients[:, count:])
