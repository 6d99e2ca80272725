"""Grossly wrong readings of a folder, told at its import: which run, row and target."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import MonitorError
from monitor.readers.unit_doubts import off_places, runs_in_units
from monitor.records import Campaign


def gross_doubts(campaign: Campaign) -> tuple[str, ...]:
    """A sentence for each reading that the others of its run contradict beyond doubt, by the method's own model.

    No fit is made: what only a fit or the other runs show is told by `identify`. A campaign that its method cannot
    identify has none.
    """
    # Loaded here: the methods take longer to load than a folder of curves to read.
    from monitor.methods import campaign_method
    from monitor.methods.chain.gross import gross_readings
    from monitor.workflow.identify.notes import gross_noted

    try:
        method = campaign_method(campaign)
        problem = method.problem_of(campaign, method.own_model)
        with np.errstate(all="ignore"):
            readings = gross_readings(problem)
    except (MonitorError, np.linalg.LinAlgError):
        # What cannot be identified is said by the verb that is asked to.
        return ()
    if off_places(campaign) is not None:
        # Where the places do not fit, no single row is to blame; ``doubts`` says what is.
        return ()
    in_other_units = {odd.run for odd in runs_in_units(campaign)}
    return tuple(
        str(gross_noted(reading, method.nouns.target))
        for reading in readings
        if reading.run not in in_other_units
    )
