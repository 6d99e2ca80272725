"""Nominal numbers in place of readings, as a mistake that `explain` names: without these rows the rest is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery import Fit, Mistake
from monitor.discovery.machine.mistakes.cures import Maker, fitted
from monitor.readers.doubts.nominal_readings import named_range, nominal_readings
from monitor.records import Campaign


def pasted(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistake that readings are nominal ones; ``first`` is the fit of the campaign as recorded. Empty where the
    other rows have no fit of their own: what is left then are the nominal ones."""
    found = nominal_readings(campaign)
    if not found:
        return ()
    is_read = np.ones(len(campaign.probings), dtype=bool)
    for each in found:
        is_read[each.rows] = False
    rest = (
        fitted(replace(campaign, probings=campaign.probings.rows(is_read)), problem_of)
        if is_read.any()
        else None
    )
    if rest is None:
        return ()
    what = " and ".join(
        f"{each.what} of setup {each.setup} were no readings in {named_range(campaign, each.rows)}, but nominal "
        "values that were put in (undone: without these rows)"
        for each in found
    )
    return (Mistake(what, first.rms, rest.rms),)
