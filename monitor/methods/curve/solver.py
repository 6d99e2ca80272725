"""Least squares of a curve: linear coefficients exactly, searched values by Gauss-Newton on all unknowns together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from monitor.effects.curve import PLACED, SEARCHED, CurveEffect, coefficient_names, curve_columns
from monitor.exceptions import EffectError
from monitor.methods.curve.problem import CurveProblem, grid
from monitor.records import Array

#: Singular values of the scaled design below this belong to coefficients that the rows cannot separate. The cubic
#: in a calendar year has 1e-9.
RANK_TOLERANCE = 1e-12

MOST_ITERATIONS = 60
CONVERGED = 1e-13


def solve(columns: Array, y: Array) -> tuple[Array, int, Array]:
    """Least-squares coefficients (k,), rank, and an orthonormal basis (m, k) of what the rows cannot separate, for
    columns scaled to unit length."""
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    u, values, vectors = scipy.linalg.svd(columns / scale, full_matrices=False)
    rank = int(np.sum(values > RANK_TOLERANCE * max(values.max(initial=0.0), 1e-300)))
    # QR keeps more digits than the normal equations, and so does a second step on what is left.
    if rank == columns.shape[1]:
        q, r = scipy.linalg.qr(columns / scale, mode="economic")
        scaled = scipy.linalg.solve_triangular(r, q.T @ y)
        scaled = scaled + scipy.linalg.solve_triangular(r, q.T @ (y - (columns / scale) @ scaled))
        return np.asarray(scaled / scale), rank, np.zeros((0, columns.shape[1]))
    scaled = vectors[:rank].T @ ((u[:, :rank].T @ y) / values[:rank])
    full = scipy.linalg.svd(columns / scale, full_matrices=True)[2]
    return np.asarray(scaled / scale), rank, np.asarray(full[rank:])


def inverse_normal(columns: Array) -> Array:
    """Return (X'X)^-1 of columns (n, k), by a pseudo-inverse of the scaled columns."""
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv(columns / scale, rcond=RANK_TOLERANCE)
    return np.asarray((inverse @ inverse.T) / np.outer(scale, scale))


def slope(problem: CurveProblem, names: Sequence[str], estimate: Array, effect: CurveEffect) -> Array:
    """How the model (n,) moves with the inverse of an effect's searched value (a frequency or a rate)."""
    coefficients = coefficient_names(effect, problem.inputs)
    size = estimate[[names.index(name) for name in coefficients]]
    x = problem.inputs.numbers[effect.column]
    columns = curve_columns(effect, problem.inputs)
    if effect.shape == "sin":
        turned = np.column_stack([-columns[:, 1], columns[:, 0]]) * (2.0 * np.pi * x)[:, None]
        return np.asarray(turned @ size)
    assert effect.value is not None
    start = x.min() if effect.value > 0 else x.max()
    return np.asarray(-(x - start) * columns[:, 0] * size[0])


def refined(
    problem: CurveProblem, effects: Sequence[CurveEffect], free: Sequence[int]
) -> tuple[list[CurveEffect], int]:
    """Effects with all searched values at the least-squares point, by Gauss-Newton with halved steps."""
    weighted, y, current = ~problem.left_out, problem.curve.measured, list(effects)

    def state(at: Sequence[CurveEffect]) -> tuple[tuple[str, ...], Array, Array, Array]:
        names, _, columns = problem.columns(at)
        estimate, _, _ = solve(columns[weighted], y[weighted])
        return names, columns, estimate, (y - columns @ estimate)[weighted]

    low, high = np.array([_bounds(problem, current[index]) for index in free]).T
    names, columns, estimate, residual = state(current)
    for iteration in range(1, MOST_ITERATIONS + 1):
        slopes = np.column_stack([slope(problem, names, estimate, current[index]) for index in free])
        both = np.column_stack([columns, slopes])[weighted]
        step = solve(both, residual)[0][columns.shape[1] :]
        rates = np.array([1.0 / float(current[index].value or 1.0) for index in free])
        for halving in range(30):
            trial = list(current)
            moved = np.clip(rates + step / 2.0**halving, low, high)
            for index, rate in zip(free, moved, strict=True):
                trial[index] = current[index].at(1.0 / float(rate))
            then = state(trial)
            if then[3] @ then[3] <= residual @ residual:
                break
        else:
            return current, iteration
        change = float(np.max(np.abs(moved / rates - 1.0)))
        current, (names, columns, estimate, residual) = trial, then
        if change < CONVERGED:
            return current, iteration
    return current, MOST_ITERATIONS


def _bounds(problem: CurveProblem, effect: CurveEffect) -> tuple[float, float]:
    """How far the frequency or rate of a searched value may go from where it begins: half of what two periods have to
    differ by to be separated, so that they do not run into each other; a factor of ten or a hundred for a constant."""
    rate = 1.0 / float(effect.value or 1.0)
    if effect.shape == "sin":
        # A cycle longer than the range is a bend, not a cycle.
        least = 1.0 / float(np.ptp(problem.inputs.numbers[effect.column]))
        return max(rate - 0.5 * least, min(least, rate)), rate + 0.5 * least
    return min(rate / 100.0, rate * 10.0), max(rate / 100.0, rate * 10.0)


def searched(problem: CurveProblem, effects: Sequence[CurveEffect], index: int) -> CurveEffect:
    """The effect with the value of the grid that leaves least, the other effects fitted along."""
    effect = effects[index]
    values = grid(effect, problem.inputs)
    if effect.shape in PLACED and effect.value is not None:
        values = np.append(values, effect.value)
    if len(values) == 0:
        raise EffectError(
            f"'{effect.text}': the {SEARCHED[effect.shape]} cannot be searched, {effect.column} takes too few "
            f"values; write it, such as {effect.column}:{effect.shape}12"
        )
    weighted, y = ~problem.left_out, problem.curve.measured
    others = [
        rival
        for position, rival in enumerate(effects)
        if position != index and (rival.value or not rival.free)
    ]
    _, _, nuisance = problem.columns(others)
    basis = scipy.linalg.orth(
        nuisance[weighted] / np.maximum(np.linalg.norm(nuisance[weighted], axis=0), 1e-300)
    )
    residual = y[weighted] - basis @ (basis.T @ y[weighted])
    best, least = effect.at(float(values[0])), np.inf
    for value in values:
        columns = curve_columns(effect, problem.inputs, float(value))[weighted]
        columns = columns - basis @ (basis.T @ columns)
        coefficients = np.linalg.lstsq(columns, residual, rcond=1e-10)[0]
        rest = float(np.sum((residual - columns @ coefficients) ** 2))
        if rest < least:
            best, least = effect.at(float(value)), rest
    return best
