"""What a method says of its readings on a chain: its own unknowns, the ends of the chain, which part is measured.

A method says where the two ends of the chain are (``ends``), how they depend on its own unknowns (``by_own``), which
part of the vector between them a reading measures (``observe``), which calibrated quantities it has besides
(``extras``), and what such readings can show. ``problem.py`` has what is the same whatever the method measures.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from monitor.effects import ChainEffect, Context, Effect
from monitor.effects.catalogue import (
    of_balls,
    of_ram,
    of_single_touches,
    of_tool_end,
    of_work_end,
)
from monitor.machine import ChainPose
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.sessions import Stays
from monitor.records import Array
from monitor.sources import CommonQuantity

# A wrong sign of an axis fits the readings perfectly with a gain of -2 and mirrored targets. A turn of 0.1 rad or
# a gain of 100 mm/m is no error of a machine but another machine; real ones stay below a hundredth of that.
LARGEST_ERROR = 0.1
# Of balls, whose places are unknown too, a gain is told by a bar alone, or by no reading and stays where the readings
# allow nearest to zero: further away they are those of another machine, or of a bar of another length.
LARGEST_GAIN = 0.01
# The largest effect that a machine in use is likely to have: 50 µm at the tip, or an angle of 1 mrad. The
# tolerances of geometric tests of machining centres (ISO 10791-1 to -3) are about 10 µm and 60 µrad. A plan that
# leaves an uncertainty as large as that says nothing of the effect.
LARGEST_DISPLACEMENT = 50e-3
LARGEST_ANGLE = 1e-3


class Stopping(NamedTuple):
    """Indices of the ``joints`` that stop where a target is, and the ``rows`` (n,) at which they do: what is read of
    such a joint holds the noise of the row. ``places`` (n, k), in mm, tell targets of one name apart, None where the
    name says which one it is."""

    joints: tuple[int, ...]
    rows: npt.NDArray[np.bool_]
    places: Array | None = None


@dataclass(frozen=True)
class Displaced:
    """A point of a ``setup`` that the readings put ``distance`` mm from where the file states it."""

    setup: str
    distance: float


@dataclass(frozen=True)
class MeasuredChain(ABC):
    """Readings on a chain: n rows, R runs, d numbers a row.

    ``base`` effects are free in every run, ``added`` ones common to all. ``sigma`` (n, d) is the standard
    uncertainty of each number in mm; infinite where a row has no weight.
    """

    context: Context
    base: tuple[Effect, ...]
    added: tuple[Effect, ...]
    sigma: Array

    @property
    @abstractmethod
    def own_names(self) -> tuple[str, ...]:
        """Names of a run's q own unknowns, after the coefficients of the base effects."""

    @property
    @abstractmethod
    def own_start(self) -> Array:
        """Where the search for the own unknowns begins (R, q)."""

    @abstractmethod
    def ends(self, nuisance: Array) -> tuple[Array, Array]:
        """Points (n, 3) mm at the work end, in the frame of the last work axis, and (n, 3) mm at the tool end, in
        that of the last tool axis, for own unknowns (R, q). A fresh array each: effects shift the first in place."""

    @abstractmethod
    def by_own(self, nuisance: Array, pose: ChainPose) -> Array:
        """Derivatives (n, 3, q) of the vector from the work end to the tool end by the own unknowns."""

    def observe(self, rows: Array) -> Array:
        """The part (n, d, ...) that is measured of vectors or their derivatives (n, 3, ...): all three components."""
        return rows

    def with_products(self) -> Self:
        """The problem with all derivatives of its numbers, where it leaves out those that are products of errors."""
        return self

    def as_vectors(self, rows: Array) -> Array:
        """Residuals (n, d) as the shortest vectors (n, 3) mm in the frame of the last work axis."""
        if self.components == ("x", "y", "z"):
            return rows
        directions = self.observe(np.tile(np.eye(3), (len(self.context), 1, 1)))
        return np.asarray(np.einsum("nik,nk->ni", np.linalg.pinv(directions), rows))

    @property
    def shared_by_rows(self) -> tuple[str, ...] | None:
        """What is computed of all rows together, by its names, besides runs and targets, so that a row beside some
        others tells what it tells beside all; None where rows cannot be parted."""
        return None

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the d numbers of a row."""
        return ("x", "y", "z")

    @property
    def is_number(self) -> npt.NDArray[np.bool_]:
        """Which entries (n, d) of the rows are numbers that were read; rows of some kinds have fewer than d."""
        return np.ones(self.sigma.shape, dtype=bool)

    @property
    def is_length(self) -> npt.NDArray[np.bool_]:
        """Which rows (n,) say where a point is, in mm; the others say angles alone."""
        return np.ones(len(self.context), dtype=bool)

    @property
    def series(self) -> npt.NDArray[np.int64]:
        """Which series (n,) a row belongs to: readings resemble those of one instrument before them, no others."""
        return np.zeros(len(self.context), dtype=np.int64)

    @property
    def read_columns(self) -> tuple[str, ...]:
        """The recorded columns that are the readings, where ``with_read`` changes them; none for other methods."""
        return ()

    def with_read(self, channels: Mapping[str, Array]) -> Self:
        """Return the problem with other numbers in ``read_columns``; its unknowns are counted from where they were."""
        raise NotImplementedError

    @property
    def measured_joints(self) -> tuple[int, ...]:
        """Indices of the joints whose readings are what is measured; the others stand where the plan says."""
        return ()

    @property
    def stopping(self) -> Stopping:
        """What stops where a target is: the measured joints, in every row."""
        return Stopping(self.measured_joints, np.ones(len(self.context), dtype=bool))

    @property
    def extra_names(self) -> tuple[str, ...]:
        """Names of the e calibrated quantities that every run has besides its rows."""
        return ()

    @property
    def extras_in_common(self) -> npt.NDArray[np.bool_]:
        """Which (e,) of the calibrated quantities have one value in all runs; the others have another in each."""
        return np.ones(len(self.extra_names), dtype=bool)

    @property
    def common_quantities(self) -> tuple[CommonQuantity | None, ...]:
        """Whose the calibrated quantities (e,) are; None for those that no other campaign can rest on."""
        return (None,) * len(self.extra_names)

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """Whitened residuals (R, e) of the calibrated quantities and derivatives (R, e, q) by the own unknowns."""
        return np.zeros((len(self.runs), 0)), np.zeros((len(self.runs), 0, nuisance.shape[1]))

    @property
    def standard_lengths(self) -> Array:
        """Change (e,) of each calibrated quantity with a strain of the measurement standard of 1, in the unit that its
        deviation has as an input of the uncertainty: 0 where no standard expands."""
        return np.zeros(len(self.extra_names))

    @property
    def left_out(self) -> Mapping[str, str]:
        """Effects of the model that have no column in these readings, by their texts, and why; they are not among the
        ``added`` ones."""
        return {}

    @property
    def stays(self) -> Stays | None:
        """Own unknowns that all runs have in common; None where there are none."""
        return None

    def beside_others(self, solution: Solution, run: int) -> Self:
        """The problem for ``run`` to be looked at by itself, knowing what the other runs say."""
        return self

    @property
    def touches_centres(self) -> bool:
        """Whether a row is the centre of a ball, from touches all around it."""
        return False

    @property
    def touch_normals(self) -> Array | None:
        """Outward normals (n, 3) of the touched surface in the frame of the last work axis; None where a row is no
        single touch."""
        return None

    @property
    def touched_balls(self) -> npt.NDArray[np.bool_]:
        """Whether (n,) a row is a touch of a ball."""
        return np.full(len(self.context), self.touches_centres)

    @property
    def movable(self) -> tuple[str, ...]:
        """The targets that may come loose and stand elsewhere, each with three coordinates of its own."""
        return ()

    @property
    def resting(self) -> tuple[str, ...]:
        """The targets that no axis moves: what they do is the observer's."""
        return ()

    @property
    def moved_together(self) -> Array | None:
        """The moves (q, s) of the own unknowns that placing all targets anew allows; None where they have no places."""
        return None

    @property
    def far_off(self) -> npt.NDArray[np.bool_]:
        """Rows (n,) that stand too far from the others of their target to be the same one; they have no say."""
        return np.zeros(len(self.context), dtype=bool)

    @property
    def target_word(self) -> str:
        """What a target is called."""
        return "ball"

    @property
    def largest_effect(self) -> tuple[float, float]:
        """Displacement (mm at the tool) and angle (rad) of the largest effect that such a machine is likely to hide."""
        return LARGEST_DISPLACEMENT, LARGEST_ANGLE

    @property
    def observes_numbers(self) -> bool:
        """Whether ``evaluated`` gives the numbers of a row themselves, not vectors of which they are a part."""
        return False

    def can_show(self, effect: Effect) -> bool:
        """Whether readings of this kind could show an effect at all, whatever the plan."""
        return True

    @property
    def needs_whole_periods(self) -> bool:
        """Whether a harmonic has to repeat within the travel of its axis to be told apart from what bends once."""
        return False

    def method_effects(self, drivers: Sequence[str]) -> tuple[str, ...]:
        """Effects of the catalogue that only such a method can see, with the drivers that the columns allow."""
        of_probe = () if self.touch_normals is None else of_single_touches()
        chain, base = self.context.chain, [effect.text for effect in self.base]
        of_growth = (
            *of_tool_end(chain, drivers),
            *of_work_end(chain, drivers),
            *of_ram(chain, base, drivers),
        )
        return (*of_balls(drivers), *of_probe, *of_growth)

    @property
    def unsettled(self) -> str:
        """What may keep a fit from settling, as the end of a refusal; empty where nothing is known to."""
        return ""

    def contradiction(self, solution: Solution) -> str | None:
        """Why the readings cannot come from this chain, in words; None where they may."""
        return None

    def mistaken_axes(self) -> str | None:
        """The signs, columns or units of axes by which the readings belong to the chain, in words, where that can be
        said before a fit; None where they do as recorded, or nothing that is tried is enough."""
        return None

    def displaced(self, local: Array) -> tuple[Displaced, ...]:
        """Stated points that the unknowns (p,) of a run put elsewhere by more than people misstate them."""
        return ()

    @property
    def known_errors(self) -> tuple[tuple[ChainEffect, str], ...]:
        """Errors of the machine that are own unknowns, because they were measured by other means: effect and name."""
        return ()

    @property
    def largest_error(self) -> float:
        """The location angle (rad) or gain from which on the readings contradict the machine file."""
        return LARGEST_ERROR

    @property
    def largest_gain(self) -> float:
        """The gain from which on the readings contradict the machine file, where they tell it for certain."""
        return self.largest_error

    @property
    def stays_small(self) -> npt.NDArray[np.bool_] | None:
        """Which of a run's unknowns (p,) stay nearest to zero where no reading tells them apart from others; None where
        none is held so."""
        return None

    @cached_property
    def runs(self) -> npt.NDArray[np.int64]:
        """The runs' numbers, in order."""
        return np.unique(self.context.run)
