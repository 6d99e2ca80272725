"""Gravity as each axis feels it while the chain turns: its direction, and the frames in which weights hang."""

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
    directions = np.empty((len(positions), len(chain.joints), 3))
    for branch, first in ((chain.work, 0), (chain.tool, len(chain.work))):
        rotation = np.broadcast_to(np.eye(3), (len(positions), 3, 3))
        for index, joint in enumerate(branch, start=first):
            if joint.turns:
                rotation = rotation @ rotation_about(joint.direction, positions[:, index])
            directions[:, index] = np.einsum("nji,j->ni", rotation, down)
    return directions


def axis_frames(chain: Chain, positions: Array) -> tuple[Array, Array]:
    """Rotations (n, J, 3, 3) into the bed's frame and origins (n, J, 3) mm of the frame of every axis after its own
    motion, for positions (n, J). The nominal chain is used, as for the direction of gravity."""
    count = len(positions)
    rotations = np.empty((count, len(chain.joints), 3, 3))
    origins = np.empty((count, len(chain.joints), 3))
    for branch, first in ((chain.work, 0), (chain.tool, len(chain.work))):
        rotation, origin = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
        for index, joint in enumerate(branch, start=first):
            step = np.broadcast_to(np.array(joint.offset, dtype=float), (count, 3))
            if not joint.turns:
                step = step + positions[:, index, None] * np.array(joint.direction)
            origin = origin + np.einsum("nij,nj->ni", rotation, step)
            if joint.turns:
                rotation = rotation @ rotation_about(joint.direction, positions[:, index])
            rotations[:, index], origins[:, index] = rotation, origin
    return rotations, origins
