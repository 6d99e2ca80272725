"""Columns of linear axes that look exchanged, or of the other sign, seen without a fit.

Two places that are probed at one pose differ by their declared step, turned as the rotary axes stand. Where all of
these stand at zero nothing is turned: the steps of the readings are the declared ones, axis by axis. Distances alone
do not show an exchange, which leaves them as they are. A piece without declared places whose touches have normals has
faces: steps between touches of one face lie in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
import numpy.typing as npt

from monitor.readers.doubts.unit_doubts import (
    DISTANCE_TOLERANCE,
    TELLING_SHARE,
    ZERO_RAD,
    declared_places,
    off_places,
    pairs,
)
from monitor.records import Array, Campaign

AXES = "XYZ"
#: Steps from which on an arrangement is told: three places.
FEWEST_STEPS = 3
#: What holds for steps between declared places, and for those between touches of one face.
DECLARED, IN_THE_FACE = "are the declared ones", "lie in that face"
#: A normal with a component above this points along an axis; a face tilted by a degree has 0.9998.
ALONG_AN_AXIS = 0.999


@dataclass(frozen=True)
class MistakenAxes:
    """Linear ``axes`` whose columns fit the declared places exchanged (``turned`` is false), or of the other sign
    (true; one axis); ``count`` steps between ``noun`` say so, of which then ``holds`` is true."""

    noun: str
    axes: str
    turned: bool
    count: int
    holds: str = DECLARED


def mistaken_axes(campaign: Campaign) -> MistakenAxes | None:
    """Axes whose columns look exchanged or of the other sign, by the steps between declared places in the first run at
    the pose with all rotary axes at zero. None where the steps are the declared ones, where no arrangement makes them
    so, or where nobody can know: no such pose, nothing declared, axes placed freely, a piece laid by hand."""
    declared = declared_places(campaign)
    machine, probings = campaign.machine, campaign.probings
    by_hand = "placement" in probings.channels
    if machine.chain or by_hand or not all(axis in probings.readings for axis in AXES):
        return None
    if declared is None:
        return _out_of_their_faces(campaign)
    steps, nominal = pairs(campaign, declared, at_zero=True)
    if len(nominal) < FEWEST_STEPS or off_places(campaign) is not None:
        return None
    # Places in one line: a piece that stands turned looks like an exchange.
    if (
        declared.by_normals
        and np.linalg.matrix_rank(nominal, tol=DISTANCE_TOLERANCE * np.linalg.norm(nominal, 2)) < 2
    ):
        return None
    nominal = nominal * _signs(campaign)
    if _share_off(steps, nominal) <= TELLING_SHARE:
        return None
    for axes, turned, arranged in _arrangements(steps):
        if _share_off(arranged, nominal) <= TELLING_SHARE / 2:
            return MistakenAxes(declared.noun, axes, turned, len(nominal))
    return None


def _out_of_their_faces(campaign: Campaign) -> MistakenAxes | None:
    """Axes whose columns look exchanged by the steps between touches of one face, by their stated normals, in the first
    run at the pose with all rotary axes at zero; where several exchanges would do, the axes of all of them."""
    steps, normal = _steps_in_faces(campaign)
    if not len(steps) or _out_of_face(steps, normal) <= TELLING_SHARE:
        return None
    fitting = [
        axes
        for axes, turned, arranged in _arrangements(steps)
        if not turned and _out_of_face(arranged, normal) <= TELLING_SHARE / 2
    ]
    if not fitting:
        return None
    # A turn of all three is told where no exchange of two does.
    axes = "".join(axis for axis in AXES if any(axis in pair for pair in fitting if len(pair) == 2)) or AXES
    return MistakenAxes("touches of one face", axes, False, len(steps), IN_THE_FACE)


def _steps_in_faces(campaign: Campaign) -> tuple[Array, Array]:
    """The steps (n, 3) in mm between touches with one normal along an axis, and that normal's axis as 1 in (n, 3)."""
    probings = campaign.probings
    names = [f"normal_{axis}" for axis in "xyz"]
    if not all(name in probings.channels for name in names):
        return np.zeros((0, 3)), np.zeros((0, 3))
    rows: npt.NDArray[np.bool_] = np.asarray(probings.run == probings.run[0], dtype=np.bool_)
    for name, values in probings.readings.items():
        if not campaign.machine.is_linear(name):
            rows = rows & (np.abs(values) < ZERO_RAD)
    rows = rows & ~np.isin(probings.target, [ball.id for ball in campaign.artefact.balls])
    normal = np.column_stack([probings.channels[name][rows] for name in names])
    read = np.column_stack([probings.readings[axis][rows] for axis in AXES])
    steps, along = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for axis in range(3):
        for side in (1.0, -1.0):
            face = read[side * normal[:, axis] > ALONG_AN_AXIS]
            if len(face) < 2:
                continue
            of_face = face[1:] - face[:-1]
            of_face = of_face[np.linalg.norm(of_face, axis=1) > 0.0]
            steps.append(of_face)
            along.append(np.tile(np.eye(3)[axis], (len(of_face), 1)))
    return np.concatenate(steps), np.concatenate(along)


def _out_of_face(steps: Array, normal: Array) -> float:
    """The largest share of the steps, by the axis of the normal, that leave their face by more than the tolerance."""
    leaves = np.abs(np.sum(steps * normal, axis=1)) > DISTANCE_TOLERANCE * np.linalg.norm(steps, axis=1)
    shares = [
        float(np.mean(leaves[normal[:, axis] == 1.0]))
        for axis in range(3)
        if np.sum(normal[:, axis] == 1.0) >= FEWEST_STEPS
    ]
    return max(shares, default=0.0)


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
