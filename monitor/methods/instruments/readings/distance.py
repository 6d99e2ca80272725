"""``distance``: the length of r less the nominal length (a ball bar, a telescoping bar, a distance between spheres).

A bar that is swung in a plane shows nothing of its centre across that plane but products of errors: such a direction
is held where the centre is stated. A centre that is not stated, or far from where the readings put it, is first fitted.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from monitor.machine import evaluate
from monitor.methods.instruments.reading import Rows, Shown, Stance
from monitor.methods.instruments.readings.vector import WORK_POINT, AtWorkPoint
from monitor.records import Array, Setup

# Where all directions of the bar lie across a direction to this part, the bar shows only products of errors along it:
# errors of 1 mrad and 1 mm on a bar of 150 mm turn it by less than a hundredth.
FLAT = 1e-2
# A bar's ends stand within a millimetre or so of where they were stated; lengths further off come from another centre.
STATED_WITHIN = 2.0


@dataclass(frozen=True)
class DistanceReading(AtWorkPoint):
    """The length of r. What the bar's length is off is unknown, to its uncertainty where that is stated; ``centre``
    (3,) mm is where the search for the work point begins, ``shown_directions`` is how many directions of the centre
    the bar shows to first order."""

    centre: tuple[float, ...] = ()
    shown_directions: int = 3

    name: ClassVar[str] = "distance"
    columns: ClassVar[tuple[str, ...]] = ("reading_um",)
    holdable: ClassVar[tuple[str, ...]] = ("work_point", "length")
    staying: ClassVar[tuple[str, ...]] = ("length",)

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        """Make the reading; the constants of a row are the projector (9,) on the directions in which the bar shows its
        centre to first order."""
        assert setup.length is not None  # the reader asks for it
        count = len(rows)
        none = np.zeros((count, len(rows.chain.joints), 2, 6))
        tips = evaluate(
            rows.chain, rows.positions, none, np.zeros((count, 3)), np.tile(setup.tool_point, (count, 1))
        ).residual
        lengths = setup.length + rows.measured[:, 0]
        centre = np.array(setup.work_point)
        if "work_point" not in setup.known:
            centre = _centre(tips, lengths, centre)
        projector = np.eye(3)
        r = tips - centre
        _, size, axes = np.linalg.svd(
            r / np.maximum(np.linalg.norm(r, axis=1), 1e-12)[:, None], full_matrices=False
        )
        shown = 0
        for strength, axis in zip(size, axes, strict=True):
            if strength < FLAT * np.sqrt(count):
                projector -= np.outer(axis, axis)
            else:
                shown += 1
        guess = np.tile(projector.reshape(9), (count, 1))
        return cls(setup, tuple(centre.tolist()), shown), replace(rows, guess=guess)

    @property
    def keeps_one_direction(self) -> bool:
        """Whether nothing of a centre that is not known shows but along the one direction of the bar."""
        return self.shown_directions == 1 and not self.holds("work_point")

    @property
    def numbers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return (*super().unknowns, *(() if self.holds("length") else ("length",)))

    @property
    def shared(self) -> Mapping[str, Hashable]:
        """The length of a bar, which setups of one instrument with the same stated length have in common."""
        setup = self.setup
        return (
            {"length": (setup.instrument, setup.length, setup.length_uncertainty)} if setup.instrument else {}
        )

    def start(self, runs: int) -> Array:
        begin = super().start(runs)
        if not self.holds("work_point"):
            begin[:, : len(WORK_POINT)] = self.centre
        return begin

    def ends(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        work, tool = super().ends(values, rows)
        if not self.holds("work_point"):
            centre = np.array(self.centre)
            work = centre + np.einsum("nij,nj->ni", rows.guess.reshape(-1, 3, 3), work - centre)
        return work, tool

    def prior(self) -> tuple[tuple[int, float], ...]:
        u = self.setup.length_uncertainty
        return () if u is None or self.holds("length") else ((len(self.unknowns) - 1, u),)

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        assert self.setup.length is not None  # the reader asks for it
        long = np.linalg.norm(stance.r, axis=1)
        by_shift = (stance.r / np.maximum(long, 1e-12)[:, None])[:, None, :]
        by_own = self.by_point(by_shift @ rows.guess.reshape(-1, 3, 3), values)
        nominal = np.full(len(rows), self.setup.length)
        if not self.holds("length"):
            by_own[:, :, -1] = -1.0
            nominal = nominal + values[:, -1]
        return Shown((long - nominal)[:, None] - rows.measured, by_shift, by_own=by_own)


def _centre(tips: Array, lengths: Array, stated: Array) -> Array:
    """The stated centre (3,) where it explains the ``lengths`` (m,) mm of a bar to the tool points (m, 3) mm; else the
    centre of the sphere through them, in directions that they leave open the nearest to the stated one.

    The differences of |p|^2 - 2 p.c + |c|^2 = L^2 from their means are linear in c. Off the plane of a flat swing the
    centre lies where the length says, on the side of the stated one.
    """
    off = np.linalg.norm(tips - stated, axis=1) - lengths
    if len(tips) < 4 or np.sqrt(np.mean(off**2)) < STATED_WITHIN:
        return stated
    middle = tips.mean(axis=0)
    about, from_middle = tips - middle, stated - middle
    _, size, axes = np.linalg.svd(about, full_matrices=False)
    is_spanned = size > FLAT * size[0]
    right = 0.5 * (np.sum(about**2, axis=1) - lengths**2)
    inside = about @ axes[is_spanned].T
    solved = np.linalg.lstsq(inside - inside.mean(axis=0), right - right.mean(), rcond=None)[0]
    left_open = from_middle - axes[is_spanned].T @ (axes[is_spanned] @ from_middle)
    if np.count_nonzero(~is_spanned) == 1:
        square = float(np.mean(lengths**2 - np.sum((inside - solved) ** 2, axis=1)))
        height = np.sqrt(square) if square > (FLAT * size[0]) ** 2 else 0.0
        normal = axes[~is_spanned][0]
        left_open = height * normal * (np.sign(normal @ from_middle) or 1.0)
    return np.asarray(middle + axes[is_spanned].T @ solved + left_open)


READING = DistanceReading
