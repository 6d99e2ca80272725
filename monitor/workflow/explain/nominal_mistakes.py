"""Nominal numbers in place of readings, as a mistake that `explain` names: without these rows the rest is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery import Fit, Mistake
from monitor.discovery.machine.mistakes.cures import Maker, fitted
from monitor.readers.doubts.nominal_readings import nominal_mistake, nominal_readings
from monitor.records import Campaign


def pasted(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistake that readings are nominal ones; ``first`` is the fit of the campaign as recorded. Empty where the
    other rows have no fit of their own: what is left then are the nominal ones."""
    nominal = nominal_readings(campaign)
    if not nominal:
        return ()
    is_read = np.ones(len(campaign.probings), dtype=bool)
    for each in nominal:
        is_read[each.rows] = False
    rest = (
        fitted(replace(campaign, probings=campaign.probings.rows(is_read)), problem_of)
        if is_read.any()
        else None
    )
    if rest is None:
        return ()
    return (Mistake(nominal_mistake(campaign, nominal), first.rms, rest.rms),)
