"""A campaign of very many rows in parts that are plans of their own: for what looks at every row beside all others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from monitor.records import Campaign

#: So many rows are looked at together: the model takes 10 kB of memory for each, 250 MB. Plans have 60 to 10 000 a run.
MOST_TOGETHER = 25_000
#: The touches of the scale bar are in every part of their runs, where they are no more than this part of one.
MOST_OF_BAR = 0.1
#: Runs that are looked at together, where there are so many: what two or more of them read alike is no mistake of one.
FEWEST_TOGETHER = 3


def parts_of(campaign: Campaign) -> Iterator[tuple[npt.NDArray[np.int64], Campaign]]:
    """The campaign in parts of at most ``MOST_TOGETHER`` rows, each with the places (m,) of its rows: whole runs where
    these are smaller, at least ``FEWEST_TOGETHER``.

    Of larger ones a part has the same rows of each run, drawn at random: each part has the poses and targets of the
    plan in the plan's shares, and a touch is in the part of the same touch of the other runs. The few touches of the
    scale bar, without which no part has a unit of length, are in all parts of their runs.
    """
    probings = campaign.probings
    if len(probings) <= MOST_TOGETHER:
        yield np.arange(len(probings)), campaign
        return
    numbers, run, counts = np.unique(probings.run, return_inverse=True, return_counts=True)
    # A run that is all of a part has at most MOST_TOGETHER rows; three large ones share theirs.
    together = max(FEWEST_TOGETHER, MOST_TOGETHER // int(counts.max()))
    groups = max(1, len(numbers) // together)
    order = np.argsort(run, kind="stable")
    within = np.empty(len(run), dtype=np.int64)
    within[order] = np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts, counts)
    bar = campaign.artefact.scale_bar
    on_bar = np.isin(probings.target, () if bar is None else bar.balls)
    for group in np.array_split(np.arange(len(numbers)), groups):
        belongs = np.isin(run, group)
        pieces = -(-int(belongs.sum()) // MOST_TOGETHER)
        piece = np.random.default_rng(0).permutation(int(counts[group].max())) % pieces
        named = set(numbers[group].tolist())
        rows_of_group = np.flatnonzero(belongs)
        in_all = on_bar[rows_of_group]
        in_all &= in_all.sum() <= MOST_OF_BAR * MOST_TOGETHER
        for number in range(pieces):
            rows = rows_of_group[(piece[within[rows_of_group]] == number) | in_all]
            runs = tuple(each for each in campaign.runs if each.run in named)
            yield rows, replace(campaign, runs=runs, probings=probings.rows(rows))
