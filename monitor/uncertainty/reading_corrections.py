"""What must be added to the readings of a machine's axes so that its errors vanish at the tool tip.

An error of a joint's carriage and an error of its reading differ by the joint's sign; an error of the tip relative to
the workpiece and one of a carriage differ by the branch (+1 tool side, -1 work side) and by what turns between them.
Both functions answer in readings, where neither is left to the reader.

First order: applied, products of errors remain, 1e-4 of the error for angles of 100 µrad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.machine import LOCATION, MOTION, travel_slopes
from monitor.records import Array
from monitor.uncertainty.geometric_errors import GeometricErrors, joint_errors
from monitor.uncertainty.volumetric import VolumetricError

#: Singular values below this part of the largest are directions in which no linear axis moves the tip: those of a
#: nominal chain are 0 or of order 1, but for axes that a rotary axis has turned almost parallel, which no table
#: corrects well.
SMALLEST_SLOPE = 1e-3


@dataclass(frozen=True)
class PositioningError:
    """The error of the reading of one axis, actual less commanded, at n commanded positions: ``errors`` (n,) with ``u``
    (n,), mm or rad."""

    errors: Array
    u: Array


@dataclass(frozen=True)
class ReadingCorrections:
    """What is to be added to the readings of L linear axes at n commanded points, the rotary axes as commanded.

    ``joints`` are their indices in the chain; ``corrections`` (n, L) mm with ``u`` (n, L); ``uncorrected`` (n, 3) mm
    is the part of the error that no linear axis of the machine can move.
    """

    joints: tuple[int, ...]
    corrections: Array
    u: Array
    uncorrected: Array


def positions_itself(geometric: GeometricErrors, axis: int) -> bool:
    """Whether an error along (of a rotary axis: about) its own axis is known of the joint at an index."""
    return bool(np.any(parts_along(geometric, axis)))


def parts_along(geometric: GeometricErrors, axis: int) -> Array:
    """The part (effects,) of each effect that is along, for a rotary axis about, the axis of the joint at an index."""
    joint = geometric.chain.joints[axis]
    return np.array(
        [
            joint.direction[effect.term.component % 3]
            if effect.term.joint == axis
            and effect.term.stage in (LOCATION, MOTION)
            and effect.term.is_rotation == joint.turns
            else 0.0
            for effect in geometric.effects
        ]
    )


def positioning_error(geometric: GeometricErrors, axis: int, positions: Array) -> PositioningError:
    """The error of the reading of the joint at an index, at commanded ``positions`` (n, J).

    ISO 230-1: EXX of a linear axis, ECC of a rotary one, in readings: ``sign`` times that of the carriage. It is the
    same on either side of the bed, because the reading goes with the carriage. A constant, such as a zero angle, is
    part of it.
    """
    _, bases = joint_errors(geometric, positions, geometric.estimate)
    parts = parts_along(geometric, axis) * geometric.chain.joints[axis].sign
    slopes = np.concatenate([part * basis.columns for part, basis in zip(parts, bases, strict=True)], axis=-1)
    variance = np.einsum("nk,kl,nl->n", slopes, geometric.covariance, slopes)
    return PositioningError(slopes @ geometric.estimate, np.sqrt(np.maximum(variance, 0.0)))


def reading_corrections(geometric: GeometricErrors, error: VolumetricError) -> ReadingCorrections:
    """The corrections of the linear axes' readings that cancel a volumetric error of the same machine.

    The nominal chain says by how much the reading of each axis moves the tip relative to the workpiece at every pose.
    """
    chain = geometric.chain
    joints = tuple(index for index, joint in enumerate(chain.joints) if not joint.turns)
    none = np.zeros((len(error.positions), len(chain.joints), 2, 6))
    target = np.zeros((len(error.positions), 3))
    pose, slopes = travel_slopes(chain, error.positions, none, target, geometric.tip)
    by_reading = pose.work_rotation @ slopes * np.array([chain.joints[index].sign for index in joints])
    inverse = np.linalg.pinv(by_reading, rcond=SMALLEST_SLOPE)
    corrections = -np.einsum("nai,ni->na", inverse, error.vectors)
    covariance = inverse @ error.covariance @ np.swapaxes(inverse, -1, -2)
    return ReadingCorrections(
        joints=joints,
        corrections=corrections,
        u=np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)),
        uncorrected=error.vectors + np.einsum("nia,na->ni", by_reading, corrections),
    )
