"""Grossly wrong readings of a folder, told at its import: which run, row and target."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from monitor.exceptions import MonitorError
from monitor.readers.unit_doubts import off_places, runs_in_units
from monitor.records import Campaign

#: So many rows are looked at together: the model takes 7 kB of memory for each, 350 MB. Plans have 60 to 10 000 a run.
MOST_TOGETHER = 50_000
#: Runs that are looked at together, where there are so many: what two or more of them read alike is no mistake of one.
FEWEST_TOGETHER = 3


def gross_doubts(campaign: Campaign) -> tuple[str, ...]:
    """A sentence for each reading that the others of its run contradict beyond doubt, by the method's own model.

    No fit is made: what only a fit or the other runs show is told by `identify`. A campaign that its method cannot
    identify has none. In more than ``MOST_TOGETHER`` rows a reading is held against its part of them alone.
    """
    # Loaded here: the methods take longer to load than a folder of curves to read.
    from monitor.methods import campaign_method
    from monitor.methods.chain.deviation import MOST_ROWS
    from monitor.methods.chain.gross import GrossReading, gross_readings
    from monitor.workflow.identify.notes import gross_noted

    readings: list[GrossReading] = []
    try:
        method = campaign_method(campaign)
        for part in _parts(campaign):
            with np.errstate(all="ignore"):
                readings += gross_readings(method.problem_of(part, method.own_model))
    except (MonitorError, np.linalg.LinAlgError):
        # What cannot be identified is said by the verb that is asked to.
        return ()
    if off_places(campaign) is not None:
        # Where the places do not fit, no single row is to blame; ``doubts`` says what is.
        return ()
    in_other_units = {odd.run for odd in runs_in_units(campaign)}
    # So many in a run are no single mistakes, as within a part, which tells so many of each of two kinds.
    counts = Counter(reading.run for reading in readings)
    return tuple(
        str(gross_noted(reading, method.nouns.target))
        for reading in readings
        if reading.run not in in_other_units and counts[reading.run] <= 2 * MOST_ROWS
    )


def _parts(campaign: Campaign) -> Iterator[Campaign]:
    """The campaign in parts of at most ``MOST_TOGETHER`` rows: whole runs where these are smaller, at least
    ``FEWEST_TOGETHER``.

    Of larger ones a part has the same rows of each run, drawn at random: each part has the poses and targets of the
    plan in the plan's shares, and a touch is in the part of the same touch of the other runs.
    """
    probings = campaign.probings
    if len(probings) <= MOST_TOGETHER:
        yield campaign
        return
    numbers, run, counts = np.unique(probings.run, return_inverse=True, return_counts=True)
    # A run that is all of a part has at most MOST_TOGETHER rows; three large ones share theirs.
    together = max(FEWEST_TOGETHER, MOST_TOGETHER // int(counts.max()))
    groups = max(1, len(numbers) // together)
    order = np.argsort(run, kind="stable")
    within = np.empty(len(run), dtype=np.int64)
    within[order] = np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts, counts)
    for group in np.array_split(np.arange(len(numbers)), groups):
        belongs = np.isin(run, group)
        pieces = -(-int(belongs.sum()) // MOST_TOGETHER)
        piece = np.random.default_rng(0).permutation(int(counts[group].max())) % pieces
        named = set(numbers[group].tolist())
        for number in range(pieces):
            rows = np.flatnonzero(belongs)
            rows = rows[piece[within[rows]] == number]
            runs = tuple(each for each in campaign.runs if each.run in named)
            yield replace(campaign, runs=runs, probings=probings.rows(rows))
