"""How good a fitted curve is: Schwarz's criterion, the error on rows left out, the noise that is left, and
uncertainties that allow for that noise.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from monitor.discovery.machine.held_out import held_out_rms
from monitor.methods.curve.fit import CurveFit
from monitor.methods.curve.solver import inverse_normal
from monitor.records import Array
from monitor.statistics.noise import WHITE, Assessed, assess

#: Rows are dealt into ten folds at random, always the same way.
FOLDS, DEAL = 10, 20261121


def folds(count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """The fold (n,) of every row; below twenty rows each is its own."""
    if count < 2 * FOLDS:
        return np.arange(count)
    return np.random.default_rng(DEAL).permutation(count) % FOLDS


def noise_of(fitted: CurveFit) -> Assessed:
    """The noise that a model leaves; none where it fits exactly."""
    if fitted.exact:
        return Assessed(WHITE, 1.0)
    rows = fitted.problem.order
    return assess(fitted.problem.curve.measured[rows], fitted.design[rows])


def bic(fitted: CurveFit) -> float:
    """Schwarz's criterion: n log(RSS / n) + k log n, k with the searched values."""
    count = int((~fitted.problem.left_out).sum())
    return float(
        count * np.log(max(fitted.sum_of_squares, 1e-300) / count)
        + (count - fitted.degrees_of_freedom) * np.log(count)
    )


def held_out(fitted: CurveFit) -> float | None:
    """Held-out root mean square per degree of freedom of the base: folds of rows left out in turn."""
    kept = ~fitted.problem.left_out
    count = int(kept.sum())
    columns = np.linalg.qr(fitted.design / np.maximum(np.linalg.norm(fitted.design, axis=0), 1e-300))[0][kept]
    return held_out_rms(-fitted.residual[kept], columns, folds(count), count, 1.0)


def allowed_for(fitted: CurveFit, noise: Assessed) -> Array:
    """Covariance (k, k) of the coefficients with correlated noise allowed for: (X'X)^-1 X' R X (X'X)^-1 s^2."""
    return _covariance(fitted, noise)[: len(fitted.names), : len(fitted.names)]


def inflation(fitted: CurveFit, noise: Assessed, at: int) -> float:
    """Factor by which correlated noise widens the standard uncertainty of the searched value of effect ``at``."""
    free = [n for n, one in enumerate(fitted.effects) if one.free and one.shape != "step"]
    place = len(fitted.names) + free.index(at)
    plain = _covariance(fitted, Assessed(WHITE, 1.0))[place, place]
    return float(np.sqrt(_covariance(fitted, noise)[place, place] / plain))


def _covariance(fitted: CurveFit, noise: Assessed) -> Array:
    x = fitted.design[fitted.problem.order]
    inverse = inverse_normal(x)
    variance = fitted.deviation**2
    if not noise.noticed:
        return np.asarray(variance * inverse)
    middle = x.T @ linalg.matmul_toeplitz(noise.noise.correlations(len(x)), x)
    # What the fit takes out of correlated noise is missing from the residual; the trace puts it back.
    taken = float(np.trace(inverse @ middle))
    count = len(x)
    variance = fitted.sum_of_squares / max(count - taken, 1.0)
    return np.asarray(variance * inverse @ middle @ inverse)
