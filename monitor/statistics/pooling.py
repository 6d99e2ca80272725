"""Uncertainty of repeated runs: by group (day), pooled within groups, and of all runs together.

Use ``u_pooled`` for what a run repeats to within a day, ``u_all`` for what it repeats to over the whole
campaign; where the one-way ANOVA F exceeds 1 the second is the larger:
(n - 1) u_all² = (n - k) u_pooled² + (k - 1) MS_between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics.checks import as_names
from monitor.statistics.sums import GroupedSums, grouped_sums


@dataclass(frozen=True)
class Covariance:
    """A sample covariance matrix (p, p) in the squared units of the values, with its degrees of freedom."""

    names: tuple[str, ...]
    matrix: Array
    dof: int

    @property
    def u(self) -> Array:
        """Standard uncertainties (p,); the square roots of the diagonal."""
        return np.sqrt(np.diag(self.matrix))

    @property
    def correlation(self) -> Array:
        """Correlation matrix (p, p); NaN in the rows and columns of what never varies."""
        u = self.u
        scale = np.where(u > 0.0, u, np.nan)
        result: Array = self.matrix / np.outer(scale, scale)
        np.fill_diagonal(result, np.where(u > 0.0, 1.0, np.nan))
        return np.clip(result, -1.0, 1.0)


@dataclass(frozen=True)
class Pooling:
    """What repeated runs say of p quantities; every uncertainty is that of one run, not of a mean.

    ``mean``, ``u_all``, ``u_pooled``, ``ms_between`` are (p,), ``mean_by_group`` and ``u_by_group`` (k, p);
    the uncertainty of a group with a single run is NaN and its covariance None.
    """

    names: tuple[str, ...]
    labels: tuple[str, ...]
    counts: npt.NDArray[np.int64]
    mean: Array
    mean_by_group: Array
    u_all: Array
    u_pooled: Array
    u_by_group: Array
    ms_between: Array
    covariance_all: Covariance
    covariance_pooled: Covariance
    covariance_by_group: tuple[Covariance | None, ...]

    @property
    def n(self) -> int:
        """Number of runs."""
        return int(self.counts.sum())

    @property
    def dof_all(self) -> int:
        """Degrees of freedom of all runs, n - 1."""
        return self.covariance_all.dof

    @property
    def dof_pooled(self) -> int:
        """Degrees of freedom within the groups, n - k."""
        return self.covariance_pooled.dof


def _covariances(
    sums: GroupedSums, names: tuple[str, ...]
) -> tuple[Covariance, Covariance, tuple[Covariance | None, ...]]:
    """Total, pooled and by-group covariance matrices."""
    total = sums.centred - sums.mean
    everything = Covariance(names, total.T @ total / (sums.n - 1), sums.n - 1)
    pooled = Covariance(names, sums.residual.T @ sums.residual / sums.dof_within, sums.dof_within)
    by_group: list[Covariance | None] = []
    for j, count in enumerate(sums.counts):
        rows = sums.residual[sums.index == j]
        dof = int(count) - 1
        by_group.append(Covariance(names, rows.T @ rows / dof, dof) if dof else None)
    return everything, pooled, tuple(by_group)


def pool(values: npt.ArrayLike, groups: npt.ArrayLike, names: Sequence[str] | None = None) -> Pooling:
    """Means, standard uncertainties and covariances by group, pooled and of all runs.

    ``values`` (n, p) in any unit, one row a run; ``groups`` (n,) the label (day, warm-up state, bin of a
    condition) of each run; one group alone is allowed, then all and pooled coincide. Raises ``DataError``
    for non-finite values, wrong shapes, or no group with two runs.

    Source: A. Los, thesis 2017, 5.7.1, Eq. (5.4): u_pooled is the square root of the mean of the daily
    variances weighted by their degrees of freedom (the sentence beside the equation says otherwise).
    """
    sums = grouped_sums(values, groups, least_groups=1)
    columns = as_names(names, sums.centred.shape[1])
    everything, pooled, by_group = _covariances(sums, columns)
    dof = sums.counts[:, np.newaxis] - 1
    variance = np.full_like(sums.ss_by_group, np.nan)
    np.divide(sums.ss_by_group, dof, out=variance, where=dof > 0)
    between = sums.ms_between if sums.k > 1 else np.full(len(columns), np.nan)
    # From the sums of squares, not from the matrices: these keep the last digits (NIST StRD).
    ss_all = sums.ss_within + sums.ss_between
    return Pooling(
        names=columns,
        labels=sums.labels,
        counts=sums.counts,
        mean=sums.origin + sums.mean,
        mean_by_group=sums.origin + sums.mean_by_group,
        u_all=np.sqrt(ss_all / (sums.n - 1)),
        u_pooled=np.sqrt(sums.ms_within),
        u_by_group=np.sqrt(variance),
        ms_between=between,
        covariance_all=everything,
        covariance_pooled=pooled,
        covariance_by_group=by_group,
    )
