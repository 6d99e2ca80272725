"""Where the linear axes must stand so that the tip touches a target, for given angles."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import DataError
from monitor.machine.chain import ChainPose, evaluate
from monitor.machine.terms import MOTION
from monitor.machine.topology import Chain
from monitor.records import Array

# A nominal chain is linear in its linear axes, so one step is exact; small errors leave products of second
# order, and each further step squares what is left: 1e-3 mm, 1e-9 mm, below a double's last digit.
STEPS = 5
CLOSE_ENOUGH = 1e-9


def refuse_untouchable(chain: Chain) -> None:
    """DataError for a chain whose linear axes cannot bring its tip to any target."""
    linear = chain.of_kind("linear")
    if len(linear) < 3:
        raise DataError(
            f"'{chain.topology}' has {len(linear)} linear axes; a touch needs three to reach its target"
        )


def travel_slopes(
    chain: Chain, positions: Array, errors: Array, target: Array, tip: Array
) -> tuple[ChainPose, Array]:
    """Return the chain at its poses, and the derivative (n, 3, L) of the residual by the displacement of each linear
    joint.

    The arguments are as in ``evaluate``, the L linear joints in the order of ``chain.joints``. The derivative stands
    in the frame of the last work axis, as the residual does; along a joint it is that by the joint's own positioning
    error.
    """
    linear = [index for index, joint in enumerate(chain.joints) if not joint.turns]
    directions = np.array([chain.joints[index].direction for index in linear])
    pose = evaluate(chain, positions, errors, target, tip, jacobian=True)
    assert pose.by_error is not None
    shifts = pose.by_error[..., linear, MOTION, :3]  # (n, 3, axes, component)
    return pose, np.einsum("...rac,ac->...ra", shifts, directions)


def touching_positions(chain: Chain, positions: Array, errors: Array, target: Array, tip: Array) -> Array:
    """Positions (n, J) with the linear axes moved so that tip and target coincide.

    ``positions`` (n, J) gives the rotary axes and a start for the linear ones, in mm and rad; the other
    arguments are as in ``evaluate``. Raises DataError where the linear axes cannot reach the target.
    """
    refuse_untouchable(chain)
    touching = np.array(positions, dtype=float)
    linear = [index for index, joint in enumerate(chain.joints) if not joint.turns]
    for _ in range(STEPS):
        pose, slopes = travel_slopes(chain, touching, errors, target, tip)
        if np.abs(pose.residual).max(initial=0.0) < CLOSE_ENOUGH:
            return touching
        touching[..., linear] -= np.einsum("...ar,...r->...a", np.linalg.pinv(slopes), pose.residual)
    miss = float(np.abs(evaluate(chain, touching, errors, target, tip).residual).max())
    if miss > CLOSE_ENOUGH * 1e3:
        raise DataError(
            f"the linear axes of '{chain.topology}' cannot reach every target: {miss:.3g} mm are left"
        )
    return touching
