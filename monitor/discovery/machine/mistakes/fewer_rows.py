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
#: Runs that are asked, the last ones.
MOST_RUNS = 5


def fewer_rows(probings: Probings) -> npt.NDArray[np.int64]:
    """The places of some rows, in order: every setup of every run has as many, or all of its rows.

    They are at most ``MOST_ROWS``, or, where these are fewer than ``FEWEST_OF_SETUP`` of each, so many of each in the
    last ``MOST_RUNS`` runs. One row is drawn of every so many that follow each other in the order of their targets and
    poses, always the same ones: each n-th in the order of time would be the same pass of a plan that goes to and fro.
    """
    looked_at = np.arange(len(probings))
    counts = _setups_of_runs(probings)[1]
    if np.minimum(counts, FEWEST_OF_SETUP).sum() > MOST_ROWS:
        looked_at = np.flatnonzero(np.isin(probings.run, np.unique(probings.run)[-MOST_RUNS:]))
    some = probings.rows(looked_at)
    group, counts = _setups_of_runs(some)
    rows = np.lexsort([*some.readings.values(), some.target, group])
    share = _share(counts.tolist())
    rng = np.random.default_rng(0)
    members = np.split(rows, np.cumsum(counts)[:-1])
    drawn = np.concatenate([_drawn(each, share, rng) for each in members])
    return np.asarray(looked_at[np.sort(drawn)])


def _setups_of_runs(probings: Probings) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The number (n,) of the setup and run of each row, and how many rows each of these has."""
    pairs = np.column_stack([probings.run, probings.channels["setup"]])
    _, group, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    return group.reshape(-1), counts


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
