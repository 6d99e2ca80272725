"""``point``: where a point of the tool is, in the frame of the instrument that looks at it (a tracker, a CMM, a plate).

Or, of a part that the machine cut, where it was cut. Unknown in every run are the frame (three turns, three shifts
away from a first guess) and a place on the tool for each target, unless they are known. A row whose third number is
empty has two: the plane of a part is no reading, and neither is a third number that is the same in all rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from monitor.methods.instruments.frames import first_frame
from monitor.methods.instruments.reading import SHIFT, TURN, Plain, Rows, Seen, Shown
from monitor.methods.instruments.readings.direction import frame_turn
from monitor.records import Array, Setup


@dataclass(frozen=True)
class Point(Plain):
    """A point with ``targets`` (T), their first ``places`` (T, 3) mm on the tool, in ``plane`` where no row has a third
    number."""

    targets: tuple[str, ...] = ()
    places: tuple[tuple[float, ...], ...] = ()
    plane: bool = False

    name: ClassVar[str] = "point"
    columns: ClassVar[tuple[str, ...]] = ("point_x_mm", "point_y_mm", "point_z_mm")
    holdable: ClassVar[tuple[str, ...]] = ("frame", "targets")

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        measured = _without_constant(rows)
        plane = bool(np.isnan(measured[:, 2]).all())
        rows = replace(rows, measured=measured[:, :2] if plane else measured)
        targets = tuple(str(name) for name in np.unique(rows.target))
        places = _stated_places(setup, rows, targets)
        guess = np.tile(np.concatenate([np.eye(3).reshape(9), np.zeros(3)]), (len(rows), 1))
        if "frame" not in setup.known:
            guess, places = first_frame(rows, places, held="targets" in setup.known)
        reading = cls(setup, targets, tuple(map(tuple, places.tolist())), plane)
        return reading, replace(rows, guess=guess)

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("x", "y") if self.plane else ("x", "y", "z")

    @property
    def unknowns(self) -> tuple[str, ...]:
        frame = () if self.holds("frame") else (*TURN, *SHIFT)
        targets = () if self.holds("targets") else self.targets
        return (*frame, *(f"target {name} {axis}" for name in targets for axis in "xyz"))

    def start(self, runs: int) -> Array:
        frame = np.zeros(0 if self.holds("frame") else 6)
        places = np.zeros(0) if self.holds("targets") else np.array(self.places).reshape(-1)
        return np.tile(np.concatenate([frame, places]), (runs, 1))

    def _target(self, rows: Rows) -> npt.NDArray[np.int64]:
        return np.searchsorted(np.array(self.targets), rows.target)

    def ends(self, own: Array, rows: Rows) -> tuple[Array, Array]:
        count, at = len(rows), self._target(rows)
        if self.holds("targets"):
            places = np.array(self.places)[at]
        else:
            places = own[:, -3 * len(self.targets) :].reshape(count, -1, 3)[np.arange(count), at]
        return np.zeros((count, 3)), places

    def shown(self, seen: Seen, own: Array, rows: Rows) -> Shown:
        count, kinds = len(rows), len(self.numbers)
        turn, shift = rows.guess[:, :9].reshape(-1, 3, 3), rows.guess[:, 9:]
        back = np.swapaxes(turn, 1, 2)
        arm = seen.r - shift
        by_own = np.zeros((count, 3, own.shape[1]))
        if not self.holds("frame"):
            moved, axes = frame_turn(own[:, :3])
            arm = arm - own[:, 3:6]
            back = back @ np.swapaxes(moved, 1, 2)
            by_own[:, :, :3] = -back @ np.swapaxes(np.cross(axes, arm[:, None, :]), 1, 2)
            by_own[:, :, 3:6] = -back
        if not self.holds("targets"):
            first = own.shape[1] - 3 * len(self.targets)
            on_tool, at = back @ seen.turned, self._target(rows)
            for axis in range(3):
                by_own[np.arange(count), :, first + 3 * at + axis] = on_tool[:, :, axis]
        shown = np.einsum("nij,nj->ni", back, arm)
        return Shown(
            residual=shown[:, :kinds] - rows.measured,
            by_shift=back[:, :kinds],
            by_own=by_own[:, :kinds],
        )


def _without_constant(rows: Rows) -> Array:
    """The measured points (m, 3), the third numbers empty where they are one and the same in all of several rows: a
    plane that was written down, not measured."""
    measured = rows.measured.copy()
    z = measured[:, 2]
    moves = np.ptp(rows.positions, axis=0).max(initial=0.0) > 0.0
    if len(z) > 2 and moves and not np.isnan(z).any() and np.ptp(z) == 0.0:
        measured[:, 2] = np.nan
    return measured


def _stated_places(setup: Setup, rows: Rows, targets: tuple[str, ...]) -> Array:
    """Places (T, 3) of the targets on the tool: as the rows state them, else that of the setup."""
    places = np.tile(setup.tool_point, (len(targets), 1)).astype(np.float64)
    for number, name in enumerate(targets):
        stated = rows.nominal[rows.target == name]
        if len(stated) and np.isfinite(stated).all():
            places[number] = stated.mean(axis=0)
    return places


READING = Point
