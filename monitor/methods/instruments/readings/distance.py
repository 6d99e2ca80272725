"""``distance``: the length of r less the nominal length (a ball bar, a telescoping bar, a distance between spheres).

A bar that is swung in a plane shows nothing of its centre across that plane but products of errors: such a direction
is held. A centre that is not stated, or far from where the readings put it, is first fitted.

Held is how far the tool point is from the centre across the plane, not the place of the centre: the centre was put
where the tool brought it. Held at its place, an axis of the table that lies 1 mm beside where the machine file says
(``EX0B``) tilted the bar by 1 mm on 150 mm, made it 3 um longer, and moved gains by 13 standard uncertainties.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from monitor.machine import evaluate
from monitor.methods.instruments.reading import Rows, Shown, Stance, mean_of_runs
from monitor.methods.instruments.readings.vector import WORK_POINT, AtWorkPoint
from monitor.records import Array, Setup

# Where all directions of the bar lie across a direction to this part, the bar shows only products of errors along it:
# errors of 1 mrad and 1 mm on a bar of 150 mm turn it by less than a hundredth.
FLAT = 1e-2
# mm. A centre that a swing puts nearer to the stated one than this begins there: in the plane of the swing, where its
# readings show it, and across, where 0.1 mm makes 0.05 um of a bar of 100 mm.
STATED_WITHIN, STATED_HEIGHT = 0.3, 0.1
# mm. Lengths that a stated centre leaves further off come from another one, whatever the bar's directions; a constant
# of the readings beyond it from a centre off the plane. A smaller constant may be a length that was typed wrong, which
# no centre may take up.
FAR = 2.0
# Standard deviation of the tool points across their longest direction, in lengths of the bar, from which their circle
# has a centre: that of half a turn is 0.3, of a quarter 0.09.
SWUNG = 0.2


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
        centre to first order, and r (3,) mm of a machine without errors in the others."""
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
        guess = np.hstack([np.tile(projector.reshape(9), (count, 1)), r - r @ projector])
        return cls(setup, tuple(centre.tolist()), shown), replace(rows, guess=guess)

    @property
    def keeps_one_direction(self) -> bool:
        """Whether nothing of a centre that is not known shows but along the one direction of the bar."""
        return self.shown_directions == 1 and not self.holds("work_point")

    @property
    def u_length(self) -> float:
        """The standard uncertainty (mm) of its length as stated and of its scale along it; NaN where none is stated."""
        assert self.setup.length is not None  # the reader asks for it
        stated = 0.0 if self.holds("length") else (self.setup.length_uncertainty or np.nan)
        return float(np.hypot(stated, self.setup.length * (self.setup.scale_uncertainty or 0.0)))

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
            work = centre + np.einsum("nij,nj->ni", _projectors(rows), work - centre)
        return work, tool

    def prior(self) -> tuple[tuple[int, float], ...]:
        u = self.setup.length_uncertainty
        return () if u is None or self.holds("length") else ((len(self.unknowns) - 1, u),)

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        assert self.setup.length is not None  # the reader asks for it
        r, across = stance.r, np.eye(3) - _projectors(rows)
        if not self.holds("work_point"):
            # The centre follows the tool point across the plane: on the mean it stays as far from it as it was put.
            r = r - mean_of_runs(np.einsum("nij,nj->ni", across, r) - rows.guess[:, 9:], rows.run)
        long = np.linalg.norm(r, axis=1)
        by_shift = (r / np.maximum(long, 1e-12)[:, None])[:, None, :]
        by_mean = None if self.holds("work_point") else -by_shift @ across
        by_own = self.by_point(by_shift @ _projectors(rows), values)
        nominal = np.full(len(rows), self.setup.length)
        if not self.holds("length"):
            by_own[:, :, -1] = -1.0
            nominal = nominal + values[:, -1]
        return Shown((long - nominal)[:, None] - rows.measured, by_shift, by_mean=by_mean, by_own=by_own)


def _projectors(rows: Rows) -> Array:
    """The projectors (m, 3, 3) on the directions in which the bar shows its centre to first order."""
    return rows.guess[:, :9].reshape(-1, 3, 3)


def _centre(tips: Array, lengths: Array, stated: Array) -> Array:
    """The stated centre (3,) where it explains the ``lengths`` (m,) mm of a bar to the tool points (m, 3) mm; else the
    centre of the sphere through them, in directions that they leave open the nearest to the stated one.

    The differences of |p|^2 - 2 p.c + |c|^2 = L^2 from their means are linear in c.
    """
    off = np.linalg.norm(tips - stated, axis=1) - lengths
    is_far = np.sqrt(np.mean(off**2)) >= FAR
    middle = tips.mean(axis=0)
    about, from_middle = tips - middle, stated - middle
    _, size, axes = np.linalg.svd(about, full_matrices=False)
    swung = len(tips) >= 4 and size[1] > SWUNG * lengths.mean() * np.sqrt(len(tips))
    if len(tips) < 4 or not (is_far or swung):
        return stated
    is_spanned = size > FLAT * size[0]
    right = 0.5 * (np.sum(about**2, axis=1) - lengths**2)
    inside = about @ axes[is_spanned].T
    solved = np.linalg.lstsq(inside - inside.mean(axis=0), right - right.mean(), rcond=None)[0]
    in_plane, across = solved - axes[is_spanned] @ from_middle, np.zeros(3)
    if np.count_nonzero(~is_spanned) == 1:
        square = float(np.mean(lengths**2 - np.sum((inside - solved) ** 2, axis=1)))
        normal = axes[~is_spanned][0]
        height = float(normal @ from_middle)
        across = normal * (_height(square, height, 2.0 * float(lengths.mean())) - height)
    if not is_far and np.linalg.norm(in_plane) < STATED_WITHIN:
        in_plane = np.zeros_like(in_plane)
    return np.asarray(stated + axes[is_spanned].T @ in_plane + across)


def _height(square: float, stated: float, twice: float) -> float:
    """How far (mm) a centre lies off the plane of a flat swing, on the side of the ``stated`` height.

    That is the stated one, none, or what the length says: its ``square`` (mm^2) is 2 L = ``twice`` times a constant.

    A swing in the plane of its centre shows 18 um of a centre that is stated 1.9 mm off a plane of 100 mm: the height
    that leaves the smaller constant is the right one. The length itself says it to 2 mm at best near the plane.
    """
    if_flat, if_stated = abs(square), abs(stated**2 - square)
    if min(if_flat, if_stated) < FAR * twice:
        return 0.0 if if_flat < if_stated and abs(stated) > STATED_HEIGHT else stated
    return float(np.sqrt(max(square, 0.0)) * (np.sign(stated) or 1.0))


READING = DistanceReading
