"""Regression with a between-day component: the engine of trends and of dependence on conditions.

The variance of a run is s² u² within its day plus one t² common to the runs of a day. Both come from
moments: s² from the residuals within the days, t² from the total (generalised Paule-Mandel), so three days
suffice and nothing iterates beyond one root. Without repeated days, days and runs are the same and s = 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import optimize, stats

from monitor.exceptions import DataError
from monitor.records import Array


@dataclass(frozen=True)
class MixedFit:
    """Coefficients (q,), their covariance (q, q) and effective degrees of freedom (q,).

    ``within`` is the factor s on the uncertainties of the runs, ``between`` the standard deviation t of the
    days in the unit of the values; ``residual`` (n,) is value less fitted line.
    """

    coefficients: Array
    covariance: Array
    dof: Array
    within: float
    between: float
    truncated: bool
    residual: Array

    @property
    def u(self) -> Array:
        """Standard uncertainties of the coefficients (q,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def p_value(self) -> Array:
        """Two-sided p-value of each coefficient being zero (q,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(2.0 * stats.t.sf(np.abs(self.coefficients / self.u), self.dof))

    def interval(self, level: float) -> Array:
        """Intervals (q, 2) of the coefficients at a level of confidence."""
        half = stats.t.isf((1.0 - level) / 2.0, self.dof) * self.u
        return np.column_stack([self.coefficients - half, self.coefficients + half])


def _day_means(columns: Array, weight: Array, total: Array, day: npt.NDArray[np.intp]) -> Array:
    """Weighted means of the columns by day, spread back over the runs (n, q)."""
    summed = np.zeros((len(total), columns.shape[1]))
    np.add.at(summed, day, columns * weight[:, np.newaxis])
    return np.asarray((summed / total[:, np.newaxis])[day])


def _rank(matrix: Array) -> int:
    """Rank of columns that were scaled to unit length before."""
    return int(np.linalg.matrix_rank(matrix, tol=1e-9)) if matrix.size else 0


def fit_with_days(y: Array, design: Array, u: Array | None, day: npt.NDArray[np.intp]) -> MixedFit:
    """Generalised least squares of ``y`` (n,) on ``design`` (n, q) with a component common to each day.

    ``u`` (n,) are the standard uncertainties of the runs (None: all alike), ``day`` (n,) indices from 0.
    Arguments are trusted except for rank and degrees of freedom (``DataError``). Degrees of freedom
    interpolate between those within and between days by where a coefficient has its information
    (Satterthwaite on the two strata).
    """
    n, q = design.shape
    days = int(day.max()) + 1
    weight = np.ones(n) if u is None else 1.0 / u**2
    scale = np.sqrt((design**2 * weight[:, np.newaxis]).sum(axis=0))
    if (scale == 0.0).any() or _rank(np.sqrt(weight)[:, np.newaxis] * design / scale) < q:
        raise DataError(f"the {q} terms of the fit are exactly dependent over these runs; leave one out.")
    design = design / scale
    total = np.asarray(np.bincount(day, weight), dtype=np.float64)
    both = np.column_stack([design, y])
    mean = _day_means(both, weight, total, day)
    root = np.sqrt(weight)[:, np.newaxis]
    inner, outer = root * (both - mean), mean
    rank_within = _rank(np.where(np.abs(inner[:, :q]) > 1e-9, inner[:, :q], 0.0))
    dof_within = n - days - rank_within
    dof_between = days - _rank(root * outer[:, :q])
    if n - q < 1:
        raise DataError(f"{n} runs do not suffice for {q} terms; at least {q + 1} are needed.")
    within = 1.0
    repeated = dof_within >= 1
    if repeated:
        solution = np.linalg.lstsq(inner[:, :q], inner[:, q], rcond=1e-9)[0]
        within = float(np.sqrt(((inner[:, q] - inner[:, :q] @ solution) ** 2).sum() / dof_within))

    def whiten(variance: float) -> Array:
        """Rows with covariance s² times one, for t² = ``variance`` in units of s²."""
        shrunk = 1.0 / np.sqrt(1.0 + variance * total[day])[:, np.newaxis]
        return np.asarray(inner + root * outer * shrunk)

    def solve(variance: float) -> tuple[Array, float]:
        rows = whiten(variance)
        found = np.asarray(np.linalg.lstsq(rows[:, :q], rows[:, q], rcond=None)[0], dtype=np.float64)
        return found, float(((rows[:, q] - rows[:, :q] @ found) ** 2).sum())

    unit = within**2 if repeated else 1.0
    goal = (n - q) * unit
    variance, truncated = 0.0, True
    if solve(0.0)[1] > goal > 0.0 and dof_between > 0:
        truncated = False
        top = 1.0 / float(total.mean())
        while solve(top)[1] > goal and top * float(total.max()) < 1e12:
            top *= 8.0
        variance = (
            optimize.brentq(lambda v: solve(v)[1] - goal, 0.0, top, rtol=1e-10)
            if solve(top)[1] < goal
            else top
        )
    coefficients, chi_square = solve(variance)
    rows = whiten(variance)[:, :q]
    unscaled = np.linalg.inv(rows.T @ rows)
    factor = chi_square / (n - q)
    share = np.einsum("ij,nj->in", unscaled, inner[:, :q])
    within_part = (share**2).sum(axis=1) / np.diag(unscaled)
    dof = _effective(within_part, max(dof_within, 0), max(dof_between, 0), n - q)
    return MixedFit(
        coefficients=coefficients / scale,
        covariance=factor * unscaled / np.outer(scale, scale),
        dof=dof,
        within=within if repeated else float(np.sqrt(factor)),
        between=float(np.sqrt(variance * unit)),
        truncated=truncated,
        residual=y - design @ coefficients,
    )


def _effective(share: Array, dof_within: int, dof_between: int, most: int) -> Array:
    """Degrees of freedom of a variance made of two strata in the proportions share and 1 - share."""
    share = np.clip(share, 0.0, 1.0)
    inverse = np.zeros_like(share)
    for part, dof in ((share, dof_within), (1.0 - share, dof_between)):
        inverse += np.where(part > 1e-9, part**2 / max(dof, 0.5), 0.0)
    return np.clip(1.0 / inverse, 1.0, float(most))
