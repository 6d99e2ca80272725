"""Regression with a between-day component: the engine of trends and of dependence on conditions.

The variance of a run is s² u² within its day plus one t² common to the runs of a day. Both come from
moments: s² from the residuals within the days, t² from the total (generalised Paule-Mandel), so three days
suffice and nothing iterates beyond one root. Without repeated days, days and runs are the same and s = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array

#: Largest day component looked for, as t² times the weight of a day: thirty million times the scatter of its mean.
LARGEST = 1e15
#: Newton's steps at most; two to eight are usual.
STEPS = 100


@dataclass(frozen=True)
class MixedFit:
    """Coefficients (q,), their covariance (q, q) and effective degrees of freedom (q,).

    ``within`` is the factor s on the uncertainties of the runs, ``between`` the standard deviation t of the
    days in the unit of the values; ``repeated``: a day has several runs, so that the two are told apart. ``weight``
    (d,)
    are the weights of the days with it, in an arbitrary unit; ``residual`` (n,) is value less fitted line.
    ``inside`` (q,) is the share of the variance of each coefficient that the scatter within days gives it.
    """

    coefficients: Array
    covariance: Array
    dof: Array
    within: float
    between: float
    truncated: bool
    repeated: bool
    weight: Array
    residual: Array
    inside: Array

    @property
    def u(self) -> Array:
        """Standard uncertainties of the coefficients (q,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def p_value(self) -> Array:
        """Two-sided p-value of each coefficient being zero (q,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(2.0 * scipy.special.stdtr(self.dof, -np.abs(self.coefficients / self.u)))

    def interval(self, level: float) -> Array:
        """Intervals (q, 2) of the coefficients at a level of confidence."""
        half = -scipy.special.stdtrit(self.dof, (1.0 - level) / 2.0) * self.u
        return np.column_stack([self.coefficients - half, self.coefficients + half])


def _day_means(columns: Array, weight: Array, total: Array, day: npt.NDArray[np.intp]) -> Array:
    """Weighted means of the columns by day (d, q)."""
    weighted = columns * weight[:, np.newaxis]
    return np.column_stack([np.bincount(day, column) for column in weighted.T]) / total[:, np.newaxis]


def _triangle(rows: Array) -> Array:
    """The triangle R of rows = Q R: all that least squares needs of them."""
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def _rank(matrix: Array) -> int:
    """Rank of columns that were scaled to unit length before."""
    return _rank_of(np.ascontiguousarray(matrix).tobytes(), matrix.shape) if matrix.size else 0


# The parameters of a machine have the same days, and so the same columns again and again.
@lru_cache(maxsize=64)
def _rank_of(numbers: bytes, shape: tuple[int, int]) -> int:
    return int(np.linalg.matrix_rank(np.frombuffer(numbers).reshape(shape), tol=1e-9))


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
    inner = np.sqrt(weight)[:, np.newaxis] * (both - mean[day])
    rank_within = _rank(np.where(np.abs(inner[:, :q]) > 1e-9, inner[:, :q], 0.0))
    # Within and between the days are orthogonal: the one is reduced to a triangle, the other to a row a day.
    inner, outer = _triangle(inner), np.sqrt(total)[:, np.newaxis] * mean
    dof_within = n - days - rank_within
    dof_between = days - _rank(outer[:, :q])
    if n - q < 1:
        raise DataError(f"{n} runs do not suffice for {q} terms; at least {q + 1} are needed.")
    inside, unit = 0.0, 1.0
    repeated = dof_within >= 1
    if repeated:
        solution = np.linalg.lstsq(inner[:, :q], inner[:, q], rcond=1e-9)[0]
        inside = float(((inner[:, q] - inner[:, :q] @ solution) ** 2).sum())
        unit = inside / dof_within

    def solve(variance: float) -> tuple[Array, Array, float, float]:
        """Triangle (q, q), coefficients, chi-square and its slope for t² = ``variance`` in units of s²."""
        rows = outer / np.sqrt(1.0 + variance * total)[:, np.newaxis]
        triangle = _triangle(np.vstack([inner, rows]))
        coefficients: Array = np.asarray(np.linalg.solve(triangle[:q, :q], triangle[:q, q]))
        between_days = (rows[:, q] - rows[:, :q] @ coefficients) ** 2
        within_days = ((inner[:, q] - inner[:, :q] @ coefficients) ** 2).sum()
        slope = (between_days * total / (1.0 + variance * total)).sum()
        return triangle[:q, :q], coefficients, float(within_days + between_days.sum()), -float(slope)

    goal = (n - q) * unit
    variance, truncated = 0.0, True
    triangle, coefficients, chi_square, slope = solve(0.0)
    if chi_square > goal > 0.0 and dof_between > 0:
        truncated = False
        # The reciprocal of what the days add to chi-square is concave in t²: Newton's steps rise to the root and do
        # not pass it (with days that weigh alike it is a straight line, and the first step is the last).
        most = LARGEST / float(total.max())
        for _ in range(STEPS):
            step = (chi_square - inside) * (chi_square - goal) / ((goal - inside) * -slope)
            variance = min(variance + step, most)
            triangle, coefficients, chi_square, slope = solve(variance)
            if chi_square - goal <= 1e-13 * goal or step <= 1e-14 * variance or variance == most:
                break
    inverse = np.linalg.solve(triangle, np.eye(q))
    unscaled = inverse @ inverse.T
    factor = chi_square / (n - q)
    within_part = ((inner[:, :q] @ unscaled) ** 2).sum(axis=0) / np.diag(unscaled)
    dof = _effective(within_part, max(dof_within, 0), max(dof_between, 0), n - q)
    return MixedFit(
        coefficients=coefficients / scale,
        covariance=factor * unscaled / np.outer(scale, scale),
        dof=dof,
        within=float(np.sqrt(unit if repeated else factor)),
        between=float(np.sqrt(variance * unit)),
        truncated=truncated,
        repeated=repeated,
        weight=np.asarray(total / (1.0 + variance * total)),
        residual=y - design @ coefficients,
        inside=np.clip(within_part, 0.0, 1.0),
    )


def _effective(share: Array, dof_within: int, dof_between: int, most: int) -> Array:
    """Degrees of freedom of a variance made of two strata in the proportions share and 1 - share."""
    share = np.clip(share, 0.0, 1.0)
    inverse = np.zeros_like(share)
    for part, dof in ((share, dof_within), (1.0 - share, dof_between)):
        inverse += np.where(part > 1e-9, part**2 / max(dof, 0.5), 0.0)
    return np.clip(1.0 / inverse, 1.0, float(most))
