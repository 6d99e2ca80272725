"""Any serial chain as plain 4x4 matrices, its turns by quaternions: naive, and nothing shared with the product.

A joint is a dict: `name`, `kind` ("linear", "rotary"), `axis` (3,), `offset` (3,) mm from the joint before it,
`sign`. Errors are (6,) or (N, 6) numbers X Y Z A B C by joint name. Lengths in mm, angles in rad.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

Joint = Mapping[str, object]


def rigid(turn: Rotation | None, step: np.ndarray, count: int) -> np.ndarray:
    """(N, 4, 4) motions: turn first, then step."""
    matrix = np.zeros((count, 4, 4))
    matrix[:, 3, 3] = 1.0
    matrix[:, :3, :3] = np.eye(3) if turn is None else turn.as_matrix()
    matrix[:, :3, 3] = step
    return matrix


def small(six: np.ndarray, count: int) -> np.ndarray:
    """(N, 4, 4) of six small numbers: R_C R_B R_A, that is X, then Y, then Z about fixed axes."""
    six = np.broadcast_to(six, (count, 6))
    return rigid(Rotation.from_euler("xyz", six[:, 3:]), six[:, :3], count)


def moved(joint: Joint, reading: np.ndarray) -> np.ndarray:
    """(N, 4, 4) nominal motion of a joint at its readings."""
    q = float(joint["sign"]) * reading
    along = np.asarray(joint["axis"], dtype=float)
    if joint["kind"] == "linear":
        return rigid(None, q[:, None] * along, len(q))
    return rigid(Rotation.from_rotvec(q[:, None] * along), np.zeros(3), len(q))


def frames(
    joints: Sequence[Joint],
    readings: Mapping[str, np.ndarray],
    location: Mapping[str, np.ndarray] | None = None,
    motion: Mapping[str, np.ndarray] | None = None,
) -> list[np.ndarray]:
    """(N, 4, 4) frame after every joint, from the bed outwards."""
    count = len(next(iter(readings.values())))
    product, found = rigid(None, np.zeros(3), count), []
    for joint in joints:
        name = str(joint["name"])
        product = product @ rigid(None, np.asarray(joint["offset"], dtype=float), count)
        product = product @ small(np.asarray((location or {}).get(name, np.zeros(6))), count)
        product = product @ moved(joint, readings[name])
        product = product @ small(np.asarray((motion or {}).get(name, np.zeros(6))), count)
        found.append(product)
    return found


def point(frame: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(N, 3) where a point of a frame (3,) or (N, 3) is in the bed's frame."""
    return np.einsum("nij,nj->ni", frame[:, :3, :3], np.broadcast_to(at, (len(frame), 3))) + frame[:, :3, 3]
