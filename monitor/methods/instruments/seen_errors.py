"""What a setup reads of every error of the chain: derivatives, and which of them are more than products of errors."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from monitor.machine import Chain, ChainPose, Orientation
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.reading import Shown, mean_of_runs
from monitor.records import Array

# What is read of an error's displacement is at least this part, else it comes from products of errors alone.
SECOND_ORDER = 5e-3
# A turn that moves a reading by less than this, mm/rad, is seen by rounding alone; one that turns sensors shows what
# they read, which is some tenths of a millimetre and an error itself.
LEAST_LEVER, LEAST_READ = 1e-3, 2.0


def by_error_of(chain: Chain, shown: Shown, pose: ChainPose, sides: Orientation, part: Part) -> Array:
    """Derivatives (m, k, J, 2, 6) of what a setup shows by every error."""
    assert pose.by_error is not None
    assert sides.by_error is not None
    joints, at = len(chain.joints), part.at
    total = np.zeros((len(at), shown.residual.shape[1], joints * 12))
    turns = sides.by_error[at].reshape(len(at), 3, joints * 12)
    on_tool = np.repeat(np.arange(joints) >= len(chain.work), 12)
    if shown.by_shift is not None:
        total += shown.by_shift @ pose.by_error[at].reshape(len(at), 3, joints * 12)
    if shown.by_mean is not None:
        mean = mean_of_runs(pose.by_error[at].reshape(len(at), 3, joints * 12), part.rows.run)
        total += shown.by_mean @ mean
    if shown.by_turn is not None:
        relative = np.swapaxes(sides.work[at], 1, 2) @ (turns * np.where(on_tool, 1.0, -1.0))
        total += shown.by_turn @ relative
    if shown.by_tool is not None:
        total += shown.by_tool @ (turns * on_tool)
    if shown.by_work is not None:
        total += shown.by_work @ (turns * ~on_tool)
    return total.reshape(len(at), shown.residual.shape[1], joints, 2, 6)


def first_order(
    shown: Shown, derivatives: Array, pose: ChainPose, at: npt.NDArray[np.int64]
) -> npt.NDArray[np.bool_]:
    """Which errors (J, 2, 6) a setup of lengths reads more of than products of errors.

    One that moves the tool along the line of sight alone, or across the one direction that is read, shows only through
    products with other errors. Its derivatives are taken as zero: they are as large as the other errors let them be,
    and turn with every step.
    """
    assert pose.by_error is not None
    if shown.by_shift is None:
        return np.ones(derivatives.shape[2:], dtype=bool)
    turns = shown.by_turn is not None
    moved = np.zeros(derivatives.shape[2:]) if turns else np.sum(pose.by_error[at] ** 2, axis=(0, 1))
    least = np.where(np.arange(6) < 3, 0.0, LEAST_READ if turns else LEAST_LEVER)
    size = np.sum(derivatives**2, axis=(0, 1))
    return np.asarray((size > SECOND_ORDER**2 * moved) & (size > least**2 * len(at)))
