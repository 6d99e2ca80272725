"""Columns of linear axes that look exchanged, or of the other sign, seen without a fit.

Two places that are probed at one pose differ by their declared step, turned as the rotary axes stand. Where all of
these stand at zero nothing is turned: the steps of the readings are the declared ones, axis by axis. Distances alone
do not show an exchange, which leaves them as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

from monitor.readers.unit_doubts import DISTANCE_TOLERANCE, TELLING_SHARE, declared_places, off_places, pairs
from monitor.records import Array, Campaign

AXES = "XYZ"
#: Steps from which on an arrangement is told: three places.
FEWEST_STEPS = 3


@dataclass(frozen=True)
class MistakenAxes:
    """Linear ``axes`` whose columns fit the declared places exchanged (``turned`` is false), or of the other sign
    (true; one axis); ``count`` steps between ``noun`` say so."""

    noun: str
    axes: str
    turned: bool
    count: int


def mistaken_axes(campaign: Campaign) -> MistakenAxes | None:
    """Axes whose columns look exchanged or of the other sign, by the steps between declared places in the first run at
    the pose with all rotary axes at zero. None where the steps are the declared ones, where no arrangement makes them
    so, or where nobody can know: no such pose, nothing declared, axes placed freely, a piece laid by hand."""
    declared = declared_places(campaign)
    machine, probings = campaign.machine, campaign.probings
    by_hand = "placement" in probings.channels
    if declared is None or machine.chain or by_hand or not all(axis in probings.readings for axis in AXES):
        return None
    steps, nominal = pairs(campaign, declared.places, at_zero=True)
    if len(nominal) < FEWEST_STEPS or off_places(campaign) is not None:
        return None
    nominal = nominal * _signs(campaign)
    if _share_off(steps, nominal) <= TELLING_SHARE:
        return None
    for axes, turned, arranged in _arrangements(steps):
        if _share_off(arranged, nominal) <= TELLING_SHARE / 2:
            return MistakenAxes(declared.noun, axes, turned, len(nominal))
    return None


def _signs(campaign: Campaign) -> Array:
    """What a step of the readings is to one of the place, by axis: 1 by ISO 841, on either side of the bed, and -1
    where the machine file states the other sign."""
    on_the_work = campaign.machine.topology.partition(" b ")[0].split()
    usual = {axis: -1 if axis in on_the_work else 1 for axis in AXES}
    stated = {axis: settings.sign for axis, settings in campaign.machine.axes.items()}
    return np.array([usual[axis] * (stated.get(axis) or usual[axis]) for axis in AXES], dtype=np.float64)


def _arrangements(steps: Array) -> Iterator[tuple[str, bool, Array]]:
    """Yield the mistakes, the simplest first, with the steps (n, 3) as they are with it undone."""
    for first, second in combinations(range(3), 2):
        order = [0, 1, 2]
        order[first], order[second] = second, first
        yield AXES[first] + AXES[second], False, steps[:, order]
    for axis in range(3):
        yield AXES[axis], True, steps * np.where(np.arange(3) == axis, -1.0, 1.0)
    for cycle in permutations(range(3)):
        if all(axis != at for at, axis in enumerate(cycle)):
            yield AXES, False, steps[:, list(cycle)]


def _share_off(steps: Array, nominal: Array) -> float:
    """Share of the steps that differ from the declared ones by more than the tolerance of their length."""
    off = np.linalg.norm(steps - nominal, axis=1) > DISTANCE_TOLERANCE * np.linalg.norm(nominal, axis=1)
    return float(np.mean(off))
