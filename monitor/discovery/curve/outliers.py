"""Single readings that contradict a curve: the generalised extreme studentised deviate test.

B. Rosner, Technometrics 25 (1983) 165; NIST/SEMATECH e-Handbook 1.3.5.17.3: the reading with the largest
studentised residual is taken out again and again; as many are outliers as the last one beyond its limit says,
so that several do not hide each other. Residuals are studentised with the leverage of their row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, special

from monitor.methods.curve.fit import CurveFit
from monitor.records import Array

#: One false alarm in a hundred curves.
FALSE_ALARM = 0.01
#: More than a tenth of the readings are no outliers but another kind of noise.
LARGEST_SHARE = 0.1
MOST_OUTLIERS = 40
FEWEST_LEFT = 8


@dataclass(frozen=True)
class Outlier:
    """A reading at ``row`` (from 0) that is off by ``size``, in the unit of the response; ``p_value`` over all rows."""

    row: int
    size: float
    p_value: float


def outliers(fit: CurveFit) -> tuple[Outlier, ...]:
    """All readings that contradict a model, in the order of the rows. Those that the fit left out are judged anew."""
    problem = fit.problem
    y, x = problem.curve.measured, fit.design
    scale = np.linalg.norm(x, axis=0)
    x = x / np.where(scale == 0, 1.0, scale)
    rows = np.arange(len(y))
    most = min(int(LARGEST_SHARE * len(y)), MOST_OUTLIERS)
    found: list[Outlier] = []
    last = 0
    # Around the model as it is: for a searched period the design holds what a small change of it does.
    modelled = y - fit.residual
    for number in range(most):
        left, spread, freedom, checked = _residual(y[rows] - modelled[rows], x[rows])
        if freedom < FEWEST_LEFT or spread <= 0.0:
            break
        studentised = (
            np.where(checked > 1e-6, np.abs(left) / np.sqrt(np.maximum(checked, 1e-6)), 0.0) / spread
        )
        worst = int(studentised.argmax())
        r = float(studentised[worst])
        # The externally studentised residual is Student's t with one degree of freedom less.
        t = r * np.sqrt((freedom - 1) / max(freedom - r**2, 1e-12))
        p = min(1.0, 2.0 * float(special.stdtr(freedom - 1, -t)) * len(rows))
        found.append(Outlier(int(rows[worst]), float(left[worst] / checked[worst]), p))
        if p <= FALSE_ALARM:
            last = number + 1
        rows = np.delete(rows, worst)
    return tuple(sorted(found[:last], key=lambda one: one.row))


def _residual(y: Array, x: Array) -> tuple[Array, float, int, Array]:
    """Residual (n,), its standard deviation, degrees of freedom, and one less the leverage (n,)."""
    u, values, _ = linalg.svd(x, full_matrices=False)
    basis = u[:, values > 1e-10 * max(values.max(initial=0.0), 1e-300)]
    left = y - basis @ (basis.T @ y)
    freedom = len(y) - basis.shape[1]
    return left, float(np.sqrt(left @ left / max(freedom, 1))), freedom, 1.0 - np.sum(basis**2, axis=1)
