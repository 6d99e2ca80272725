"""Rows of a run that repeat rows before them in every number: a file that was joined with itself, or exported twice.

Counted as independent they make u too small. Readings of one pose agree now and then, where they are rounded; several
rows one behind the other, each as an earlier row and in the same order, do not.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from monitor.records import Campaign

#: So many rows one behind the other, with so many different first readings among them, are no chance: a dial that shows
#: whole micrometres repeats a pose in one of three.
LEAST_ROWS, LEAST_DIFFERENT = 8, 4
#: Numbers that mix the columns of a row into one (Knuth's multiplicative hashing, by the golden ratio).
MIXING = 0x9E3779B97F4A7C15


def repeated_rows(campaign: Campaign) -> Iterator[str]:
    """A sentence on the longest block of rows that repeats an earlier one in all but its times."""
    probings = campaign.probings
    count = len(probings)
    if count < 2 * LEAST_ROWS:
        return
    columns = [*probings.readings.values(), *probings.channels.values()]
    _, first, of_row = np.unique(_mixed(probings.run, columns), return_index=True, return_inverse=True)
    earlier = first[of_row]
    repeats = earlier < np.arange(count)
    goes_on = repeats[1:] & repeats[:-1] & (np.diff(earlier) == 1)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], goes_on.astype(np.int64), [0]])))
    if not len(ends):
        return
    begins, lengths = ends[::2], np.diff(ends)[::2] + 1
    longest = int(np.argmax(lengths))
    begin, length = int(begins[longest]), int(lengths[longest])
    rows = slice(begin, begin + length)
    different = max(len(np.unique(column[rows])) for column in columns)
    if length < LEAST_ROWS or different < LEAST_DIFFERENT:
        return
    yield (
        f"{length} rows of run {probings.run[begin]}, from sequence {probings.sequence[begin]} on, equal those from "
        f"sequence {probings.sequence[earlier[begin]]} on in every number, which two measurements never do: were they "
        "exported twice, or two files joined? Counted twice they make u too small"
    )


def _mixed(run: npt.NDArray[np.int64], columns: list[npt.NDArray[np.float64]]) -> npt.NDArray[np.uint64]:
    """One number (n,) for each row of the run and all columns; different rows share one in 2^-64 of all cases."""
    mixed = run.astype(np.uint64)
    for column in columns:
        # -0.0 is 0.0; one NaN stands for an empty cell.
        bits = (np.asarray(column, dtype=np.float64) + 0.0).view(np.uint64)
        mixed = (mixed ^ bits) * np.uint64(MIXING)
        mixed ^= mixed >> np.uint64(29)
    return mixed
