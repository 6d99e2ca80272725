"""The quality of a fitted curve: Schwarz's criterion, the error on rows left out, the noise that remains, and
uncertainties that allow for that noise.
"""

from __future__ import annotations

import numpy as np
import scipy

from monitor.discovery.search.held_out import folds_of, held_out_rms
from monitor.effects.curve import PLACED
from monitor.methods.curve.fit import CurveFit
from monitor.methods.curve.solver import inverse_normal
from monitor.records import Array
from monitor.statistics.noise import WHITE, Assessed, assess


def noise_of(fitted: CurveFit) -> Assessed:
    """Assess the noise that a model leaves; there is none where it fits exactly."""
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
    weighted = ~fitted.problem.left_out
    count = int(weighted.sum())
    scale = np.maximum(np.linalg.norm(fitted.design, axis=0), 1e-300)
    columns = np.linalg.qr(fitted.design / scale)[0][weighted]
    return held_out_rms(-fitted.residual[weighted], columns, folds_of(count), count, 1.0)


def allowed_for(fitted: CurveFit, noise: Assessed) -> Array:
    """Covariance (k, k) of the coefficients with correlated noise allowed for: (X'X)^-1 X' R X (X'X)^-1 s^2."""
    return _covariance(fitted, noise)[: len(fitted.names), : len(fitted.names)]


def inflation(fitted: CurveFit, noise: Assessed, index: int) -> float:
    """Factor by which correlated noise widens the standard uncertainty of the searched value of the effect at an
    index."""
    free = [at for at, effect in enumerate(fitted.effects) if effect.free and effect.shape not in PLACED]
    column = len(fitted.names) + free.index(index)
    plain = _covariance(fitted, Assessed(WHITE, 1.0))[column, column]
    return float(np.sqrt(_covariance(fitted, noise)[column, column] / plain))


def _covariance(fitted: CurveFit, noise: Assessed) -> Array:
    x = fitted.design[fitted.problem.order]
    inverse = inverse_normal(x)
    variance = fitted.deviation**2
    if not noise.noticed:
        return np.asarray(variance * inverse)
    middle = x.T @ scipy.linalg.matmul_toeplitz(noise.noise.correlations(len(x)), x)
    # What the fit takes out of correlated noise is missing from the residual; the trace puts it back.
    absorbed = float(np.trace(inverse @ middle))
    count = len(x)
    variance = fitted.sum_of_squares / max(count - absorbed, 1.0)
    return np.asarray(variance * inverse @ middle @ inverse)
