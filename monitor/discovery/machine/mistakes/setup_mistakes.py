"""Mistakes of the readings of one setup: without it the others agree, and with a mistake undone in it they do with it.

Another sign of a bar, or two exchanged components of an R-test, contradict what the other instruments say of the same
machine by micrometres: an effect that is sought for that takes them for a worn bearing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.mistakes.column_mistakes import (
    Trial,
    all_signs,
    measured_columns,
    reading_mistakes,
    turned_axes,
    unit_mistakes,
)
from monitor.discovery.machine.mistakes.cures import Maker, Mistake, fitted
from monitor.records import Array, Campaign, Probings

#: What agrees leaves no more than this, in stated standard uncertainties.
AGREES = 1.1
#: A mistake that does the same leaves the same, but for rounding.
AS_WELL = 1.02


def find_setup_mistakes(campaign: Campaign, problem_of: Maker, first: Fit) -> tuple[Mistake, ...]:
    """The mistakes of a single setup; several where its readings cannot say which it was, the smallest remainder first.

    ``first`` is the fit of the campaign as recorded. Empty where it agrees with what is stated, where the campaign has
    fewer than three setups, or where no mistake of the one that contradicts the others brings all to agreement.
    """
    setups = [str(name) for name in np.unique(campaign.probings.target)]
    described = {setup.id for setup in campaign.artefact.setups}
    if len(setups) < 3 or not described.issuperset(setups) or _agrees(first):
        return ()
    cures = [
        cure
        for name in setups
        if _agree_without(campaign, problem_of, name)
        for cure in _cures(campaign, problem_of, first, name)
    ]
    least = min((cure.rms_undone for cure in cures), default=0.0)
    return tuple(
        sorted(
            (cure for cure in cures if cure.rms_undone <= AS_WELL * least),
            key=lambda cure: float(f"{cure.rms_undone:.3g}"),
        )
    )


def _agrees(fit: Fit) -> bool:
    """Whether what is left is what the stated uncertainties let expect."""
    return fit.rms <= AGREES * fit.sigma


def _agree_without(campaign: Campaign, problem_of: Maker, setup: str) -> bool:
    """Whether all others agree without a setup."""
    rest = campaign.probings.rows(campaign.probings.target != setup)
    fit = fitted(replace(campaign, probings=rest), problem_of)
    return fit is not None and _agrees(fit)


def _cures(campaign: Campaign, problem_of: Maker, first: Fit, setup: str) -> list[Mistake]:
    """The mistakes of a setup with which undone everything agrees; signs of axes where none of its readings is one."""
    mask = campaign.probings.target == setup
    part = replace(campaign, probings=_with_its_columns(campaign.probings.rows(mask)))
    measured = measured_columns(part)
    # Readings in a smaller unit would be next to nothing once that is undone, which contradicts nothing.
    of_readings = chain(reading_mistakes(part), all_signs(measured), unit_mistakes(measured, 1.0))
    for trials in (of_readings, _turned_axes(part)):
        cures = []
        for what, undo in trials:
            fit = fitted(_with_rows(campaign, mask, undo(part).probings), problem_of)
            if fit is not None and _agrees(fit):
                cures.append(Mistake(f"{what.split(' (`')[0]} in setup {setup}", first.rms, fit.rms))
        if cures:
            return cures
    return []


def _turned_axes(part: Campaign) -> Iterator[Trial]:
    readings = part.probings.readings
    moved = [axis for axis in readings if np.ptp(readings[axis]) > 0]
    linear = [axis for axis in moved if part.machine.is_linear(axis)]
    yield from turned_axes(linear, [axis for axis in moved if axis not in linear])


def _with_its_columns(probings: Probings) -> Probings:
    """The rows of a setup without the columns that it does not have."""
    recorded = {name: values for name, values in probings.channels.items() if np.isfinite(values).any()}
    return replace(probings, channels=recorded)


def _with_rows(campaign: Campaign, mask: npt.NDArray[np.bool_], undone: Probings) -> Campaign:
    """The campaign with some rows as undone."""
    probings = campaign.probings
    readings = _merged(probings.readings, mask, undone.readings)
    channels = _merged(probings.channels, mask, undone.channels)
    return replace(campaign, probings=replace(probings, readings=readings, channels=channels))


def _merged(
    columns: Mapping[str, Array], mask: npt.NDArray[np.bool_], undone: Mapping[str, Array]
) -> dict[str, Array]:
    merged = {name: np.array(values) for name, values in columns.items()}
    for name, values in undone.items():
        merged[name][mask] = values
    return merged
