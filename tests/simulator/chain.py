"""The simulated machine's geometry: a topology string as plain 4x4 homogeneous matrix products.

Written from the conventions alone and deliberately naive (every frame is a full matrix, nothing is
linearised, no twist, no analytic derivative), so that a mistake of the product's chain cannot hide behind the
same mistake here. Lengths in mm, angles in rad, arrays of N probings first.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

LETTERS = "XYZABC"  # order of the six small numbers of a rigid motion: translations, then rotations


@dataclass(frozen=True)
class Axis:
    """One axis of the chain; `sign` turns a reading into the displacement of the carriage."""

    name: str
    side: str  # "work" or "tool"
    sign: float

    @property
    def rotary(self) -> bool:
        return self.name[0] in "ABC"

    @property
    def column(self) -> str:
        """Name of the axis's column in a campaign folder."""
        return self.name.lower() + ("_deg" if self.rotary else "_mm")


@dataclass(frozen=True)
class Chain:
    """The two branches, each from the bed outwards."""

    topology: str
    work: tuple[Axis, ...]
    tool: tuple[Axis, ...]

    @property
    def axes(self) -> tuple[Axis, ...]:
        return self.work + self.tool

    @property
    def linear(self) -> tuple[Axis, ...]:
        """Linear axes, in the order X, Y, Z."""
        return tuple(sorted((a for a in self.axes if not a.rotary), key=lambda a: a.name))

    @property
    def rotary(self) -> tuple[Axis, ...]:
        """Rotary axes and the spindle, in the order B, C, C1 of a campaign folder's columns."""
        return tuple(sorted((a for a in self.axes if a.rotary), key=lambda a: a.name))

    def axis(self, name: str) -> Axis:
        for a in self.axes:
            if a.name == name:
                return a
        raise ValueError(f"no axis {name!r} in {self.topology!r}; it has {[a.name for a in self.axes]}")


def read_topology(topology: str, signs: dict[str, float] | None = None) -> Chain:
    """Chain of `w C B X b Z Y (C1) t`; without a sign ISO 841 holds (tool side +1, work side -1)."""
    words = topology.split()
    if words[0] != "w" or words[-1] != "t" or words.count("b") != 1:
        raise ValueError(f"topology {topology!r} must run from w over b to t")
    bed = words.index("b")
    signs = signs or {}

    def branch(parts: list[str], side: str, default: float) -> tuple[Axis, ...]:
        names = []
        for part in parts:
            name = part.strip("()")
            if not re.fullmatch(r"[XYZABC]\d*", name):
                raise ValueError(f"axis {part!r} of topology {topology!r} is not one of X Y Z A B C")
            names.append(name)
        return tuple(Axis(n, side, float(signs.get(n, default))) for n in names)

    return Chain(topology, branch(words[1:bed][::-1], "work", -1.0), branch(words[bed + 1 : -1], "tool", 1.0))


def turn(letter: str, angle: np.ndarray) -> np.ndarray:
    """(N, 4, 4) rotations about X (A), Y (B) or Z (C)."""
    c, s = np.cos(angle), np.sin(angle)
    m = np.zeros((*np.shape(angle), 4, 4))
    i, j = {"A": (1, 2), "B": (2, 0), "C": (0, 1)}[letter]
    k = 3 - i - j
    m[..., i, i] = c
    m[..., i, j] = -s
    m[..., j, i] = s
    m[..., j, j] = c
    m[..., k, k] = 1.0
    m[..., 3, 3] = 1.0
    return m


def shift(letter: str, distance: np.ndarray) -> np.ndarray:
    """(N, 4, 4) translations along X, Y or Z."""
    m = np.zeros((*np.shape(distance), 4, 4))
    m[..., range(4), range(4)] = 1.0
    m[..., "XYZ".index(letter), 3] = distance
    return m


def small_motion(six: np.ndarray) -> np.ndarray:
    """(N, 4, 4) rigid motion of (N, 6) numbers X Y Z A B C: translation, and rotation R_C R_B R_A."""
    m = turn("C", six[..., 5]) @ turn("B", six[..., 4]) @ turn("A", six[..., 3])
    m[..., :3, 3] = six[..., :3]
    return m


def nominal_motion(axis: Axis, reading: np.ndarray) -> np.ndarray:
    """(N, 4, 4) nominal motion of an axis at its readings (mm or rad)."""
    q = axis.sign * reading
    return turn(axis.name[0], q) if axis.rotary else shift(axis.name[0], q)


def branch_matrix(
    branch: tuple[Axis, ...],
    readings: dict[str, np.ndarray],
    location: dict[str, np.ndarray],
    motion: dict[str, np.ndarray],
    count: int,
) -> np.ndarray:
    """(N, 4, 4) product of location error, nominal motion and error motion of every axis, bed outwards."""
    product = np.broadcast_to(np.eye(4), (count, 4, 4))
    for axis in branch:
        if axis.name in location:
            product = product @ small_motion(location[axis.name])
        product = product @ nominal_motion(axis, readings[axis.name])
        if axis.name in motion:
            product = product @ small_motion(motion[axis.name])
    return product


def carried(matrices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, 3) points carried by (N, 4, 4) frames."""
    return (matrices[:, :3, :3] @ points[:, :, None])[:, :, 0] + matrices[:, :3, 3]


def gravity_seen(chain: Chain, readings: dict[str, np.ndarray], down: np.ndarray) -> dict[str, np.ndarray]:
    """Unit vector of gravity in the nominal frame of every axis, after its own motion: (N, 3) by axis name.

    A location error sits before the motion of its axis: `before:NAME` is gravity there; `end:work` is gravity
    in the frame of the last work axis, which carries the balls. Translations do not turn a frame and are left out.
    """
    count = len(next(iter(readings.values())))
    seen: dict[str, np.ndarray] = {}
    for branch in (chain.work, chain.tool):
        frame = np.broadcast_to(np.eye(4), (count, 4, 4))
        for axis in branch:
            seen["before:" + axis.name] = down @ frame[:, :3, :3]
            if axis.rotary:
                frame = frame @ nominal_motion(axis, readings[axis.name])
            seen[axis.name] = down @ frame[:, :3, :3]
        if branch is chain.work:
            seen["end:work"] = down @ frame[:, :3, :3]
    return seen
