"""How far days that wander may carry the slope of their means from a slope that is known otherwise.

What days are off by is taken for a first-order process beside the scatter of their means. How long it lasts and how
large it is are not known: of a wandering and a white process some days hardly tell one from the other, and an estimate
of the correlation from few days is too small. So the probability is the mean over all correlations and shares of the
scatter, each weighted by its restricted likelihood (D. A. Harville, J. Amer. Statist. Assoc. 72 (1977) 320).

``dependence`` widens the uncertainty of a slope for a level of 5 %; this is for decisions at far smaller levels.
Measured rates: docs/trials-statistics.md.
"""

from __future__ import annotations

import numpy as np
import scipy

from monitor.records import Array

#: Correlations of days a median interval apart; the last one is all but a random walk.
CORRELATIONS = (0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.92, 0.96, 0.98, 0.995)
#: Shares that the scatter of a day's mean has in its variance, beside the process.
SHARES = (0.0, 0.1, 0.3, 0.6)


def slope_as_far(
    values: Array, times: Array, design: Array, weight: Array, slope: float, u: float, dof: float
) -> float:
    """Probability that wandering days part the slope of ``values`` (d,) along the last column of ``design`` (d, q) so
    far from a ``slope`` known with ``u`` and ``dof`` degrees of freedom.

    The slope is that of ordinary least squares: one that follows the process would be that of the changes from day to
    day, which errors of a day's mean temperature pull towards zero. ``times`` and ``weight`` (d,) are those of the
    days, in order. 1 where the days leave nothing over.
    """
    free = len(values) - design.shape[1]
    gaps = np.diff(times)
    if free < 1 or not (gaps > 0.0).all():
        return 1.0
    lag = np.abs(times[:, np.newaxis] - times) / np.median(gaps)
    scatter = np.diag(weight.mean() / weight)
    evidence, tail = [], []
    of_days = np.linalg.pinv(design)[-1]
    apart = abs(of_days @ values - slope)
    for correlation in CORRELATIONS:
        process = correlation**lag
        for share in SHARES if correlation else (0.0,):
            covariance = (1.0 - share) * process + share * scatter + 1e-9 * np.eye(len(values))
            root = np.linalg.cholesky(covariance)
            both = scipy.linalg.solve_triangular(root, np.column_stack([design, values]), lower=True)
            triangle = np.asarray(np.linalg.qr(both, mode="r"), dtype=np.float64)
            diagonal, remainder = np.abs(np.diag(triangle))[:-1], triangle[-1, -1] ** 2
            if not (remainder > 0.0 and diagonal.min() > 0.0):
                return 1.0
            variance = np.array([remainder / free * (of_days @ covariance @ of_days), u**2])
            freedom = variance.sum() ** 2 / float((variance**2 / np.array([free, dof])).sum())
            tail.append(2.0 * scipy.special.stdtr(freedom, -apart / np.sqrt(variance.sum())))
            evidence.append(
                -np.log(np.diag(root)).sum() - np.log(diagonal).sum() - 0.5 * free * np.log(remainder)
            )
    likelihood = np.exp(np.array(evidence) - max(evidence))
    return float(np.average(tail, weights=likelihood))
