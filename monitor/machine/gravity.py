"""Gravity as each axis feels it while the chain turns: its direction, and the torques of weights further out."""

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


def torques_in_joint_frames(chain: Chain, positions: Array, carried: int, centre_of_mass: Array) -> Array:
    """Torques (n, J, 3) mm about the origin of every axis, in its frame after its own motion, of a unit weight.

    The weight hangs at ``centre_of_mass`` (3,) mm in the frame of joint ``carried``; joints that do not carry it feel
    none. ``positions`` (n, J); the nominal chain is used, as for the direction.
    """
    down = np.array(chain.gravity)
    torques = np.zeros((len(positions), len(chain.joints), 3))
    on_tool = carried >= len(chain.work)
    first = len(chain.work) if on_tool else 0
    rotation = np.broadcast_to(np.eye(3), (len(positions), 3, 3))
    origin = np.zeros((len(positions), 3))
    frames = []
    for at in range(first, carried + 1):
        joint = chain.joints[at]
        step = np.array(joint.offset)
        if joint.turns:
            origin = origin + rotation @ step
            rotation = rotation @ rotation_about(joint.direction, positions[:, at])
        else:
            moved = step + positions[:, at, None] * np.array(joint.direction)
            origin = origin + np.einsum("nij,nj->ni", rotation, moved)
        frames.append((at, rotation, origin))
    weight = origin + rotation @ centre_of_mass
    for at, turned, centre in frames:
        torques[:, at] = np.einsum("nji,nj->ni", turned, np.cross(weight - centre, down))
    return torques
