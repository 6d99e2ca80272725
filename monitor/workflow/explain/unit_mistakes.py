"""Lengths in another unit than mm, as a mistake that `explain` names: undone, the campaign fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery import Fit, Mistake
from monitor.discovery.machine.mistakes.cures import Maker, cured_rms
from monitor.readers.doubts.unit_doubts import RunInUnit, off_places, runs_in_units
from monitor.records import Array, Campaign
from monitor.units import UNIT_WORDS


def units_mistaken(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistake of units that undone lets the readings fit, of all runs or of single ones; ``first`` is the fit of
    the campaign as recorded without its gross readings, which such a mistake makes of rows that are right."""
    off, odd_runs = off_places(campaign), runs_in_units(campaign)
    if off is not None and off.unit is not None:
        columns = tuple(f"{axis.lower()}_mm" for axis in off.axes)
        odd_runs = tuple(RunInUnit(run.run, columns, off.ratio, off.unit) for run in campaign.runs)
        what = f"{', '.join(columns)} {'were' if len(columns) > 1 else 'was'} {UNIT_WORDS[off.unit]}"
    else:
        what = " and ".join(
            f"{', '.join(odd.columns)} of run {odd.run} were {UNIT_WORDS[odd.unit]}" for odd in odd_runs
        )
    undone = campaign
    for odd in odd_runs:
        undone = _undone(undone, odd)
    rms = cured_rms(undone, problem_of, float("inf")) if odd_runs else None
    return () if rms is None else (Mistake(what, first.rms, rms),)


def _undone(campaign: Campaign, odd: RunInUnit) -> Campaign:
    """The campaign with the columns of one run in mm."""
    probings = campaign.probings
    factor = np.where(probings.run == odd.run, odd.unit.factor, 1.0)

    def scaled(name: str, values: Array) -> Array:
        return values * factor if name in odd.columns else values

    return replace(
        campaign,
        probings=replace(
            probings,
            readings={
                axis: scaled(f"{axis.lower()}_mm", values) for axis, values in probings.readings.items()
            },
            channels={name: scaled(name, values) for name, values in probings.channels.items()},
        ),
    )
