"""Single readings that contradict a curve: the generalised extreme studentised deviate test.

B. Rosner, Technometrics 25 (1983) 165; NIST/SEMATECH e-Handbook 1.3.5.17.3: the reading with the largest
studentised residual is taken out again and again; as many are outliers as the last one beyond its limit says,
so that several do not hide each other. Residuals are studentised with the leverage of their row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.methods.curve.fit import CurveFit
from monitor.records import Array

#: One false alarm in a hundred curves.
FALSE_ALARM = 0.01
#: More than a tenth of the readings are no outliers but another kind of noise.
LARGEST_SHARE = 0.1
MOST_OUTLIERS = 40
FEWEST_DEGREES = 8


@dataclass(frozen=True)
class Outlier:
    """A reading at ``row`` (from 0) that is off by ``size``, in the unit of the response; ``p_value`` over all rows."""

    row: int
    size: float
    p_value: float


def outliers(fit: CurveFit) -> tuple[Outlier, ...]:
    """All readings that contradict a model, in the order of the rows. Those that the fit left out are judged anew."""
    y, x = fit.problem.curve.measured, fit.design
    scale = np.linalg.norm(x, axis=0)
    x = x / np.where(scale == 0, 1.0, scale)
    rows = np.arange(len(y))
    worst: list[Outlier] = []
    count = 0
    # Around the model as it is: for a searched period the design holds what a small change of it does.
    modelled = y - fit.residual
    for number in range(min(int(LARGEST_SHARE * len(y)), MOST_OUTLIERS)):
        outlier = _worst(rows, y[rows] - modelled[rows], x[rows])
        if outlier is None:
            break
        worst.append(outlier)
        if outlier.p_value <= FALSE_ALARM:
            count = number + 1
        rows = rows[rows != outlier.row]
    return tuple(sorted(worst[:count], key=lambda outlier: outlier.row))


def _worst(rows: npt.NDArray[np.int64], y: Array, x: Array) -> Outlier | None:
    """The row with the largest studentised residual; None where too few degrees of freedom or no scatter remain."""
    residual, spread, freedom, one_less_leverage = _residual(y, x)
    if freedom < FEWEST_DEGREES or spread <= 0.0:
        return None
    scaled = np.where(
        one_less_leverage > 1e-6, np.abs(residual) / np.sqrt(np.maximum(one_less_leverage, 1e-6)), 0.0
    )
    studentised = scaled / spread
    worst = int(studentised.argmax())
    r = float(studentised[worst])
    # The externally studentised residual is Student's t with one degree of freedom less.
    t = r * np.sqrt((freedom - 1) / max(freedom - r**2, 1e-12))
    p_value = min(1.0, 2.0 * float(scipy.special.stdtr(freedom - 1, -t)) * len(rows))
    return Outlier(int(rows[worst]), float(residual[worst] / one_less_leverage[worst]), p_value)


def _residual(y: Array, x: Array) -> tuple[Array, float, int, Array]:
    """Residual (n,), its standard deviation, degrees of freedom, and one less the leverage (n,)."""
    u, values, _ = scipy.linalg.svd(x, full_matrices=False)
    basis = u[:, values > 1e-10 * max(values.max(initial=0.0), 1e-300)]
    residual = y - basis @ (basis.T @ y)
    freedom = len(y) - basis.shape[1]
    spread = float(np.sqrt(residual @ residual / max(freedom, 1)))
    return residual, spread, freedom, 1.0 - np.sum(basis**2, axis=1)
