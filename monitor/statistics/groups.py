"""Groups of runs that are off together, as those that one instrument measured: columns fitted beside what is asked.

What goes with a group as well as with a cause says nothing of the cause. So the means of the groups are left free
(``group_columns``), and what is left of the cause decides; ``share_within`` says how much that is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: A column that keeps less than this part of its length beside others says nothing beyond them.
NOTHING_NEW = 1e-6


def group_columns(groups: npt.NDArray[np.intp]) -> Array:
    """Return the indicators (n, g - 1) of all groups (n,) but the first."""
    return np.asarray(groups[:, np.newaxis] == np.unique(groups)[1:], dtype=np.float64)


def eras(groups: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Number (n,) the stretches, in the order of runs, that have no group in common with those before and after."""
    places = np.arange(len(groups))
    last = {group: int(places[groups == group][-1]) for group in np.unique(groups).tolist()}
    until = np.maximum.accumulate([last[group] for group in groups.tolist()])
    # A run begins a stretch where all groups that came before it have had their last.
    return np.asarray(np.cumsum(np.concatenate([[False], until[:-1] < places[1:]])), dtype=np.intp)


def interleaved_columns(groups: npt.NDArray[np.intp]) -> Array:
    """Return the indicators (n, k) of the groups that take turns with others: of those of one era all but the first.

    Between two eras the groups change for good: what changes there is a step, whoever made it.
    """
    columns = []
    for era in np.unique(of := eras(groups)).tolist():
        inside = of == era
        columns += [groups == group for group in np.unique(groups[inside])[1:]]
    return np.column_stack(columns).astype(np.float64) if columns else np.empty((len(groups), 0))


def independent_columns(columns: Array) -> list[int]:
    """Return which of the columns (n, k) the ones before them do not explain."""
    basis: list[Array] = []
    independent = []
    for index, column in enumerate(columns.T):
        rest = column
        for _ in range(2):
            rest = rest - sum((direction * (direction @ rest) for direction in basis), np.zeros_like(rest))
        if np.linalg.norm(rest) > NOTHING_NEW * np.linalg.norm(column):
            basis.append(rest / np.linalg.norm(rest))
            independent.append(index)
    return independent


def share_within(columns: Array, groups: npt.NDArray[np.intp], weight: Array | None = None) -> float:
    """Return the least share of the variance of columns (n, k), together, that lies within the groups (n,): 0 where a
    combination of them is the same in every run of a group; ``weight`` (n,) that of the runs."""
    weights = np.ones(len(groups)) if weight is None else weight
    root = np.sqrt(weights)[:, np.newaxis]
    about = columns - np.average(columns, axis=0, weights=weights)
    index = np.unique(groups, return_inverse=True)[1]
    total = np.bincount(index, weights)
    means = np.column_stack([np.bincount(index, weights * column) / total for column in about.T])
    whole, inner = (np.linalg.qr(root * part, mode="r") for part in (about, about - means[index]))
    values = np.linalg.svd(inner @ np.linalg.pinv(whole), compute_uv=False)
    return float(np.min(values, initial=1.0) ** 2)


def most_common(sides: Sequence[npt.NDArray[np.intp]]) -> int | None:
    """Return the group that all sides have, of several the one of which the side with the fewest has most; None
    without one."""
    common = sorted(set.intersection(*(set(side.tolist()) for side in sides)))
    return max(common, key=lambda group: min(int((side == group).sum()) for side in sides), default=None)
