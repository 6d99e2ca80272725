"""What a kind of reading is: numbers that an instrument shows, by how tool side and work side stand.

A kind is one file of ``readings`` with a ``READING``: a class that is made from a setup and its rows. Everything is
seen from the work side: r leads from the work point to the tool point in the frame of the last work axis. Angles are
read as what they come to at ``LEVER``: a microradian is a micrometre at one metre, so that lengths and angles of one
campaign stand in one table.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Protocol, Self

import numpy as np
import numpy.typing as npt

from monitor.machine import Chain
from monitor.records import Array, Setup
from monitor.units import MICROMETRE, MICRORADIAN

#: mm at which an angle is a length.
LEVER = 1000.0
#: An unknown turn of a frame, about X, Y and Z, and its shift.
TURN, SHIFT = ("frame a", "frame b", "frame c"), ("frame x", "frame y", "frame z")

#: The unknown of a beam that acts as a gain: known beforehand, or no gain of an axis had a number.
COSINE = "cosine error"


#: The factor from a column of the file to mm, by the end of its name; a component of a direction has none.
TO_MM = {"um": MICROMETRE.factor, "mm": 1.0, "urad": MICRORADIAN.factor * LEVER}


def in_mm(name: str, values: Array) -> Array:
    """The numbers of a column in mm; a component of a direction as it is."""
    return values * TO_MM.get(name.rpartition("_")[2], 1.0)


@dataclass(frozen=True)
class Rows:
    """The m rows of one setup: ``run`` (m,) indices of their runs from 0, ``target`` (m,) names, ``measured`` (m, k)
    the columns of their kind in mm (NaN where one was not read), ``positions`` (m, J), ``nominal`` (m, 3) where the
    target stands by the file, NaN where that is not said, ``elapsed`` (m,) the time from 0 at the setup's first row of
    the run to 1 at its last, ``guess`` (m, g) constants of a kind: where its search begins."""

    chain: Chain
    run: npt.NDArray[np.int64]
    target: npt.NDArray[np.str_]
    measured: Array
    positions: Array
    nominal: Array
    elapsed: Array
    guess: Array

    def __len__(self) -> int:
        return len(self.run)

    def taken(self, rows: npt.NDArray[np.int64], run: npt.NDArray[np.int64]) -> Self:
        """Chosen rows (m',), with repetitions, that belong to the runs ``run`` (m',)."""
        arrays: dict[str, Any] = {
            field.name: values[rows]
            for field in fields(self)
            if isinstance(values := getattr(self, field.name), np.ndarray)
        }
        return replace(self, **{**arrays, "run": run})


@dataclass(frozen=True)
class Stance:
    """How the sides stand at the m rows of a setup.

    ``r`` (m, 3) mm from work point to tool point, ``turned`` (m, 3, 3) the tool side in the frame of the last work
    axis; ``work`` and ``tool`` (m, 3, 3) both sides in the bed's frame. ``nominal`` is the same of a machine without
    errors, None in itself.
    """

    r: Array
    turned: Array
    work: Array
    tool: Array
    nominal: Stance | None = None


@dataclass(frozen=True)
class Shown:
    """What the instrument would show less what it showed, (m, k) in mm, and its derivatives.

    ``by_shift`` (m, k, 3) by r, ``by_turn`` (m, k, 3) per radian by the turn of the tool side against the work side,
    both in the frame of the last work axis; ``by_mean`` (m, k, 3) by the mean of r over the rows of the run, which a
    placing follows; ``by_tool`` and ``by_work`` (m, k, 3) by the turn of one side alone in the bed's frame (a level).
    None: no such derivative. ``by_own`` (m, k, q) by the unknowns of the setup. ``along``
    (m, k, 3) are unit vectors by which people see the numbers of angles, in the frame of the last work axis.
    """

    residual: Array
    by_shift: Array | None = None
    by_turn: Array | None = None
    by_mean: Array | None = None
    by_tool: Array | None = None
    by_work: Array | None = None
    by_own: Array | None = None
    along: Array | None = None


class Reading(Protocol):
    """A kind of reading in one setup."""

    #: What a setup writes under ``reading``.
    name: ClassVar[str]
    #: Columns of the file.
    columns: ClassVar[tuple[str, ...]]
    #: Whether the file's numbers are angles in µrad.
    angular: ClassVar[bool]
    #: How many of the numbers, the last ones, are turns beside lengths, with an uncertainty of their own.
    turns: ClassVar[int]
    #: Unknowns of each run that a setup may hold, by the word under ``known``.
    holdable: ClassVar[tuple[str, ...]]
    #: Whether a reading counts from the first row of the run.
    relative: ClassVar[bool]
    #: Unknowns of what is the same in all runs of a campaign (a bar), where they are known beforehand.
    staying: ClassVar[tuple[str, ...]]

    @property
    def has_own_frame(self) -> bool:
        """Whether the numbers are along the axes of a frame of the setup that is not the machine's."""
        ...

    @property
    def besides(self) -> float:
        """The length in mm that a reading has besides its number, as that of a bar."""
        ...

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        """Make the reading of a setup from its rows; the rows with the constants of the kind."""
        ...

    def guessed_anew(self, rows: Rows) -> tuple[Self, Rows]:
        """The reading with its first guess made of the rows as they are now; the rows with its constants."""
        ...

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of the k numbers of a row."""
        ...

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the q unknowns of each run."""
        ...

    @property
    def shared(self) -> Mapping[str, Hashable]:
        """Unknowns of what several setups use (a bar), by name: setups with the same value have them in common."""
        ...

    def start(self, runs: int) -> Array:
        """Where the search for the unknowns begins (R, q)."""
        ...

    def prior(self) -> tuple[tuple[int, float], ...]:
        """Unknowns that are known with a standard uncertainty: index and u in mm or rad; they are 0 as stated."""
        ...

    def ends(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        """Work point and tool point (m, 3) mm in the frames of the last axes, for unknowns (m, q) row by row."""
        ...

    def shown(self, stance: Stance, values: Array, rows: Rows) -> Shown:
        """What the instrument shows."""
        ...


@dataclass(frozen=True)
class Plain:
    """What most kinds share: points as the setup states them, and no unknowns."""

    setup: Setup

    holdable: ClassVar[tuple[str, ...]] = ()
    angular: ClassVar[bool] = False
    turns: ClassVar[int] = 0
    relative: ClassVar[bool] = False
    staying: ClassVar[tuple[str, ...]] = ()

    @property
    def has_own_frame(self) -> bool:
        return False

    @property
    def besides(self) -> float:
        return self.setup.length or 0.0

    @classmethod
    def of(cls, setup: Setup, rows: Rows) -> tuple[Self, Rows]:
        return cls(setup), rows

    def guessed_anew(self, rows: Rows) -> tuple[Self, Rows]:
        return self, rows

    def holds(self, unknown: str) -> bool:
        """Whether the setup states an unknown as known."""
        return unknown in self.setup.known

    @property
    def unknowns(self) -> tuple[str, ...]:
        return ()

    @property
    def shared(self) -> Mapping[str, Hashable]:
        return {}

    def start(self, runs: int) -> Array:
        return np.zeros((runs, len(self.unknowns)))

    def prior(self) -> tuple[tuple[int, float], ...]:
        return ()

    def ends(self, values: Array, rows: Rows) -> tuple[Array, Array]:
        count = len(rows)
        return np.tile(self.setup.work_point, (count, 1)), np.tile(self.setup.tool_point, (count, 1))


def direction_of(setup: Setup) -> Array:
    """The direction (3,) of a setup whose kind has one."""
    assert setup.direction is not None  # the reader asks for it
    return np.array(setup.direction)


def mean_of_runs(values: Array, run: npt.NDArray[np.int64]) -> Array:
    """The mean (m, ...) of values (m, ...) over the rows of each row's run (m,)."""
    runs, index, counts = np.unique(run, return_inverse=True, return_counts=True)
    total = np.zeros((len(runs), *values.shape[1:]))
    np.add.at(total, index, values)
    return np.asarray((total.T / counts).T[index])


def cross_matrix(vectors: Array) -> Array:
    """Matrices (..., 3, 3) that multiply by a cross product from the left."""
    matrices = np.zeros((*vectors.shape, 3))
    x, y, z = np.moveaxis(vectors, -1, 0)
    matrices[..., 0, 1], matrices[..., 0, 2] = -z, y
    matrices[..., 1, 0], matrices[..., 1, 2] = z, -x
    matrices[..., 2, 0], matrices[..., 2, 1] = -y, x
    return matrices


def turn_vectors(rotation: Array) -> Array:
    """Turn vectors (m, 3) rad of rotations (m, 3, 3) by less than half a turn."""
    axial = 0.5 * np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(axial, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=1, axis2=2) - 1.0))
    return axial * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 1.0)[:, None]
