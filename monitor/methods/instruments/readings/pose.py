"""``pose``: where a body on the tool is and how it is turned, six numbers (a tracker's six-degree-of-freedom probe).

The place is read as ``point`` reads it; the orientation is a unit quaternion that turns vectors of the body into the
instrument's frame, as the instrument shows it. How the body is mounted on the tool is unknown in every run, three turns
of each target, unless ``known`` names the ``targets``: then the body stands as the tool does. A residual turn is read
about the directions of the instrument's frame, at ``LEVER`` as a length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from monitor.machine import orientation
from monitor.methods.chain.first_frame import nearest_rotation
from monitor.methods.instruments.frames import seen_points
from monitor.methods.instruments.reading import LEVER, Rows, Shown, Stance, cross_matrix, turn_vectors
from monitor.methods.instruments.readings.direction import frame_turn
from monitor.methods.instruments.readings.point import Point
from monitor.records import Array, Setup

QUATERNION = ("quaternion_w", "quaternion_x", "quaternion_y", "quaternion_z")


@dataclass(frozen=True)
class Pose(Point):
    """A point with an orientation; ``mounted`` (T, 9) are the first rotations of the bodies into the tool's frame."""

    mounted: tuple[tuple[float, ...], ...] = ()

    name: ClassVar[str] = "pose"
    columns: ClassVar[tuple[str, ...]] = (*Point.columns, *QUATERNION)
    turns: ClassVar[int] = 3

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        reading, placed = super().of(setup, replace(rows, measured=rows.measured[:, :3]))
        placed = replace(placed, measured=rows.measured)
        # A place in a plane has no orientation in space: the file's third number was written down, not measured.
        reading = replace(reading, plane=False, flat=False)
        return replace(reading, mounted=reading._first_mounts(placed)), placed

    def guessed_anew(self, rows: Rows) -> tuple[Self, Rows]:
        reading, placed = self._placed(replace(rows, measured=rows.measured[:, :3]))
        placed = replace(placed, measured=rows.measured)
        return replace(reading, mounted=reading._first_mounts(placed)), placed

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("x", "y", "z", "a", "b", "c")

    @property
    def unknowns(self) -> tuple[str, ...]:
        if self.holds("targets"):
            return super().unknowns
        return (*super().unknowns, *(f"target {name} {turn}" for name in self.targets for turn in "abc"))

    def start(self, runs: int) -> Array:
        mounts = 0 if self.holds("targets") else 3 * len(self.targets)
        return np.concatenate([super().start(runs), np.zeros((runs, mounts))], axis=1)

    def ends(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        return super().ends(self._of_places(values), rows)

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        of_place = super().shown(
            stance, self._of_places(values), replace(rows, measured=rows.measured[:, :3])
        )
        assert of_place.by_shift is not None
        assert of_place.by_own is not None
        count, by_own = len(rows), np.zeros((len(rows), 6, values.shape[1]))
        by_own[:, :3, : of_place.by_own.shape[2]] = of_place.by_own
        mounts, axes = self._mounts(values, rows)
        shown = of_place.by_shift @ stance.turned
        turn = turn_vectors(shown @ mounts @ np.swapaxes(_measured(rows), 1, 2))
        # To second order in the turn that is left, as for ``angle``.
        slope = LEVER * (np.eye(3) - 0.5 * cross_matrix(turn))
        if not self.holds("frame"):
            free = np.zeros((count, 3))
            free[:, self._free[0]] = values[:, : len(self._free[0])]
            by_own[:, 3:, :3] = slope @ np.swapaxes(frame_turn(free)[1], 1, 2)
        if not self.holds("targets"):
            first, at = values.shape[1] - 3 * len(self.targets), self._target(rows)
            moved = slope @ shown @ np.swapaxes(axes, 1, 2)
            for axis in range(3):
                by_own[np.arange(count), 3:, first + 3 * at + axis] = moved[:, :, axis]
        none = np.zeros_like(slope)
        return Shown(
            residual=np.concatenate([of_place.residual, LEVER * turn], axis=1),
            by_shift=np.concatenate([of_place.by_shift, none], axis=1),
            by_turn=np.concatenate([none, slope @ of_place.by_shift], axis=1),
            by_own=by_own,
            along=np.concatenate([of_place.by_shift, none], axis=1),
        )

    def ideal(self, rows: Rows) -> Array:
        """What a machine without errors would show (m, 7): points in mm and quaternions."""
        points = seen_points(rows, rows.guess[:, :12], np.array(self.places))
        mounts, _ = self._mounts(np.zeros((len(rows), len(self.unknowns))), rows)
        frames = rows.guess[:, :9].reshape(-1, 3, 3)
        turned = np.swapaxes(frames, 1, 2) @ _tool(rows) @ mounts
        return np.concatenate([points, _rotations().from_matrix(turned).as_quat()[:, [3, 0, 1, 2]]], axis=1)

    def _of_places(self, values: Array) -> Array:
        """The unknowns of the place alone."""
        return values[:, : len(super().unknowns)]

    def _mounts(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        """Rotations (m, 3, 3) of the bodies into the tool's frame, and in rows the axes (m, 3, 3) of small changes."""
        at = self._target(rows)
        first = np.array(self.mounted).reshape(-1, 3, 3)[at]
        turns = np.zeros((len(rows), 3))
        if not self.holds("targets"):
            mounts = values[:, -3 * len(self.targets) :].reshape(len(rows), -1, 3)
            turns = mounts[np.arange(len(rows)), at]
        turned, axes = frame_turn(turns)
        return turned @ first, axes

    def _first_mounts(self, rows: Rows) -> tuple[tuple[float, ...], ...]:
        """Rotations of the bodies by a machine without errors, the mean over all rows of each."""
        if self.holds("targets"):
            return (tuple(np.eye(3).reshape(9)),) * len(self.targets)
        whole = np.isfinite(rows.measured).all(axis=1)
        frames = rows.guess[:, :9].reshape(-1, 3, 3)
        # tool . mount = frame . measured: columns of the one are brought to those of the other.
        wanted = np.swapaxes(_tool(rows), 1, 2) @ frames @ _measured(rows)
        at = self._target(rows)
        identity = np.tile(np.eye(3), (len(rows), 1, 1))
        mounts = []
        for number in range(len(self.targets)):
            mine = whole & (at == number)
            vectors = np.swapaxes(wanted[mine], 1, 2).reshape(-1, 3)
            mounts.append(nearest_rotation(vectors, identity[mine].reshape(-1, 3)))
        return tuple(tuple(mount.reshape(9).tolist()) for mount in mounts)


def _measured(rows: Rows) -> Array:
    """The orientations (m, 3, 3) that were read; none where one was not read."""
    quaternions = rows.measured[:, 3:]
    whole = np.isfinite(quaternions).all(axis=1, keepdims=True)
    read = np.where(whole, quaternions, [1.0, 0.0, 0.0, 0.0])
    return np.asarray(_rotations().from_quat(read[:, [1, 2, 3, 0]]).as_matrix())


def _rotations() -> Any:
    """Return scipy's rotations, loaded when a pose is read: the registry of methods waits for no solver."""
    from scipy.spatial.transform import Rotation

    return Rotation


def _tool(rows: Rows) -> Array:
    """How the tool of a machine without errors is turned (m, 3, 3), in the frame of the last work axis."""
    none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
    sides = orientation(rows.chain, rows.positions, none)
    return np.asarray(np.swapaxes(sides.work, 1, 2) @ sides.tool)


READING = Pose
