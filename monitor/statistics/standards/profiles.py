"""The profile of a line that a cutter's flank left on a part, and the flatness of a face that its end left.

The point of the tool follows a programmed path; the wall stands off the tool's axis by the radius of the cutter, which
nobody states. So the deviation of a wall point is its distance from the programmed axis less one radius for the whole
line, after the part was moved until it agrees best. The zone of a profile tolerance lies between the envelopes of equal
circles about the programmed form (G. Henzold, Geometrical Dimensioning and Tolerancing, 2nd ed. 2006, chapter 4, of ISO
1101); here it needs no datum, and its offset is the cutter's. The distance between designed and machined surface is the
deviation of the S-shaped part in flank milling (Proc. Inst. Mech. Eng. B 234 (2020), doi 10.1177/0954405419889235). A
face has its distance along the axis instead (ISO 12781-1:2011, 3.2.3, local flatness deviation). A wall point that was
cut from d away along the path is d²/(2 R) too far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.records import Array
from monitor.statistics.standards.circles import minimum_zone
from monitor.statistics.standards.parts import DRAWS, FormFigure, FormKind

#: A path that turns by less than this, rad, shows no radius beside a shift (30 degrees).
LEAST_TURN = np.pi / 6.0
#: A wall stands further than this from the tool's axis, mm; what does not was cut by the tool's end.
LEAST_CUTTER = 0.2
#: A path that leaves a plane by more than this is no face, mm; nor is one that covers less than this across, mm.
PLANE, LEAST_FACE = 5e-3, 1.0
#: Steps until the part lies where it agrees best, each quadratic.
MOST_STEPS, SETTLED = 30, 1e-8
#: Moves of the part that move its walls by less than this part of others along their normals are left out: of a line in
#: a plane the two tilts, which show by what the points lie out of that plane alone.
SEPARATED = 1e-3


@dataclass(frozen=True)
class Profile:
    """Wall points as fitted: ``deviation`` (n,) mm along ``outward`` (n, 3), and an orthonormal basis ``columns``
    (n, q) of what moving the part and another radius do to it. ``radius`` mm is that of the cutter, 0 of a face;
    ``by_scale`` (n,) mm is what is left of another unit of length in it."""

    deviation: Array
    outward: Array
    columns: Array
    radius: float
    by_scale: Array

    @property
    def is_face(self) -> bool:
        """Whether the end of the tool cut it."""
        return self.radius == 0.0

    @property
    def width(self) -> float:
        """The width (mm) of the zone about the least-squares place."""
        return float(np.ptp(self.deviation))

    @property
    def least_width(self) -> float:
        """The least width (mm) of a zone."""
        return minimum_zone(self.columns, self.deviation)

    def figures(
        self, name: str, u_reading: float, u_scale: float, rng: np.random.Generator
    ) -> tuple[FormFigure, FormFigure]:
        """The width and the least width; u is the standard deviation of the first over parts measured again, with
        ``u_reading`` mm of one coordinate and a unit of length that is off by ``u_scale``."""
        noise = u_reading * rng.standard_normal((DRAWS, len(self.deviation)))
        noise -= noise @ self.columns @ self.columns.T
        off = u_scale * rng.standard_normal((DRAWS, 1)) * self.by_scale
        u = float(np.std(np.ptp(self.deviation + noise + off, axis=1)))
        kinds = (FormKind.PROFILE, FormKind.PROFILE_ZONE)
        if self.is_face:
            kinds = (FormKind.FLATNESS, FormKind.FLATNESS_ZONE)
        return (
            FormFigure(kinds[0], name, "", self.width, u),
            FormFigure(kinds[1], name, "", self.least_width, u),
        )


def profile_of(measured: Array, nominal: Array, axes: Array) -> Profile | None:
    """The profile of points ``measured`` (n, 3) mm, cut with the tool's point at ``nominal`` (n, 3) mm and its axis
    along unit vectors ``axes`` (n, 3), in one frame and in the order of cutting; None where they show none."""
    along = _tangents(nominal)
    side = np.cross(along, axes)
    length = np.linalg.norm(side, axis=1)
    if length.min() < 0.1:
        return None  # the tool plunges
    outward = side / length[:, None]
    moved, radius = _moved(measured, nominal, outward, measured.mean(axis=0))
    if _turning(along, axes) < LEAST_TURN:
        return None
    if abs(radius) < LEAST_CUTTER:
        return _face(measured, nominal, axes)
    middle = nominal.mean(axis=0)
    for _ in range(MOST_STEPS):
        # From here on by the points themselves: tangents of a coarse path are chords.
        off = moved - nominal
        across = off - np.sum(off * axes, axis=1, keepdims=True) * axes
        distance = np.linalg.norm(across, axis=1)
        if distance.min() < 0.1 * LEAST_CUTTER:
            return None
        outward = across / distance[:, None]
        step = _step(outward, moved - middle, distance - distance.mean())
        moved = _turned(moved - middle, -step[3:6]) + middle - step[:3]
        if np.abs(step[:3]).max() + np.abs(step[3:6]).max() * np.abs(moved - middle).max() < SETTLED:
            break
    off = moved - nominal
    across = off - np.sum(off * axes, axis=1, keepdims=True) * axes
    distance = np.linalg.norm(across, axis=1)
    return _profile(across / distance[:, None], moved - middle, distance, float(distance.mean()))


def _face(measured: Array, nominal: Array, axes: Array) -> Profile | None:
    """A face that the tool's end cut across its axis; None where the path covers no plane."""
    middle = nominal.mean(axis=0)
    _, _, vectors = np.linalg.svd(nominal - middle, full_matrices=False)
    normal = vectors[2] * np.sign(vectors[2] @ axes[0])
    flat = (nominal - middle) @ vectors.T
    tilted = np.linalg.norm(np.cross(axes, normal), axis=1).max()
    if np.ptp(flat[:, 1]) < LEAST_FACE or np.abs(flat[:, 2]).max() > PLANE or tilted > 1e-3:
        return None
    outward = np.tile(normal, (len(measured), 1))
    return _profile(outward, measured - middle, (measured - nominal) @ normal, 0.0)


def _profile(outward: Array, about: Array, distance: Array, radius: float) -> Profile:
    basis, strength, _ = np.linalg.svd(_columns(outward, about) / _scale(about), full_matrices=False)
    basis = basis[:, strength > SEPARATED * strength[0]]
    in_length = np.sum(outward * about, axis=1)
    deviation, by_scale = (each - basis @ (basis.T @ each) for each in (distance, in_length))
    return Profile(deviation, outward, basis, radius, by_scale)


def _tangents(path: Array) -> Array:
    """Directions (n, 3) of a path (n, 3) from its neighbours; a point that is repeated has that of the one before, the
    first that of the next."""
    along = np.gradient(path, axis=0)
    length = np.linalg.norm(along, axis=1)
    first = int(np.argmax(length >= 1e-9))
    along[:first], length[:first] = along[first], length[first]
    for row in range(1, len(path)):
        if length[row] < 1e-9:
            along[row], length[row] = along[row - 1], length[row - 1]
    return np.asarray(along / np.maximum(length, 1e-9)[:, None])


def _turning(along: Array, axes: Array) -> float:
    """The largest angle between two normals of a path, rad."""
    side = np.cross(along, axes)
    side /= np.linalg.norm(side, axis=1)[:, None]
    return float(np.arccos(np.clip((side @ side.T).min(), -1.0, 1.0)))


def _moved(measured: Array, nominal: Array, outward: Array, middle: Array) -> tuple[Array, float]:
    """Points (n, 3) turned and shifted until they stand off the path along ``outward`` by one radius, which is returned
    with its sign."""
    moved, radius = measured, 0.0
    for _ in range(MOST_STEPS):
        step = _step(outward, moved - middle, np.sum((moved - nominal) * outward, axis=1))
        moved, radius = _turned(moved - middle, -step[3:6]) + middle - step[:3], float(step[6])
        if np.abs(step[:6]).max() < SETTLED:
            break
    return moved, radius


def _columns(outward: Array, about: Array) -> Array:
    """What three shifts, three turns about the middle of points ``about`` (n, 3) and a radius do (n, 7)."""
    return np.column_stack([outward, np.cross(about, outward), -np.ones(len(about))])


def _scale(about: Array) -> Array:
    """The size (7,) of each unknown that moves points by some millimetre."""
    size = float(np.linalg.norm(about, axis=1).max())
    return np.array([1.0, 1.0, 1.0, size, size, size, 1.0])


def _step(outward: Array, about: Array, right: Array) -> Array:
    """The unknowns (7,) that make up ``right`` (n,) mm."""
    scale = _scale(about)
    return np.asarray(np.linalg.lstsq(_columns(outward, about) / scale, right, rcond=SEPARATED)[0] / scale)


def _turned(points: Array, turn: Array) -> Array:
    """Points (n, 3) turned by a vector (3,) rad (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return points
    axis = turn / angle
    return np.asarray(
        points * np.cos(angle)
        + np.cross(axis, points) * np.sin(angle)
        + np.outer(points @ axis, axis) * (1.0 - np.cos(angle))
    )
