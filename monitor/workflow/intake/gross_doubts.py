"""Grossly wrong readings of a folder, told at its import: which run, row and target."""

from __future__ import annotations

from functools import partial

import numpy as np

from monitor.exceptions import MonitorError
from monitor.readers.doubts.unit_doubts import off_places, runs_in_units
from monitor.readers.row_places import RowPlaces
from monitor.records import Campaign


def gross_doubts(campaign: Campaign) -> tuple[str, ...]:
    """A sentence for each reading that the others of its run contradict beyond doubt, by the method's own model.

    No fit is made: what only a fit or the other runs show is told by `identify`. A campaign that its method cannot
    identify has none. In a campaign of very many rows a reading is held against its part of them alone.
    """
    # Loaded here: the methods take longer to load than a folder of curves to read.
    from monitor.methods import campaign_method
    from monitor.methods.chain.gross_in_parts import gross_in_parts
    from monitor.workflow.identify.notes import gross_noted

    try:
        method = campaign_method(campaign)
        with np.errstate(all="ignore"):
            search = gross_in_parts(
                campaign, partial(method.problem_of, model=method.own_model), is_fitted=False
            )
    except MonitorError:
        # What cannot be identified is said by the verb that is asked to.
        return ()
    if off_places(campaign) is not None:
        # Where the places do not fit, no single row is to blame; ``doubts`` says what is.
        return ()
    in_other_units = {odd.run for odd in runs_in_units(campaign)}
    places = RowPlaces(campaign)
    return tuple(
        str(gross_noted(reading, method.nouns.target, places))
        for reading in search.readings
        if reading.run not in in_other_units
    )
