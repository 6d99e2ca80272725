"""``direction``: where the tool points, seen in an outer frame (a mount, an autocollimator, a camera on the stars).

A row has two numbers: the components across the direction that was seen, to the side and up. Nothing along the
line of sight is a reading. The outer frame is that of the machine where it lies within ``NEAR`` of it; else the best
rotation of all rows brings it there. What turns it further are the location errors of the first axis (its two tilts
and its zero): frame and first axis cannot be told apart, and the numbers stand under the axis's names.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from monitor.machine import orientation
from monitor.machine.chain import small_turn
from monitor.methods.chain.first_frame import nearest_rotation
from monitor.methods.instruments.reading import LEVER, TURN, Plain, Rows, Shown, Stance, cross_matrix
from monitor.records import Array, Setup

# A frame turned by less than 20 degrees against the machine's is the machine's: no axis is set up worse than that.
NEAR = 0.35
# Nearer to the vertical than this there is no side: any direction across serves.
UPRIGHT = 1e-6


@dataclass(frozen=True)
class Direction(Plain):
    """A direction; ``floating`` where its frame is turned by three unknowns of its own, because another setup's frame
    is that of the machine already."""

    floating: bool = False

    name: ClassVar[str] = "direction"
    columns: ClassVar[tuple[str, ...]] = ("direction_x", "direction_y", "direction_z")
    angular: ClassVar[bool] = True
    holdable: ClassVar[tuple[str, ...]] = ("frame",)

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        reading = cls(setup)
        outer = np.eye(3)
        if not reading.holds("frame"):
            best = nearest_rotation(reading.pointed(rows), rows.measured)
            turned = float(np.arccos(np.clip(0.5 * (np.trace(best) - 1.0), -1.0, 1.0)))
            outer = best if turned > NEAR else outer
        return reading, replace(rows, guess=np.tile(outer.reshape(9), (len(rows), 1)))

    @property
    def pointing(self) -> Array:
        """The tool's direction (3,) in the frame of the last tool axis."""
        assert self.setup.tool_direction is not None  # the reader asks for it
        return np.array(self.setup.tool_direction)

    def pointed(self, rows: Rows) -> Array:
        """Where the tool of a machine without errors points (m, 3), in the frame of the last work axis."""
        none = np.zeros((len(rows), len(rows.chain.joints), 2, 6))
        sides = orientation(rows.chain, rows.positions, none)
        return np.asarray(np.swapaxes(sides.work, 1, 2) @ sides.tool @ self.pointing)

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("side", "up")

    @property
    def unknowns(self) -> tuple[str, ...]:
        return TURN if self.floating else ()

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        pointed = stance.turned @ self.pointing
        star = np.einsum("nij,nj->ni", rows.guess.reshape(-1, 3, 3), rows.measured)
        assert stance.nominal is not None
        across = self._across(star, stance.nominal, rows)
        by_own = np.zeros((len(rows), 2, values.shape[1]))
        if self.floating:
            turned, axes = frame_turn(values)
            star = np.einsum("nij,nj->ni", turned, star)
            moved = np.cross(axes, star[:, None, :])
            by_own = -LEVER * np.einsum("nka,nqa->nkq", across, moved)
        return Shown(
            residual=LEVER * np.einsum("nka,na->nk", across, pointed - star),
            by_turn=-LEVER * across @ cross_matrix(pointed),
            by_own=by_own,
            along=across,
        )

    def _across(self, star: Array, nominal: Stance, rows: Rows) -> Array:
        """Unit vectors (m, 2, 3) to the side and up, across the direction that was seen."""
        star = star / np.linalg.norm(star, axis=1, keepdims=True)
        up = -np.einsum("nji,j->ni", nominal.work, np.array(rows.chain.gravity))
        side = np.cross(star, up)
        length = np.linalg.norm(side, axis=1, keepdims=True)
        other = np.cross(star, np.eye(3)[np.abs(star).argmin(axis=1)])
        side = np.where(length > UPRIGHT, side, other)
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        return np.stack([side, np.cross(side, star)], axis=1)


def frame_turn(angles: Array) -> tuple[Array, Array]:
    """Rotations (m, 3, 3) by three angles (m, 3), R_C R_B R_A, and in rows the axes (m, 3, 3) of their small
    changes."""
    turn, axes = small_turn(angles, with_axes=True)
    return turn, np.swapaxes(axes, 1, 2)


READING = Direction
