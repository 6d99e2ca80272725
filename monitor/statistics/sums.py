"""Sums of squares between and within groups, for all columns at once, safe against common leading digits.

Everything that compares groups (pooling, ANOVA, Bartlett, variance components) starts from these. The
values are centred twice: on the first row, which is exact for numbers that share their leading digits, and
on the means; the textbook formula (sum of squares less squared sum) loses all digits of NIST's SmLs07-09.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_matrix


@dataclass(frozen=True)
class GroupedSums:
    """Sufficient statistics of n runs in k groups for p columns.

    ``centred`` (n, p) are the values less ``origin`` (p,), ``index`` (n,) the group of each run,
    ``mean`` (p,) and ``mean_by_group`` (k, p) are relative to ``origin``; ``residual`` (n, p) are the values
    less the mean of their group; ``ss_by_group`` (k, p) sums their squares group by group, ``ss_between``
    (p,) is the weighted sum of squares of the group means about the mean.
    """

    labels: tuple[str, ...]
    index: npt.NDArray[np.intp]
    counts: npt.NDArray[np.int64]
    origin: Array
    centred: Array
    mean: Array
    mean_by_group: Array
    residual: Array
    ss_by_group: Array
    ss_between: Array

    @property
    def n(self) -> int:
        """Number of runs."""
        return len(self.index)

    @property
    def k(self) -> int:
        """Number of groups."""
        return len(self.labels)

    @property
    def ss_within(self) -> Array:
        """Sum of squares within the groups (p,)."""
        return np.asarray(self.ss_by_group.sum(axis=0))

    @property
    def dof_within(self) -> int:
        """Degrees of freedom within the groups, n - k."""
        return self.n - self.k

    @property
    def dof_between(self) -> int:
        """Degrees of freedom between the groups, k - 1."""
        return self.k - 1

    @property
    def ms_within(self) -> Array:
        """Mean square within (p,); the pooled variance."""
        return self.ss_within / self.dof_within

    @property
    def ms_between(self) -> Array:
        """Mean square between (p,)."""
        return self.ss_between / self.dof_between


def label_groups(groups: npt.ArrayLike, n: int) -> tuple[tuple[str, ...], npt.NDArray[np.intp]]:
    """Distinct labels in order, as text, and the index (n,) of each run's label.

    Numbers rise, also those in texts: day 2 before day 10, ``below 4`` before ``4 to 6`` before ``above 6``.
    """
    array = np.asarray(groups)
    if array.shape != (n,):
        raise DataError(f"groups has shape {array.shape}; ({n},) is needed, one label for each run.")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        at = int(np.flatnonzero(~np.isfinite(array))[0])
        raise DataError(f"groups[{at}] is {array[at]}; every run needs a label.")
    if n and array.dtype.kind in "iu" and (array[1:] >= array[:-1]).all():
        # Days mostly come in their order, and one machine asks for the same ones again and again.
        new = np.concatenate([[True], array[1:] > array[:-1]])
        return tuple(map(str, array[new].tolist())), np.cumsum(new) - 1
    distinct, index = np.unique(array, return_inverse=True)
    if array.dtype.kind not in "UO":
        return tuple(str(label) for label in distinct), index.astype(np.intp)
    texts = [str(label) for label in distinct]
    order = sorted(range(len(texts)), key=lambda index_of_text: _natural(texts[index_of_text]))
    rank = np.empty(len(order), dtype=np.intp)
    rank[order] = np.arange(len(order))
    return tuple(texts[index_of_text] for index_of_text in order), rank[index]


_NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def _natural(label: str) -> tuple[object, ...]:
    """A key that sorts the numbers in texts by their size; a bin without a lower end comes first."""
    bin_of = re.match(r"\s*(below |above )?(" + _NUMBER.pattern + r")(?![\d-])", label)
    if bin_of is not None:
        side = {"below ": -1, "above ": 1}.get(bin_of[1] or "", 0)
        return (0, float(bin_of[2]), side, label)
    # Texts and whole numbers take turns, so that like is compared with like.
    parts = re.split(r"(\d+)", label)
    return (1, *(int(part) if position % 2 else part for position, part in enumerate(parts)))


def grouped_sums(
    values: npt.ArrayLike, groups: npt.ArrayLike, *, least_groups: int = 2, least_runs: int = 1
) -> GroupedSums:
    """Sums of squares of ``values`` (n, p), any unit, by ``groups`` (n,).

    Raises ``DataError`` for non-finite values, fewer than ``least_groups`` groups, a group with fewer than
    ``least_runs`` runs, or no group with more than one run.
    """
    matrix = as_matrix(values, "values")
    n = len(matrix)
    labels, index = label_groups(groups, n)
    counts = np.bincount(index, minlength=len(labels)).astype(np.int64)
    if len(labels) < least_groups:
        raise DataError(
            f"the runs form {len(labels)} group ({', '.join(labels)}); at least {least_groups} are needed"
        )
    short = np.flatnonzero(counts < least_runs)
    if short.size:
        at = int(short[0])
        raise DataError(
            f"group {labels[at]} has {counts[at]} run(s); at least {least_runs} are needed in each."
        )
    if n <= len(labels):
        raise DataError(
            f"{n} runs in {len(labels)} groups leave nothing within them; repeat runs in a group."
        )
    origin = matrix[0].copy()
    centred = matrix - origin
    mean = _mean(centred)
    mean_by_group = np.empty((len(labels), matrix.shape[1]))
    ss_by_group = np.empty_like(mean_by_group)
    residual = np.empty_like(centred)
    for j in range(len(labels)):
        rows = index == j
        mean_by_group[j] = _mean(centred[rows])
        deviation = centred[rows] - mean_by_group[j]
        residual[rows] = deviation
        ss_by_group[j] = _sum_of_squares(deviation)
    offset = mean_by_group - mean
    ss_between = np.asarray((counts[:, np.newaxis] * offset * offset).sum(axis=0))
    return GroupedSums(
        labels, index, counts, origin, centred, mean, mean_by_group, residual, ss_by_group, ss_between
    )


def _mean(rows: Array) -> Array:
    """Column means, corrected once by the mean of the remainders."""
    first: Array = rows.mean(axis=0)
    return np.asarray(first + (rows - first).mean(axis=0))


def _sum_of_squares(deviation: Array) -> Array:
    """Sum of squares of deviations, less what the rounding of the mean left in them (Chan et al. 1983)."""
    remainder = deviation.sum(axis=0)
    return np.asarray((deviation * deviation).sum(axis=0) - remainder * remainder / len(deviation))
