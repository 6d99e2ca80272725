"""Fewer rows of a campaign, in which every setup of every run still says what it has to say.

A mistake of a column contradicts by many standard uncertainties: of thousands of rows some hundred show it as well.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.records import Probings

#: So many rows of all are looked at, and at least so many of each setup in a run, by which its scatter is known to a
#: sixth.
MOST_ROWS, FEWEST_OF_SETUP = 500, 30


def fewer_rows(probings: Probings) -> npt.NDArray[np.int64]:
    """The places of at most ``MOST_ROWS`` rows, in order: every target of every run has as many, or all of its rows.

    One row is drawn of every so many that follow each other in the order of their poses, always the same ones: each
    n-th in the order of time would be the same pass of a plan that goes to and fro.
    """
    _, target = np.unique(probings.target, return_inverse=True)
    _, group = np.unique(np.column_stack([probings.run, target]), axis=0, return_inverse=True)
    group = group.reshape(-1)
    rows = np.lexsort([*probings.readings.values(), group])
    members = np.split(rows, np.cumsum(np.bincount(group))[:-1])
    share = _share([len(each) for each in members])
    rng = np.random.default_rng(0)
    return np.sort(np.concatenate([_drawn(each, share, rng) for each in members]))


def _share(counts: list[int]) -> int:
    """How many rows each of several has at most, so that all together have ``MOST_ROWS``."""
    rows_to_share = MOST_ROWS
    for smaller, count in enumerate(sorted(counts)):
        share = rows_to_share // (len(counts) - smaller)
        if count > share:
            return max(share, FEWEST_OF_SETUP)
        rows_to_share -= count
    return max(counts)


def _drawn(rows: npt.NDArray[np.int64], share: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """One row of each of ``share`` equal parts; all where there are no more."""
    if len(rows) <= share:
        return rows
    edges = np.linspace(0, len(rows), share + 1).astype(np.int64)
    return rows[rng.integers(edges[:-1], edges[1:])]
