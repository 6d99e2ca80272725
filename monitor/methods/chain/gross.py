"""Grossly wrong readings: single rows that hold most of what the model leaves of their run.

A touch recorded half a millimetre off bends every number of its run, and one of fifty millimetres lets no fit converge.
Such rows are named before anything rests on them. Least squares with one row left out is exact in the linear model
(Cook and Weisberg, Residuals and influence in regression, 1982, section 2.2), so the row whose removal lowers the sum
of squares most is the wrong one wherever the plan can tell. A row that its own unknowns follow (a ball of the scale bar
that is touched once a run) leaves no residual; it is held against the same row of the other runs.

Use this for readings that are wrong beyond doubt. Smaller deviations, that only the other runs contradict, are bad
points (``monitor.discovery``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy

from monitor.machine import MOTION
from monitor.methods.chain.along_surface import along_surface
from monitor.methods.chain.deviation import (
    FEWEST_RUNS,
    LEAST_TIMES,
    MOST_PART,
    MOST_ROWS,
    Deviation,
    plan_touches,
)
from monitor.methods.chain.least_squares import Linearisation, RunSpace, Solution, space_of_run
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array

#: A gross row holds so much of its run's sum of squares. Effects and moved targets spread over many rows: the largest
#: share of one row in all examples, labelled campaigns and simulated machines is 0.12 (docs/trials-outliers.md).
SHARE = 0.3
#: Probability that the noise of all rows together has such a row: far below what any later test asks for.
LEVEL = 1e-6
#: Directions in which less than this part of a row's variance is left are followed by the run's own unknowns. Without a
#: ball of the bar the whole run may shrink to a point, gains of -1: of such a row 2e-6 are left.
CHECKED = 1e-3
#: Location angles and gains are expected within this part of the largest that a machine can have (1 mrad, 1 mm/m). Else
#: the gain of an axis that stands still in the plan follows the one row in which a mistyped reading moves it.
USUAL_PART = 0.01
#: By so much narrower is that expectation (1 µrad, 1 µm/m) where the run would rather be no machine than bear a row.
HELD = 1e3
#: Within a run two rows may be wrong alike; the second is as likely where it lowers the sum of squares as much.
AS_LIKELY = 0.95
#: The same touch, off by the same in so many runs and in this part of them, is an error of the machine at that pose:
#: the runs' vectors lie within this part of their mean. What is further off than an effect may be (50 µm) is a mistake
#: in the program of the plan, in however many runs.
FEWEST_ALIKE, PART_ALIKE, SPREAD_ALIKE = 2, 0.5, 0.5


@dataclass(frozen=True)
class JointReading:
    """Where a joint stood: its reading in rad where it ``turns``, else in mm."""

    joint: str
    reading: float
    turns: bool


@dataclass(frozen=True)
class GrossReading:
    """A row that is grossly off, as people find it: its ``axis`` or column is off by ``size`` mm.

    ``pose`` are the joints that the plan moved. ``others`` are the sequences
    of rows of the same run that may be wrong instead. ``is_along_surface``: the touch stands elsewhere on its surface
    than in the other runs, which the numbers of its run show little of or nothing. ``moves`` is that of a deviation.
    """

    row: int
    run: int
    sequence: int
    target: str
    pose: tuple[JointReading, ...]
    axis: str
    size: float
    chi_square: float
    others: tuple[int, ...]
    is_along_surface: bool = False
    moves: float | None = None


@dataclass(frozen=True)
class _Rows:
    """The m rows of a run: whitened residual (N,) and derivatives (N, p), N = m d, its calibrated quantities, and one
    row for each angle and gain that says how large these usually are.

    ``index`` (m,) are the rows' places in the campaign, ``numbers`` their d. Of the unknowns, the first k of which are
    at ``base`` (k,), those of ``is_limited`` (k,) cannot exceed ``largest``.
    """

    index: npt.NDArray[np.int64]
    numbers: int
    residual: Array
    columns: Array
    base: Array
    is_limited: npt.NDArray[np.bool_]
    largest: float

    def without(self, row: int) -> _Rows:
        """The same without weight for one row."""
        part = slice(row * self.numbers, (row + 1) * self.numbers)
        residual, columns = self.residual.copy(), self.columns.copy()
        residual[part], columns[part] = 0.0, 0.0
        return replace(self, residual=residual, columns=columns)

    @property
    def held(self) -> _Rows:
        """The same with angles and gains as good as known."""
        usual = int(np.count_nonzero(self.is_limited))
        weights = np.ones(len(self.residual))
        weights[len(weights) - usual :] = HELD
        return replace(self, residual=weights * self.residual, columns=weights[:, None] * self.columns)

    @cached_property
    def space(self) -> RunSpace:
        """What the unknowns can do."""
        return space_of_run(self.columns)

    @property
    def step(self) -> Array:
        """The step (p,) to the least-squares point, of which the first k are those of ``base``."""
        return np.asarray(self.space.inverse @ (self.space.basis.T @ self.residual))

    def moved_by(self, row: int) -> float:
        """By how many standard uncertainties a row moves the one of ``base`` that it moves most."""
        count = len(self.base)
        u = np.sqrt(np.sum(self.space.inverse[:count] ** 2, axis=1))
        shift = np.abs(self.step - self.without(row).step)[:count]
        return float(np.max(shift / np.where(u > 0.0, u, np.inf), initial=0.0))

    @property
    def is_plausible(self) -> bool:
        """Whether the linear fit is a machine: without a ball of its bar, a run fits gains of -1 perfectly."""
        errors = (self.base - self.step[: len(self.base)])[self.is_limited]
        return bool(np.abs(errors).max(initial=0.0) <= self.largest)


@dataclass(frozen=True)
class _Deletion:
    """What leaving out each of m rows would take off the sum of squares: ``drop`` (m,), of ``total`` with ``freedom``.

    ``vectors`` (m, d) is the residual of every row under the fit without it, in standard uncertainties; ``rank`` (m,)
    counts its directions that are checked.
    """

    drop: Array
    rank: npt.NDArray[np.int64]
    vectors: Array
    total: float
    freedom: int

    def is_gross(self, row: int, tests: int) -> bool:
        """Whether one row stands out of its run beyond doubt, in so many ``tests``."""
        drop, rank = float(self.drop[row]), int(self.rank[row])
        rest = self.freedom - rank
        if rank == 0 or rest < 1 or drop < SHARE * self.total:
            return False
        if float(np.linalg.norm(self.vectors[row])) < LEAST_TIMES:
            return False
        # A model that explains the rest to the last digit leaves no scale of its own: the stated one then.
        scale = max((self.total - drop) / rest, 1.0)
        return float(scipy.special.fdtrc(rank, rest, drop / rank / scale)) * tests < LEVEL


def _deletion(rows: _Rows, out: npt.NDArray[np.bool_]) -> _Deletion:
    basis, rank = rows.space.basis, rows.space.rank
    remainder = rows.residual - basis @ (basis.T @ rows.residual)
    count = len(rows.index)
    of_rows = basis[: count * rows.numbers].reshape(count, rows.numbers, -1)
    residual = remainder[: count * rows.numbers].reshape(count, rows.numbers)
    values, vectors = np.linalg.eigh(np.eye(rows.numbers) - of_rows @ np.swapaxes(of_rows, 1, 2))
    keep = (values > CHECKED) & ~out[:, None]
    inverse = np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    along = np.einsum("nij,ni->nj", vectors, residual)
    weighted = int(np.count_nonzero(np.any(rows.columns != 0.0, axis=1)))
    return _Deletion(
        drop=np.sum(along**2 * inverse, axis=1),
        rank=keep.sum(axis=1),
        vectors=np.einsum("nij,nj->ni", vectors, along * inverse),
        total=float(remainder @ remainder),
        freedom=weighted - rank,
    )


def _grossest(rows: _Rows, deletion: _Deletion, tests: int) -> list[int]:
    """The gross row that lowers the sum of squares most and leaves a machine; behind it those that do so as well."""
    order = np.argsort(-deletion.drop, kind="stable")
    candidates = [
        int(row)
        for row in order[: max(2, MOST_ROWS)]
        if deletion.is_gross(int(row), tests) and rows.without(int(row)).is_plausible
    ]
    return [row for row in candidates if deletion.drop[row] >= AS_LIKELY * deletion.drop[candidates[0]]]


def _of_run(rows: _Rows, sigma: Array, tests: int) -> list[Deviation]:
    """The gross rows of a run, the grossest first; none where they are so many that they are no single mistakes."""
    most = max(1, min(MOST_ROWS, int(MOST_PART * len(rows.index))))
    out = np.zeros(len(rows.index), dtype=bool)
    readings: list[Deviation] = []
    while True:
        # Where a run collapses rather than bear a row, its angles and gains are held until that row is out.
        considered = rows if rows.is_plausible else rows.held
        deletion = _deletion(considered, out)
        gross = _grossest(considered, deletion, tests)
        if not gross:
            return readings
        if len(readings) == most:
            return []
        worst, *alike = gross
        vector = deletion.vectors[worst] * sigma[rows.index[worst]]
        readings.append(
            Deviation(
                row=int(rows.index[worst]),
                vector=tuple(map(float, vector)),
                chi_square=float(deletion.drop[worst]),
                others=tuple(int(rows.index[row]) for row in alike),
                moves=max(map(rows.moved_by, gross)) if considered is rows else None,
            )
        )
        rows = rows.without(worst)
        out[worst] = True


def _rows_of(problem: ChainProblem, at: Linearisation, run: int, local: Array) -> _Rows:
    """The rows of the run at place ``run``, linearised at the unknowns ``local`` (p,) of it."""
    index = np.flatnonzero(problem.context.run == problem.runs[run])
    numbers = len(problem.components)
    depth = at.residual.shape[1] - len(problem.extra_names)
    # Padding stands between the probings of a shorter run and its calibrated quantities.
    places = np.r_[np.arange(len(index) * numbers), np.arange(depth, at.residual.shape[1])]
    columns = np.concatenate([at.local[run], at.common[run]], axis=1)[places]
    base, limited = local[: len(problem.base_names)], np.flatnonzero(problem.is_limited)
    usual = np.zeros((len(limited), columns.shape[1]))
    usual[np.arange(len(limited)), limited] = 1.0 / (USUAL_PART * problem.largest_error)
    return _Rows(
        index,
        numbers,
        np.concatenate([at.residual[run][places], usual[:, : len(base)] @ base]),
        np.concatenate([columns, usual]),
        base,
        problem.is_limited,
        problem.largest_error,
    )


def _alike_in_all_runs(problem: ChainProblem, readings: Sequence[Deviation]) -> set[int]:
    """The gross rows that are no mistakes: most runs read the same touch off by the same vector.

    One pose where an axis was wound up, or a scale has a scratch, holds most of what a model leaves of every run.
    """
    if len(readings) < FEWEST_ALIKE or len(problem.runs) < FEWEST_ALIKE:
        return set()
    vector_of = {reading.row: reading.vector for reading in readings}
    touches = plan_touches(problem)
    alike: set[int] = set()
    for touch in np.unique(touches[list(vector_of)]):
        rows = [row for row in vector_of if touches[row] == touch]
        runs = len(np.unique(problem.context.run[touches == touch]))
        if len(rows) < max(FEWEST_ALIKE, PART_ALIKE * runs):
            continue
        vectors = np.array([vector_of[row] for row in rows])
        mean = vectors.mean(axis=0)
        apart = np.linalg.norm(vectors - mean, axis=1).max()
        length = float(np.linalg.norm(mean))
        if apart <= SPREAD_ALIKE * length and length <= problem.largest_effect[0]:
            alike.update(rows)
    return alike


def deviations(problem: ChainProblem, local: Array, common: Array) -> list[Deviation]:
    """The gross rows by the problem linearised at ``local`` (R, p) and ``common`` (c,), run by run.

    At the start of a search, where no error of the machine is assumed yet, products of errors are neglected: some
    micrometres for targets that stand some millimetres elsewhere.
    """
    at = problem.linearise(local, common)
    tests = len(problem.context)
    sigma = np.where(np.isfinite(problem.sigma), problem.sigma, 0.0)
    readings = [
        reading
        for run in range(len(problem.runs))
        for reading in _of_run(_rows_of(problem, at, run, local[run]), sigma, tests)
    ]
    alike = _alike_in_all_runs(problem, readings)
    return [reading for reading in readings if reading.row not in alike]


def against_other_runs(problem: ChainProblem, solution: Solution) -> list[Deviation]:
    """The gross rows among those that the run's own unknowns follow, by the places of the other runs.

    Between runs the targets may be placed anew as a whole (``problem.moved_together``), but not each by itself. Empty
    for problems whose targets have no places, and with fewer than three runs; without a touch that half of the runs
    contradict.
    """
    placement = problem.moved_together
    count = len(problem.base_names)
    if placement is None or len(problem.runs) < FEWEST_RUNS:
        return []
    determined = np.where(solution.local_free, solution.local, np.nan)
    if np.isnan(determined).all(axis=0).any():
        return []
    median = np.nanmedian(determined, axis=0)
    at = problem.linearise(np.tile(median, (len(problem.runs), 1)), solution.common)
    followed = ~_checked(problem, solution)
    sigma = np.where(np.isfinite(problem.sigma), problem.sigma, 0.0)
    readings = []
    for run in range(len(problem.runs)):
        rows = _rows_of(problem, at, run, median)
        size = len(rows.index) * rows.numbers
        by_placement = rows.columns[:size, count : count + len(placement)] @ placement
        columns = np.concatenate([rows.columns[:size, :count], by_placement], axis=1)
        # Calibrated distances stay as they are where all targets move together.
        limited = int(np.count_nonzero(rows.is_limited))
        behind = rows.columns[len(rows.columns) - limited :, :count]
        by_usual = np.concatenate([behind, np.zeros((limited, placement.shape[1]))], axis=1)
        held = replace(
            rows,
            residual=np.concatenate([rows.residual[:size], rows.residual[len(rows.residual) - limited :]]),
            columns=np.concatenate([columns, by_usual]),
        )
        readings += [
            replace(reading, moves=None)
            for reading in _of_run(held, sigma, len(problem.context))
            if followed[reading.row]
        ]
    return _of_few_runs(problem, readings)


def _of_few_runs(problem: ChainProblem, readings: Sequence[Deviation]) -> list[Deviation]:
    """The readings but those of a touch that contradicts half of the runs or more: nobody can say which are right.

    A ball that is touched where an axis hardly moves before has its backlash on one side on one day, on the other the
    next; without this ball of the bar in any run all of them would shrink to a point.
    """
    touches, runs = plan_touches(problem), problem.context.run
    marked = [int(touches[reading.row]) for reading in readings]
    return [
        reading
        for reading, touch in zip(readings, marked, strict=True)
        if 2 * marked.count(touch) < len(np.unique(runs[touches == touch]))
    ]


def _checked(problem: ChainProblem, solution: Solution) -> npt.NDArray[np.bool_]:
    """Whether the run checks every direction of a row (n,): leaving it out would show in the others."""
    checked = np.zeros(len(problem.context), dtype=bool)
    for run in range(len(problem.runs)):
        rows = _rows_of(problem, solution.last, run, solution.local[run])
        deletion = _deletion(rows, np.zeros(len(rows.index), dtype=bool))
        checked[rows.index] = deletion.rank == rows.numbers
    return checked


def off_reading(problem: ChainProblem, by_error: Array, row: int, vector: Array) -> tuple[str, float]:
    """The reading that explains most of the residual (d,) of a row, and by how much it is off, in mm.

    ``by_error`` (n, 3, J, 2, 6) are the derivatives of the chain's vectors by its errors. A row that stands apart from
    the others of its target (``far_off``), or elsewhere on its surface, has the whole ``vector`` (3,) from them: the
    part of it that the method measures may be small.
    """
    chain = problem.context.chain
    is_whole = len(vector) > len(problem.components)
    linear = problem.measured_joints
    if is_whole:
        linear = tuple(index for index, joint in enumerate(chain.joints) if not joint.turns)
    if not linear:
        most = int(np.abs(vector).argmax())
        return problem.components[most], float(vector[most])
    directions = np.array(
        [np.array(chain.joints[joint].direction) * chain.joints[joint].sign for joint in linear]
    )
    shifts = np.einsum("nrac,ac->nra", by_error[:, :, linear, MOTION, :3], directions)
    measured = shifts if is_whole or problem.far_off[row] else problem.observe(shifts)
    off = np.linalg.pinv(measured[row]) @ vector
    most = int(np.abs(off).argmax())
    return chain.joints[linear[most]].name.lower(), float(off[most])


def as_reading(problem: ChainProblem, by_error: Array, deviation: Deviation) -> GrossReading:
    """A deviation as people find it in the file."""
    context, row = problem.context, deviation.row
    measured = problem.measured_joints
    vector = np.array(deviation.vector)
    if problem.far_off[row]:
        vector = problem.evaluated(problem.start, problem.common_start).residual[row]
    axis, size = off_reading(problem, by_error, row, vector)
    return GrossReading(
        row=row,
        run=int(context.run[row]),
        sequence=int(context.sequence[row]),
        target=str(context.target[row]),
        pose=tuple(
            JointReading(joint.name, float(joint.sign * context.positions[row, index]), joint.turns)
            for index, joint in enumerate(context.chain.joints)
            if index not in measured and np.ptp(context.positions[:, index]) > 0.0
        ),
        axis=axis,
        size=size,
        chi_square=deviation.chi_square,
        others=tuple(int(context.sequence[other]) for other in deviation.others),
        is_along_surface=len(deviation.vector) > len(problem.components),
        moves=deviation.moves,
    )


def gross_readings(problem: ChainProblem, solution: Solution | None = None) -> tuple[GrossReading, ...]:
    """The gross readings of a problem, before any fit of it and, where there is a ``solution``, under that."""
    local, common = problem.start, problem.common_start
    by_row = {deviation.row: deviation for deviation in deviations(problem, local, common)}
    elsewhere = {deviation.row: deviation for deviation in along_surface(problem)}
    if solution is not None:
        local, common = solution.local, solution.common
        later = [*deviations(problem, local, common), *against_other_runs(problem, solution)]
        by_row |= {deviation.row: deviation for deviation in later}
    by_row |= elsewhere
    if not by_row:
        return ()
    by_error = problem.evaluated(local, common, jacobian=True).by_error
    assert by_error is not None
    return tuple(as_reading(problem, by_error, by_row[row]) for row in sorted(by_row))
