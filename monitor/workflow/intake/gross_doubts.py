"""Grossly wrong readings of a folder, told at its import: which run, row and target."""

from __future__ import annotations

from collections import Counter

import numpy as np

from monitor.exceptions import MonitorError
from monitor.readers.unit_doubts import off_places, runs_in_units
from monitor.records import Campaign


def gross_doubts(campaign: Campaign) -> tuple[str, ...]:
    """A sentence for each reading that the others of its run contradict beyond doubt, by the method's own model.

    No fit is made: what only a fit or the other runs show is told by `identify`. A campaign that its method cannot
    identify has none. In a campaign of very many rows a reading is held against its part of them alone.
    """
    # Loaded here: the methods take longer to load than a folder of curves to read.
    from monitor.methods import campaign_method
    from monitor.methods.chain.deviation import MOST_ROWS
    from monitor.methods.chain.gross import GrossReading, gross_readings
    from monitor.methods.chain.parts import parts_of
    from monitor.workflow.identify.notes import gross_noted

    readings: list[GrossReading] = []
    try:
        method = campaign_method(campaign)
        for _, part in parts_of(campaign):
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
