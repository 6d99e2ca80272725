"""Rows of nothing but zeros that others contradict: no readings.

Of readings that nobody contradicts ``zero_rows`` decides by their poses; a plate's first ball lies at its origin.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from monitor.records import Campaign

#: The columns of what is read as a vector.
READ = ("point_", "direction_", "tracker_")
#: One row may lie at the origin of its frame.
FEWEST = 2
#: So many sequence numbers are named.
MOST_NAMED = 12


def blank_rows(campaign: Campaign) -> frozenset[tuple[int, int]]:
    """Run and sequence of the rows that read nothing but zeros; empty where there are fewer than ``FEWEST`` of them or
    they are most of the campaign. Where axes stand at zero says nothing: a plan may pass there in every run."""
    probings = campaign.probings
    read = [values for name, values in probings.channels.items() if name.startswith(READ)]
    if not read:
        return frozenset()
    numbers = np.column_stack(read)
    blank = np.all((numbers == 0.0) | np.isnan(numbers), axis=1) & np.isfinite(numbers).any(axis=1)
    if not FEWEST <= np.count_nonzero(blank) <= len(blank) // 2:
        return frozenset()
    return frozenset(zip(probings.run[blank].tolist(), probings.sequence[blank].tolist(), strict=True))


def named_rows(run: int, sequences: Sequence[int]) -> str:
    """Run and sequence numbers of rows of one run, the first of many."""
    more = ", ..." if len(sequences) > MOST_NAMED else ""
    return f"run {run}, sequence {', '.join(map(str, sequences[:MOST_NAMED]))}{more}"


def blank_words(rows: Collection[tuple[int, int]]) -> Iterator[str]:
    """Yield the sentence on rows of zeros, of each run; none for none."""
    for run in sorted({run for run, _ in rows}):
        sequences = sorted(sequence for of_run, sequence in rows if of_run == run)
        yield (
            f"{named_rows(run, sequences)}: all that was read is 0, as programs write where they got no reading: "
            "leave these rows out"
        )
