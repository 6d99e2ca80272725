"""The 21 errors of a three-axis machine, as polynomials: the base effects of the method ``l-shape``."""

from __future__ import annotations

from monitor.exceptions import DataError
from monitor.machine import Chain

# Error motions are cubic polynomials that vanish where the axis reads zero, as in Eqs. (25) to (36) of the source.
ORDERS = (1, 2, 3)


def l_shape_base(chain: Chain) -> tuple[str, ...]:
    """The errors of a three-axis machine: squareness, and of every axis six cubics.

    The straightness has no linear term: that is the direction of the axis, and squareness already. Raises DataError
    for a chain of other axes than three linear ones.
    """
    if len(chain.joints) != 3 or any(joint.turns for joint in chain.joints):
        axes = ", ".join(joint.name for joint in chain.joints)
        raise DataError(f"l-shape is a method for three linear axes; this machine has {axes}")
    frame, second, third = sorted(chain.joints, key=lambda joint: joint is not (chain.work or chain.tool)[0])
    # The second axis may turn in the plane that the first one spans with it, the third about both of them.
    across = [joint.direction.index(1.0) for joint in (frame, second, third)]
    effects = [f"E{'ABC'[across[2]]}0{second.name}"]
    effects += [f"E{'ABC'[axis]}0{third.name}" for axis in sorted(across[:2])]
    for joint in chain.joints:
        for component in "XYZABC":
            along = component in "XYZ" and joint.direction["XYZ".index(component)] == 1.0
            straight = component in "XYZ" and not along
            effects += [
                f"E{component}{joint.name}:poly{order}" for order in ORDERS if order > 1 or not straight
            ]
    return tuple(effects)
