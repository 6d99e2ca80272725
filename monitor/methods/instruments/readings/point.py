"""``point``: where a point of the tool is, in the frame of the instrument that looks at it (a tracker, a CMM, a plate).

Or, of a part that the machine cut, where it was cut. Unknown in every run are the frame (three turns and three shifts
in its own directions, away from a first guess) and a place on the tool for each target, unless they are known. A row
whose third number is empty has two: the plane of a part is no reading, and neither is a third number that is the same
in all rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from monitor.machine import evaluate
from monitor.methods.chain.first_frame import FLAT
from monitor.methods.instruments.frames import first_frame, seen_points
from monitor.methods.instruments.reading import SHIFT, TURN, Plain, Rows, Shown, Stance
from monitor.methods.instruments.readings.direction import frame_turn
from monitor.records import Array, Setup
from monitor.sources import SCALE

# A third number that is the same in all rows says that a plate is flat where the axes measured its points: those lie in
# a plane nearly, and off it by more than so many mm. Nearer than that axes lie where they are told to go.
PROGRAMMED = 5e-5
# Where x and y are measured and not stated, nobody may have touched across the plane, and scales jitter: the axes lie
# off it by more than so many stated standard uncertainties there, or it is a plane along which nobody tells axes to go:
# it lies askew, and the least that a direction of the machine spreads is so many times what they lie off it.
JITTER, ASKEW = 2.0, 5.0
# Of stated places so many rows at least are at one that another row has. Two measured ones may be equal by chance.
STATED_AGAIN = 0.2


@dataclass(frozen=True)
class Point(Plain):
    """A point with ``targets`` (T), their first ``places`` (T, 3) mm on the tool, in ``plane`` where no row has a third
    number, ``flat`` where all of them lie in a plane across the line of sight then."""

    targets: tuple[str, ...] = ()
    places: tuple[tuple[float, ...], ...] = ()
    plane: bool = False
    flat: bool = False

    name: ClassVar[str] = "point"
    columns: ClassVar[tuple[str, ...]] = ("point_x_mm", "point_y_mm", "point_z_mm")
    holdable: ClassVar[tuple[str, ...]] = ("frame", "targets", SCALE)

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        measured = _without_constant(rows, setup)
        plane = bool(np.isnan(measured[:, 2]).all())
        rows = replace(rows, measured=measured[:, :2] if plane else measured)
        targets = tuple(str(name) for name in np.unique(rows.target))
        return cls(setup, targets, plane=plane)._placed(rows)

    def guessed_anew(self, rows: Rows) -> tuple[Self, Rows]:
        return self._placed(rows)

    def _placed(self, rows: Rows) -> tuple[Self, Rows]:
        """The reading with first places of its targets; the rows with the first frame of each run (12) and the middle
        (3,) of its points, about which a frame turns."""
        places = _stated_places(self.setup, rows, self.targets)
        guess = np.tile(np.concatenate([np.eye(3).reshape(9), np.zeros(3)]), (len(rows), 1))
        if not self.holds("frame"):
            guess, places = first_frame(rows, places, held=self.holds("targets"))
        points = seen_points(rows, guess, places)
        spread = points.std(axis=0)
        flat = self.plane and bool(spread[2] < FLAT * spread[:2].max())
        middle = np.zeros_like(points)
        for run in np.unique(rows.run):
            middle[rows.run == run] = points[rows.run == run].mean(axis=0)
        reading = replace(self, places=tuple(map(tuple, places.tolist())), flat=flat)
        return reading, replace(rows, guess=np.concatenate([guess, middle], axis=1))

    @property
    def has_own_frame(self) -> bool:
        return not self.holds("frame")

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("x", "y") if self.plane else ("x", "y", "z")

    @property
    def _free(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The turns and shifts of the frame that are unknown, by their axes in the instrument's frame."""
        if self.holds("frame"):
            return (), ()
        return ((2,) if self.flat else (0, 1, 2)), ((0, 1) if self.plane else (0, 1, 2))

    @property
    def unknowns(self) -> tuple[str, ...]:
        turns, shifts = self._free
        targets = () if self.holds("targets") else self.targets
        return (
            *(TURN[axis] for axis in turns),
            *(SHIFT[axis] for axis in shifts),
            *(f"target {name} {axis}" for name in targets for axis in "xyz"),
        )

    def start(self, runs: int) -> Array:
        frame = np.zeros(sum(map(len, self._free)))
        places = np.zeros(0) if self.holds("targets") else np.array(self.places).reshape(-1)
        return np.tile(np.concatenate([frame, places]), (runs, 1))

    def _target(self, rows: Rows) -> npt.NDArray[np.int64]:
        return np.searchsorted(np.array(self.targets), rows.target)

    def ends(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        count, at = len(rows), self._target(rows)
        if self.holds("targets"):
            places = np.array(self.places)[at]
        else:
            places = values[:, -3 * len(self.targets) :].reshape(count, -1, 3)[np.arange(count), at]
        return np.zeros((count, 3)), places

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        count, kinds = len(rows), len(self.numbers)
        turns, shifts = self._free
        turned, shift = np.zeros((2, count, 3))
        turned[:, turns] = values[:, : len(turns)]
        shift[:, shifts] = values[:, len(turns) : len(turns) + len(shifts)]
        moved, axes = frame_turn(turned)
        into = np.swapaxes(rows.guess[:, :9].reshape(-1, 3, 3), 1, 2)
        middle = rows.guess[:, 12:]
        arm = np.einsum(
            "nij,nj->ni", moved, np.einsum("nij,nj->ni", into, stance.r - rows.guess[:, 9:12]) - middle
        )
        by_shift = moved @ into
        by_own = np.zeros((count, 3, values.shape[1]))
        by_own[:, :, : len(turns)] = np.swapaxes(np.cross(axes[:, turns], arm[:, None, :]), 1, 2)
        for column, axis in enumerate(shifts, start=len(turns)):
            by_own[:, axis, column] = 1.0
        if not self.holds("targets"):
            first, at = values.shape[1] - 3 * len(self.targets), self._target(rows)
            on_tool = by_shift @ stance.turned
            if self.plane:
                # Along the line of sight a place shows only through products of errors.
                on_tool = np.where(np.linalg.norm(on_tool[:, :2], axis=1, keepdims=True) < FLAT, 0.0, on_tool)
            for axis in range(3):
                by_own[np.arange(count), :, first + 3 * at + axis] = on_tool[:, :, axis]
        return Shown(
            residual=(arm + middle + shift)[:, :kinds] - rows.measured,
            by_shift=by_shift[:, :kinds],
            by_own=by_own[:, :kinds],
        )


def _without_constant(rows: Rows, setup: Setup) -> Array:
    """The measured points (m, 3), the third numbers empty where they are one and the same in all of several rows and no
    axis measured that: a plane that was written down."""
    measured = rows.measured.copy()
    z = measured[:, 2]
    moves = np.ptp(rows.positions, axis=0).max(initial=0.0) > 0.0
    if len(z) > 2 and moves and not np.isnan(z).any() and np.ptp(z) == 0.0 and not _is_flat(rows, setup):
        measured[:, 2] = np.nan
    return measured


def _is_flat(rows: Rows, setup: Setup) -> bool:
    """Whether in some run the axes found the points in a plane as nearly as they measure, and not exactly."""
    u = float("inf") if setup.standard_uncertainty is None else setup.standard_uncertainty
    jitter = 0.0 if _are_stated(rows, setup) else JITTER * u
    count = len(rows)
    none = np.zeros((count, len(rows.chain.joints), 2, 6))
    targets = np.unique(rows.target)
    places = _stated_places(setup, rows, targets)[np.searchsorted(targets, rows.target)]
    points = evaluate(rows.chain, rows.positions, none, np.zeros((count, 3)), places).residual
    for run in np.unique(rows.run):
        arms = points[rows.run == run]
        spread = np.linalg.svd(arms - arms.mean(axis=0), compute_uv=False) / np.sqrt(len(arms))
        if len(spread) < 3 or not PROGRAMMED < spread[2] < FLAT * spread[1]:
            continue
        if spread[2] > jitter or arms.std(axis=0).min() > ASKEW * spread[2]:
            return True
    return False


def _are_stated(rows: Rows, setup: Setup) -> bool:
    """Whether the points are places of a plate to which the axes were brought: they recur to the last digit, or the tip
    that is brought to them is known."""
    again = len(rows) - len(np.unique(rows.measured[:, :2], axis=0))
    return "targets" in setup.known or again >= STATED_AGAIN * len(rows)


def _stated_places(setup: Setup, rows: Rows, targets: Sequence[str] | npt.NDArray[np.str_]) -> Array:
    """Places (T, 3) of the targets, in their order, on the tool: as the rows state them, else that of the setup."""
    places = np.tile(setup.tool_point, (len(targets), 1)).astype(np.float64)
    at = np.searchsorted(np.array(targets), rows.target)
    count, total = np.zeros(len(targets)), np.zeros_like(places)
    np.add.at(count, at, 1.0)
    np.add.at(total, at, rows.nominal)
    # A row that states no place leaves the sum of its target without a number.
    stated = np.isfinite(total).all(axis=1) & (count > 0.0)
    places[stated] = total[stated] / count[stated, None]
    return places


READING = Point
