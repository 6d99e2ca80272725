"""Scatter within a run, between the runs of a day and between days, and the covariance that the days add.

Which to use: ``variance_components`` for one level of groups with its intervals; this where a run's own uncertainty is
known besides, so that what runs add to it can be told from what days add. All estimates are those of the analysis of
variance on unweighted means: nothing iterates. A negative estimate is given as zero and said so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.components import variance_components
from monitor.statistics.tails import chi_square_quantile


class NotKnown(StrEnum):
    """Why the scatter between days, or that between the runs of a day, cannot be known."""

    ONE_RUN = "one run"
    ONE_DAY = "one day"
    TWO_DAYS = "two days"
    ONE_RUN_A_DAY = "one run a day"


@dataclass(frozen=True)
class DayComponents:
    """Components of scatter of p quantities as standard deviations (p,), in the unit of the values; NaN: not known.

    ``between_runs`` is what the runs of a day differ by beyond ``within_run``, ``between_days`` what days differ by
    beyond their runs, with its interval (p, 2) for ``level``, ``spread`` the largest less the smallest day mean.
    ``truncated_runs`` and ``truncated_days`` (p,) mark negative estimates. ``covariance`` (p, p) of the days is
    positive semidefinite, with ``days`` - 1 degrees of freedom; None for fewer than three days. With one run a day
    ``between_days`` holds the scatter between runs too.
    """

    runs: int
    days: int
    level: float
    within_run: Array
    between_runs: Array
    truncated_runs: npt.NDArray[np.bool_]
    dof_runs: int
    between_days: Array
    between_days_interval: Array
    truncated_days: npt.NDArray[np.bool_]
    spread: Array
    covariance: Array | None
    not_known: NotKnown | None


def day_components(
    values: Array, days: npt.ArrayLike, u_within_run: Array, *, level: float = 0.95
) -> DayComponents:
    """Components of ``values`` (R, p) of R runs on ``days`` (R,), each run with the known ``u_within_run`` (p,).

    Raises DataError for values that are not finite or shapes that differ. Source: S. R. Searle, G. Casella,
    C. E. McCulloch, Variance Components, 1992, 3.6; intervals as in ``variance_components``.
    """
    values = np.asarray(values, dtype=np.float64)
    labels = np.asarray(days)
    u = np.asarray(u_within_run, dtype=np.float64)
    if values.ndim != 2 or labels.shape != (len(values),) or u.shape != values.shape[1:]:
        raise DataError(
            f"values (R, p) need R days and p uncertainties, not {values.shape}, {labels.shape}, {u.shape}"
        )
    if not np.isfinite(values).all():
        raise DataError("the values of every run must be finite")
    count = len(np.unique(labels))
    runs, width = values.shape
    means = np.array([values[labels == day].mean(axis=0) for day in np.unique(labels)])
    spread = means.max(axis=0) - means.min(axis=0) if count else np.full(width, math.nan)
    unknown, no = np.full(width, math.nan), np.zeros(width, dtype=bool)
    plain = DayComponents(
        runs, count, level, u, unknown, no, runs - count, unknown, np.full((width, 2), math.nan), no, spread,
        None, None,
    )  # fmt: skip
    if runs < 2:
        return replace(plain, not_known=NotKnown.ONE_RUN)
    if runs == count:
        return _one_run_a_day(plain, values)
    within = _pooled(values, labels)
    added = np.diag(within) - u**2
    plain = replace(plain, between_runs=np.sqrt(np.maximum(added, 0.0)), truncated_runs=added < 0.0)
    if count == 1:
        return replace(plain, not_known=NotKnown.ONE_DAY)
    components = variance_components(values, labels, level=level)
    plain = replace(
        plain,
        between_days=components.between,
        between_days_interval=components.between_interval,
        truncated_days=components.truncated,
    )
    if count == 2:
        return replace(plain, not_known=NotKnown.TWO_DAYS)
    sizes = np.unique(labels, return_counts=True)[1]
    harmonic = len(sizes) / float(np.sum(1.0 / sizes))
    return replace(plain, covariance=_positive(_scatter(means) - within / harmonic, means.std(axis=0)))


def _scatter(values: Array) -> Array:
    """Covariance (p, p) of the rows of ``values`` (n, p) about their mean."""
    centred = values - values.mean(axis=0)
    return np.asarray(centred.T @ centred / (len(values) - 1))


def _pooled(values: Array, labels: npt.NDArray[np.generic]) -> Array:
    """Covariance (p, p) within days, pooled by degrees of freedom."""
    centred = values.copy()
    for day in np.unique(labels):
        centred[labels == day] -= values[labels == day].mean(axis=0)
    return np.asarray(centred.T @ centred / (len(values) - len(np.unique(labels))))


def _positive(covariance: Array, scale: Array) -> Array:
    """A positive semidefinite matrix with the diagonal of ``covariance`` (p, p), negative elements of it set to zero.

    The correlations are those of its nearest positive semidefinite matrix in units of ``scale`` (p,). Without the given
    diagonal the eigenvalues that are cut would add to every variance: a fourth to that of the example with five days.
    """
    safe = np.where(scale > 0.0, scale, 1.0)
    values, vectors = scipy.linalg.eigh(covariance / np.outer(safe, safe))
    projected = (vectors * np.maximum(values, 0.0)) @ vectors.T
    size = np.sqrt(np.diag(projected))
    size = np.where(size > 0.0, size, 1.0)
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return np.asarray(np.outer(deviation, deviation) * (projected / np.outer(size, size)))


def _one_run_a_day(plain: DayComponents, values: Array) -> DayComponents:
    """Days and runs cannot be told apart: what the days differ by beyond ``within_run``, with its interval."""
    dof = len(values) - 1
    total = values.var(axis=0, ddof=1)
    added = total - plain.within_run**2
    tail = (1.0 - plain.level) / 2.0
    # The upper end of a negative estimate is that of an estimate of zero, as in ``variance_components``.
    largest = np.maximum(total, plain.within_run**2)
    bounds = [
        dof * square / chi_square_quantile(side, dof)
        for square, side in ((total, tail), (largest, 1.0 - tail))
    ]
    interval = np.column_stack([np.sqrt(np.maximum(b - plain.within_run**2, 0.0)) for b in bounds])
    covariance = None
    if len(values) >= 3:
        covariance = _positive(_scatter(values) - np.diag(plain.within_run**2), values.std(axis=0))
    return replace(
        plain,
        between_days=np.sqrt(np.maximum(added, 0.0)),
        between_days_interval=interval,
        truncated_days=added < 0.0,
        covariance=covariance,
        not_known=NotKnown.ONE_RUN_A_DAY,
    )
