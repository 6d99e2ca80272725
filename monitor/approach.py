"""From which side an axis came to its positions, in the order of measuring (ISO 230-2)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.exceptions import InputError
from monitor.records import Array

#: Positions nearer than this, in mm and in rad, are one target.
ONE_TARGET, ONE_TARGET_RAD = 0.05, 1e-4


def targets_of(position: Array, tolerance: float) -> npt.NDArray[np.int64]:
    """The target (n,) of each position (n,), counted from the lowest; positions within ``tolerance`` are one."""
    number = np.cumsum(np.concatenate([[True], np.diff(np.sort(position)) > tolerance])) - 1
    target = np.empty(len(position), dtype=np.int64)
    target[np.argsort(position, kind="stable")] = number
    return target


def directions_of_approach(position: Array) -> npt.NDArray[np.int64]:
    """The direction (n,), 1 or -1, in which each position (n,) was approached, in the order of measuring.

    A position that repeats the one before was left and approached again from beyond, in the direction of the next
    move (ISO 230-2, figure 1: bi-directional runs turn beyond the end); so is the first, and one to which the axis
    returned across half of the targets without a reading, between runs of shorter steps the other way: there a run of
    a unidirectional test begins. Raises InputError where nothing moves.
    """
    move = np.sign(np.diff(position))
    if not np.any(move):
        raise InputError("all positions are the same; a test of positioning needs two or more")
    targets, number = np.unique(position, return_inverse=True)
    across = np.abs(np.diff(number))
    is_jump = (across > len(targets) / 2.0) & (across > 1)
    step = np.where(is_jump, 0.0, move)
    before, behind = np.concatenate([-move[:1], step[:-1]]), np.append(step[1:], 0.0)
    is_return = is_jump & (move * before < 0.0) & (move * behind < 0.0)
    direction = np.concatenate([[0.0], np.where(is_return, 0.0, move)])
    following = 0.0
    for index in range(len(direction) - 1, -1, -1):
        if direction[index] == 0.0:
            direction[index] = following
        else:
            following = direction[index]
    for index in range(1, len(direction)):
        if direction[index] == 0.0:
            direction[index] = direction[index - 1]
    return direction.astype(np.int64)
