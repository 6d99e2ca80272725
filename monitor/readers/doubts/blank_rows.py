"""Rows of nothing but zeros that others contradict: no readings.

Of readings that nobody contradicts ``zero_rows`` decides by their poses; a plate's first ball lies at its origin.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from monitor.records import Campaign

#: The columns of what is read as a vector.
READ = ("point_", "direction_", "tracker_")
#: One row may lie at the origin of its frame.
FEWEST = 2
#: So many sequence numbers are named.
MOST_NAMED = 12


def blank_rows(campaign: Campaign) -> frozenset[tuple[int, int]]:
    """Run and sequence of the rows that read nothing but zeros; empty where there are fewer than ``FEWEST`` of them or
    they are most of the campaign. Where axes stand at zero says nothing: a plan may pass there in every run; but where
    targets whose places are stated were all met there, the axes are what was read."""
    probings = campaign.probings
    read = [values for name, values in probings.channels.items() if name.startswith(READ)]
    if not read:
        return frozenset()
    numbers = np.column_stack(read)
    blank = np.all((numbers == 0.0) | np.isnan(numbers), axis=1) & np.isfinite(numbers).any(axis=1)
    by_axes = _of_stated_places(campaign)
    linear = [values for name, values in probings.readings.items() if campaign.machine.is_linear(name)]
    if by_axes.any() and linear:
        still = by_axes & np.all([values == 0.0 for values in linear], axis=0)
        # One ball may lie at the zero of the axes; several do where nothing was read.
        if len(np.unique(probings.target[still])) > 1:
            blank = np.where(by_axes, still, blank)
    if not FEWEST <= np.count_nonzero(blank) <= len(blank) // 2:
        return frozenset()
    return frozenset(zip(probings.run[blank].tolist(), probings.sequence[blank].tolist(), strict=True))


def _of_stated_places(campaign: Campaign) -> npt.NDArray[np.bool_]:
    """The rows (n,) of setups whose targets have stated places."""
    probings = campaign.probings
    numbers = [index + 1 for index, setup in enumerate(campaign.artefact.setups) if "targets" in setup.known]
    if "setup" not in probings.channels:
        return np.zeros(len(probings), dtype=bool)
    return np.isin(probings.channels["setup"], numbers)


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
