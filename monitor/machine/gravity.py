"""The direction of gravity as each axis feels it while the chain turns."""

from __future__ import annotations

import numpy as np

from monitor.machine.chain import rotation_about
from monitor.machine.topology import Chain
from monitor.records import Array


def gravity_in_joint_frames(chain: Chain, positions: Array) -> Array:
    """Unit vectors (n, J, 3): gravity in the frame of every axis after its own motion, for positions (n, J).

    The nominal chain is used: a squareness of 100 µrad turns the vector by 100 µrad, which changes an effect
    of gravity by one part in ten thousand.
    """
    down = np.array(chain.gravity)
    found = np.empty((len(positions), len(chain.joints), 3))
    place = 0
    for branch in (chain.work, chain.tool):
        rotation = np.broadcast_to(np.eye(3), (len(positions), 3, 3))
        for joint in branch:
            if joint.turns:
                rotation = rotation @ rotation_about(joint.direction, positions[:, place])
            found[:, place] = np.einsum("nji,j->ni", rotation, down)
            place += 1
    return found
