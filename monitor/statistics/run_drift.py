"""Drift within a day: does a parameter run off over the few runs of one session?

Four runs of an hour are too few for a trend of each parameter by itself: two degrees of freedom are left. But all
parameters of a run come from the same touches, so their scatter counts as one and the same multiple of their stated
covariance, and the scatter about the lines of all of them together says how large it is. Where the parameters
contradict that (Bartlett), each has its own scatter and the test has little power. For months and years see ``trend``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_vector
from monitor.statistics.fdr import control_false_discoveries
from monitor.statistics.sums import label_groups
from monitor.statistics.tails import chi_square_tail, student_tail

#: Below this p-value of Bartlett's test the scatters are no common multiple of what is stated. Low, because a wrong
#: "not common" costs nearly all power with few runs, a wrong "common" little: the drifting one scatters more, too.
NOT_COMMON = 0.01
#: A drift is reported at this false discovery rate over the parameters.
RATE = 0.05


@dataclass(frozen=True)
class RunDrift:
    """``slope`` and ``u`` (k,) in the unit of the values per hour, ``dof``, ``p_value`` and ``q_value`` (k,).

    ``scale`` (k,) is the scatter as a multiple of the stated uncertainty; ``common`` whether one for all.
    """

    slope: Array
    u: Array
    dof: int
    p_value: Array
    q_value: Array
    scale: Array
    common: bool

    @property
    def drifts(self) -> npt.NDArray[np.bool_]:
        """Which parameters drift (k,), at the false discovery rate ``RATE``."""
        return np.asarray(self.q_value < RATE)


def run_drift(
    values: npt.ArrayLike, hours: npt.ArrayLike, stated: npt.ArrayLike, days: npt.ArrayLike | None = None
) -> RunDrift:
    """Slopes of ``values`` (n, k) over ``hours`` (n,), each day about its own mean.

    ``stated`` (k, k) is the covariance of one run as its identification states it; ``days`` (n,) labels, None for
    one day. Raises ``DataError`` where fewer than one degree of freedom is left for a parameter (three runs of one
    day), the times of every day are alike, or the stated covariance is not that of k parameters.
    Measured false alarms at 5 % of any of 8 parameters with common scatter: 5.0 % (4 runs of a day), 4.1 % (4 runs of
    5 days).
    """
    y = np.asarray(values, dtype=np.float64)
    if y.ndim != 2 or not np.isfinite(y).all():
        raise DataError("values must be a finite matrix, one row a run and one column a parameter")
    n, k = y.shape
    t = as_vector(hours, "hours", length=n)
    covariance = np.asarray(stated, dtype=np.float64)
    if (
        covariance.shape != (k, k)
        or not np.isfinite(covariance).all()
        or not np.all(np.diag(covariance) > 0.0)
    ):
        raise DataError(f"the stated covariance must be finite, of {k} parameters, with variances above zero")
    index = np.zeros(n, dtype=np.intp) if days is None else label_groups(days, n)[1]
    count = int(index.max()) + 1
    dof = n - count - 1
    if dof < 1:
        raise DataError(
            f"{n} runs of {count} day(s) leave no degree of freedom for a drift; three runs of one day do"
        )
    t, y = _about_days(t[:, None], index)[:, 0], _about_days(y, index)
    square = float(t @ t)
    if square == 0.0:
        raise DataError("all runs of a day began at the same time; a drift needs times that differ")
    slope = t @ y / square
    residual = y - t[:, None] * slope
    u = np.sqrt(np.diag(covariance))
    ratio = np.sqrt(np.sum(residual**2, axis=0) / dof) / u
    common = k > 1 and _alike(ratio**2, dof)
    scale = ratio
    if common:
        # In whitened columns the parameters are independent, whatever the plan correlates.
        white = np.linalg.solve(np.linalg.cholesky(covariance), residual.T)
        scale = np.full(k, np.sqrt(np.sum(white**2) / (dof * k)))
        dof *= k
    error = scale * u / np.sqrt(square)
    with np.errstate(divide="ignore", invalid="ignore"):
        statistic = np.where(error > 0.0, np.abs(slope) / error, np.where(slope == 0.0, 0.0, np.inf))
    p = 2.0 * student_tail(statistic, dof)
    return RunDrift(slope, error, dof, p, control_false_discoveries(p).q_value, scale, common)


def _about_days(columns: Array, index: npt.NDArray[np.intp]) -> Array:
    """Columns (n, k) less their mean of the day."""
    sums = np.zeros((int(index.max()) + 1, columns.shape[1]))
    np.add.at(sums, index, columns)
    return np.asarray(columns - (sums / np.bincount(index)[:, None])[index])


def _alike(variances: Array, dof: int) -> bool:
    """Bartlett's test of k variances of ``dof`` degrees of freedom each."""
    k = len(variances)
    if np.any(variances <= 0.0):
        return False
    statistic = dof * (k * np.log(variances.mean()) - np.sum(np.log(variances)))
    correction = 1.0 + (k + 1.0) / (3.0 * k * dof)
    return bool(chi_square_tail(statistic / correction, k - 1) >= NOT_COMMON)
