"""The closed forms of rotary-probing: eight location errors of a tilting table from means of touched positions.

For ``w C A ...`` tables, touched at A, C = (0, 0), (0, 90), (0, 180), (0, 270), (-90, 90), (-90, 180), (-90, 270)
degrees on faces that stand along the axes. They show which pattern tells which error.
An independent reference, which shares no code with the product: the general least squares of ``rotary-probing`` takes
any arrangement, any poses and any faces, weighs all touches, and is what ``identify`` reports; on exact readings both
agree to products of two errors.

Source: S. Ibaraki, T. Iritani, T. Matsushita, Calibration of location errors of rotary axes on five-axis machine
tools by on-the-machine measurement using a touch-trigger probe, 2012, Eqs. (6) to (19) and (21). Departures from
the print: Eq. (17) lacks a factor 1/2. Eq. (6) has the sign of a piece at -Y; places enter here with their signs.
Eqs. (11) and (12) hold for points at x = 0; their terms in x are taken along. alpha_CA and gamma_CA of Eq. (1)
do what alpha_AY and a turned piece do, and are zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: The paper's symbols and those of ISO 230-1 in our convention, in the order of the results.
SYMBOLS = {
    "dx_AY": "EX0A",
    "dy_AY": "EY0A",
    "dz_AY": "EZ0A",
    # The zero of A. A turn about A before and behind the axis do the same; our convention names the second.
    "alpha_AY": "EA0C",
    "beta_AY": "EB0A",
    "gamma_AY": "EC0A",
    "dy_CA": "EY0C",
    "beta_CA": "EB0C",
}
PARAMETERS = tuple(SYMBOLS.values())
X, Y, Z = 0, 1, 2
# Angles nearer than this to a pose are that pose (degrees); a normal whose largest component falls short of 1 by
# less than this stands along an axis (2.6 degrees).
SAME_ANGLE = 1e-6
ALONG = 1e-3
# Squares of distances (mm²) below which a face has no angle: points less than a millimetre apart.
SMALLEST_SPREAD = 1.0

Pose = tuple[float, float]
I, II, III, IV, V, VI, VII = (  # noqa: E741 - the paper's numbers of the poses (A, C)
    (0.0, 0.0), (0.0, 90.0), (0.0, 180.0), (0.0, 270.0), (-90.0, 90.0), (-90.0, 180.0), (-90.0, 270.0),
)  # fmt: skip


@dataclass(frozen=True)
class Touches:
    """The touches of one run: ``position`` (n, 3) mm of the tip's centre in machine coordinates, as the controller
    reads it, ``a`` and ``c`` (n,) rad, ``target`` (n,) names, ``normal`` (n, 3) outwards, in the table's frame."""

    position: Array
    a: Array
    c: Array
    target: npt.NDArray[np.str_]
    normal: Array


@dataclass(frozen=True)
class _Pair:
    """Points touched at two poses: displacement (k, 2) along the axis they face, place (k, 2, 3)."""

    moved: Array
    place: Array

    @property
    def mean(self) -> tuple[float, float]:
        first, second = self.moved.mean(axis=0)
        return float(first), float(second)

    @property
    def means(self) -> Array:
        """Mean places (2, 3)."""
        places: Array = self.place.mean(axis=0)
        return places

    def angle(self) -> float:
        """Least-squares slope of the first displacement over x: the angle about Z of Eq. (13)."""
        over = self.place[:, 0, X] - self.place[:, 0, X].mean()
        spread = float(over @ over)
        if spread < SMALLEST_SPREAD:
            raise ValueError("pattern 4 needs a face touched at several X at A = -90°, C = 90° and 270°")
        return float(over @ self.moved[:, 0]) / spread


class _Displacements:
    """Displacements of touched points against pose I, Eq. (21)."""

    def __init__(self, touches: Touches) -> None:
        self.touches = touches
        turned = _turn(X, -touches.a) @ _turn(Z, -touches.c)
        self.direction = np.einsum("nij,nj->ni", turned, touches.normal)
        self.along = np.sum(self.direction * touches.position, axis=1)
        self.rows = {pose: self._at(pose) for pose in (I, II, III, IV, V, VI, VII)}

    def _at(self, pose: Pose) -> dict[str, int]:
        degrees = np.degrees(np.column_stack([self.touches.a, self.touches.c])) - pose
        rows = np.flatnonzero(np.all(np.abs((degrees + 180.0) % 360.0 - 180.0) < SAME_ANGLE, axis=1))
        if not len(rows):
            raise ValueError(
                f"no touch at A = {pose[0]:g}°, C = {pose[1]:g}°: the closed forms need the paper's seven poses; "
                "the least squares takes any"
            )
        return {str(self.touches.target[row]): int(row) for row in rows}

    def faces(self, row: int, axis: int) -> bool:
        return bool(1.0 - abs(self.direction[row, axis]) < ALONG)

    def pair(self, name: str, poses: tuple[Pose, Pose], axes: tuple[int, int]) -> _Pair:
        """The points that face ``axes`` at ``poses`` and were touched at both and at pose I."""
        before, after, first = self.rows[poses[0]], self.rows[poses[1]], self.rows[I]
        chosen = [
            (before[target], after[target], first[target])
            for target in before
            if target in after
            and target in first
            and self.faces(before[target], axes[0])
            and self.faces(after[target], axes[1])
        ]
        if not chosen:
            raise ValueError(
                f"pattern {name} has no point that faces {'XYZ'[axes[0]]} at A, C = {poses[0]} and {'XYZ'[axes[1]]} "
                f"at {poses[1]} degrees"
            )
        rows = np.array(chosen)
        signs = np.column_stack([self.direction[rows[:, place], axes[place]] for place in (0, 1)])
        moved = np.sign(signs) * (self.along[rows[:, :2]] - self.along[rows[:, 2:]])
        return _Pair(moved, self.touches.position[rows[:, :2]])


def _turn(axis: int, angle: Array) -> Array:
    """Rotation matrices (n, 3, 3) about X, Y or Z."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1.0
    turn[:, first, first] = turn[:, second, second] = np.cos(angle)
    turn[:, second, first], turn[:, first, second] = np.sin(angle), -np.sin(angle)
    return turn


def closed_forms(touches: Touches) -> Array:
    """The eight location errors (8,) in the order of ``PARAMETERS``, mm and rad, of one run.

    Only points that were touched at both poses of a pattern, and at A = C = 0, enter it. Raises ValueError where a
    pose or the points of a pattern are missing.
    """
    seen = _Displacements(touches)
    p1 = seen.pair("1", (I, III), (Z, Z))
    p2a, p2b = seen.pair("2-a", (IV, II), (X, X)), seen.pair("2-b", (I, III), (Y, Y))
    p2c = seen.pair("2-c", (IV, II), (Z, Z))
    p3a = seen.pair("3-a", (III, VI), (X, X))
    p3b, p3c = seen.pair("3-b", (III, VI), (Y, Z)), seen.pair("3-c", (III, VI), (Z, Y))
    # What the probe reaches of a face differs after half a turn: each angle has its own points.
    angles = sum(seen.pair("4", (pose, pose), (Y, Y)).angle() for pose in (V, VII))

    # (6) and (9) together, with the signs of the places: z2 - z1 = (y2 - y1) alpha - (x2 - x1) (beta_AY + beta_CA).
    lever = np.array([[1.0, -1.0], [1.0, -1.0]]) * np.array(
        [np.diff(p.means, axis=0)[0, [Y, X]] for p in (p1, p2c)]
    )
    alpha, beta = np.linalg.solve(lever, [p.mean[1] - p.mean[0] for p in (p1, p2c)])
    # (7) and (8)
    dx = sum(p2a.mean) / 2.0 - p2a.means[:, Z].mean() * beta
    dy_both = sum(p2b.mean) / 2.0 + p2b.means[:, Z].mean() * alpha
    # (10), (9) and (13): the three angles of Eq. (19)
    (_, y1, z1), (_, y2, z2) = p3a.means
    matrix = np.array([[1.0, 1.0, 0.0], [z2 - z1, 0.0, y1 - y2], [0.0, 2.0, 2.0]])
    beta_a, beta_c, gamma = np.linalg.solve(matrix, [beta, p3a.mean[1] - p3a.mean[0], angles])
    # (11) and (12) with their terms in x
    less = p3b.mean[1] - p3b.mean[0] + p3b.means[:, X].mean() * (beta_a + gamma)
    more = p3c.mean[1] + p3c.mean[0] + p3c.means[:, X].mean() * (beta_a - gamma)
    dy, dz = (more - less) / 2.0, (more + less) / 2.0  # (15) and (18)
    return np.array([dx, dy, dz, alpha, beta_a, gamma, dy_both - dy, beta_c])  # (17) with its factor 1/2
