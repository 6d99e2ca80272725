"""The least-squares problem of runs on a kinematic chain: what is the same whatever the method measures.

Something on the tool side is brought to, or seen from, something on the work side. The unknowns of a run are the
coefficients of the model's base effects and those of its own that the method adds (balls, stylus tip, frames,
faces); those common to the campaign are the coefficients of the effects that were added. What a method says of its own
stands in ``measured.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from monitor.effects import Basis, ChainEffect
from monitor.exceptions import DataError, NotConvergedError
from monitor.machine import MOTION, ChainPose, evaluate
from monitor.methods.chain.added_effects import STARTS_S, Added, added_in, columns_of, resolved
from monitor.methods.chain.another_machine import Limited, refuse_another_machine
from monitor.methods.chain.condensed import triangles
from monitor.methods.chain.least_squares import MOST_ITERATIONS, Linearisation, Solution, solve
from monitor.methods.chain.measured import MeasuredChain
from monitor.methods.chain.redundant import held_at_zero, several_of_an_error, without_held
from monitor.methods.chain.sessions import solve_sessions
from monitor.records import Array
from monitor.units import Unit

#: Up to so many rows the derivatives of all stand side by side: 7 kB a row, 1 GB. Of more, those of ``ROWS_AT_ONCE``.
MOST_AT_ONCE, ROWS_AT_ONCE = 140_000, 10_000


@dataclass(frozen=True)
class ChainProblem(MeasuredChain):
    """Readings on a chain as a least-squares problem."""

    def foreseen(self) -> Self:
        """The problem with ``context.expected``, for effects that look at joints which stop where a target is.

        Expected is where the base effects and the own unknowns, fitted to all readings, let such a joint stop. Of
        Gaussian noise the fitted values are independent of what the fit leaves, so no function of them explains it
        better than chance (J. B. Ramsey, J. R. Stat. Soc. B 31 (1969) 350, tests models so). At the readings
        themselves sin(2 pi x / 10 mm) at points 10 mm apart is the noise in another unit.
        """
        stopping = self.stopping
        if self.context.expected is not None or not stopping.joints or not stopping.rows.any():
            return self
        bare = replace(self, added=())
        context = self.context.expecting(stops(bare, solve_problem(bare)))
        return replace(self, context=replace(context, stops_are_stated=stopping.places is not None))

    def with_base(self, effects: tuple[ChainEffect, ...]) -> Self:
        """Return the problem with further base effects behind its own, all of them open."""
        return replace(self, base=(*self.base, *effects))

    def for_search(self) -> Self:
        """The problem in which missing effects are searched."""
        return self.foreseen()

    @cached_property
    def is_limited(self) -> npt.NDArray[np.bool_]:
        """Which base coefficients (k,) are location angles or gains, that cannot exceed ``largest_error``."""
        limited = np.zeros(len(self.base_names), dtype=bool)
        for effect, columns in zip(self.base, self.base_columns, strict=True):
            if isinstance(effect, ChainEffect) and (
                effect.is_gain or (effect.term.is_rotation and effect.text == effect.term.symbol)
            ):
                limited[columns.start] = True
        return limited

    @cached_property
    def targets(self) -> tuple[str, ...]:
        """The targets' names, in order."""
        return tuple(str(name) for name in np.unique(self.context.target))

    @cached_property
    def _run(self) -> npt.NDArray[np.int64]:
        return np.searchsorted(self.runs, self.context.run)

    @cached_property
    def _target(self) -> npt.NDArray[np.int64]:
        return np.searchsorted(np.array(self.targets), self.context.target)

    @cached_property
    def _row(self) -> npt.NDArray[np.int64]:
        """Index of every probing within its run."""
        indices = np.empty(len(self.context), dtype=np.int64)
        for run in range(len(self.runs)):
            rows = np.flatnonzero(self._run == run)
            indices[rows] = np.arange(len(rows))
        return indices

    @cached_property
    def _bases(self) -> tuple[Basis, ...]:
        return tuple(effect.basis(self.context) for effect in self.base)

    @cached_property
    def base_columns(self) -> tuple[slice, ...]:
        """Where the coefficients of each base effect stand among the unknowns of a run."""
        return columns_of(basis.size for basis in self._bases)

    @cached_property
    def common_columns(self) -> tuple[slice, ...]:
        """Where the unknowns of each added effect stand among the common ones."""
        return columns_of(added.unknowns for added in self.shared)

    @cached_property
    def shared(self) -> tuple[Added, ...]:
        """The added effects in this context, with their unknowns in the order of the common ones."""
        return added_in(self.added, self.context)

    @cached_property
    def base_names(self) -> tuple[str, ...]:
        """Names of the base effects' coefficients."""
        return tuple(name for effect in self.base for name in effect.parameters(self.context))

    @cached_property
    def base_units(self) -> dict[str, Unit]:
        """The display units of the base effects' coefficients, by name."""
        return {name: effect.unit for effect in self.base for name in effect.parameters(self.context)}

    @cached_property
    def added_names(self) -> tuple[str, ...]:
        """Names of the common unknowns: the added effects' coefficients and searched time constants."""
        return tuple(name for added in self.shared for name in added.names())

    @cached_property
    def common_start(self) -> Array:
        """Where the search for the common unknowns begins (c,)."""
        return self.common_from(STARTS_S[0])

    def common_from(self, time_constant_s: float) -> Array:
        """No effect at all (c,), with every searched time constant at the given one."""
        start = np.zeros(len(self.added_names))
        for added, columns in zip(self.shared, self.common_columns, strict=True):
            if added.searched:
                start[columns.stop - 1] = np.log(time_constant_s)
        return start

    def resolved(self, common: Array) -> tuple[Self, Array]:
        """The problem with every searched time constant fixed at ``common`` (c,), and the coefficients alone."""
        effects, coefficients = resolved(self.shared, common)
        return replace(self, added=effects), coefficients

    def observed_displacements(self, common: Array, by_error: Array) -> Iterator[Array]:
        """What each added effect at (c,) adds to the residuals: (n, d) in mm, to first order in its coefficients."""
        for added, columns in zip(self.shared, self.common_columns, strict=True):
            unknowns = common[columns]
            yield self.observe(added.basis(unknowns).displacement(by_error) @ unknowns[: added.size])

    def observed_by_common(self, common: Array, by_error: Array) -> Array:
        """Derivatives (n, d, c) of the residuals by the common unknowns."""
        none = np.zeros((len(self.context), len(self.components), 0))
        parts = [
            self.observe(added.displacement(common[columns], by_error))
            for added, columns in zip(self.shared, self.common_columns, strict=True)
        ]
        return np.concatenate([none, *parts], axis=-1)

    @cached_property
    def local_names(self) -> tuple[str, ...]:
        """Names of all unknowns of a run."""
        return (*self.base_names, *self.own_names)

    @cached_property
    def start(self) -> Array:
        """Where the search begins (R, p): no errors, the own unknowns at their start."""
        none = np.zeros((len(self.runs), len(self.base_names)))
        return np.concatenate([none, self.own_start], axis=1)

    def own_of(self, local: Array) -> Array:
        """The own unknowns (R, q) of all unknowns (R, p)."""
        return local[:, len(self.base_names) :]

    def padded(self, rows: Array) -> Array:
        """Rows (n, d, ...) as runs (R, d m, ...), m the longest run; the rest is zero."""
        depth = int(self._row.max()) + 1
        padded = np.zeros((len(self.runs), depth, *rows.shape[1:]))
        padded[self._run, self._row] = rows
        return padded.reshape(len(self.runs), depth * rows.shape[1], *rows.shape[2:])

    def by_rows(self, runs: Array) -> Array:
        """Rows (n, d, ...) of runs (R, N, ...): what ``padded`` does, undone; what stands behind the rows is left."""
        numbers = self.sigma.shape[1]
        depth = int(self._row.max()) + 1
        of_rows = runs[:, : depth * numbers].reshape(len(runs), depth, numbers, *runs.shape[2:])
        return np.asarray(of_rows[self._run, self._row])

    def state(self, local: Array, common: Array) -> tuple[Array, Array, Array]:
        """Errors (n, J, 2, 6), work ends (n, 3) and tool ends (n, 3) at (R, p) and (c,), in internal units."""
        errors = np.zeros((len(self.context), len(self.context.chain.joints), 2, 6))
        target, tip = self.ends(self.own_of(local))
        for basis, columns in zip(self._bases, self.base_columns, strict=True):
            basis.apply(local[self._run, columns], errors, target)
        for added, columns in zip(self.shared, self.common_columns, strict=True):
            unknowns = common[columns]
            added.basis(unknowns).apply(unknowns[: added.size], errors, target)
        return errors, target, tip

    def evaluated(self, local: Array, common: Array, *, jacobian: bool = False) -> ChainPose:
        """The chain at (R, p) and (c,): vectors (n, 3) in mm between its ends, and their derivatives if asked for."""
        errors, target, tip = self.state(local, common)
        return evaluate(self.context.chain, self.context.positions, errors, target, tip, jacobian=jacobian)

    def taken(self, rows: npt.NDArray[np.int64], run: npt.NDArray[np.int64]) -> Self:
        """The problem of chosen rows (k,), with repetitions, that belong to the runs ``run`` (k,).

        Every array with one entry a row is taken along; a problem with other arrays (one entry a run) has its own way.
        """
        arrays: dict[str, Any] = {
            field.name: values[rows]
            for field in fields(self)
            if isinstance(values := getattr(self, field.name), np.ndarray)
            and len(values) == len(self.context)
        }
        return replace(self, context=replace(self.context.taken(rows), run=run), **arrays)

    def guessed_anew(self) -> Self:
        """The problem with its first guess made of its rows as they are now; rows that came to other runs have the
        frame of these."""
        return self

    @property
    def is_in_parts(self) -> bool:
        """Whether the rows are so many that a fit takes some at a time. Added effects look at all rows together."""
        return len(self.context) > MOST_AT_ONCE and self.shared_by_rows is not None and not self.added

    def blocks(self) -> Iterator[Self]:
        """The problem in blocks of ``ROWS_AT_ONCE`` rows in file order, each with the unknowns of the whole."""
        for first in range(0, len(self.context), ROWS_AT_ONCE):
            rows = np.arange(first, min(first + ROWS_AT_ONCE, len(self.context)))
            part = self.taken(rows, self.context.run[rows])
            for name in ("runs", "targets", *(self.shared_by_rows or ())):
                vars(part)[name] = getattr(self, name)
            vars(part)["_bases"] = tuple(basis.taken(rows) for basis in self._bases)
            yield part

    def vectors(self, local: Array, common: Array) -> Array:
        """Residuals (n, d) in mm, in file order."""
        if self.is_in_parts:
            return np.concatenate([part.vectors(local, common) for part in self.blocks()])
        return self.observe(self.evaluated(local, common).residual)

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives at (R, p) and (c,)."""
        of_rows = Linearisation(*map(self.padded, self.of_rows(local, common)))
        return self.with_calibrated(of_rows, local)

    def squares(self, local: Array, common: Array) -> float | None:
        """The sum of squares of the whitened residuals at (R, p) and (c,); None where a linearisation is as quick."""
        return None

    def of_rows(self, local: Array, common: Array) -> tuple[Array, Array, Array]:
        """Whitened residuals (n, d) at (R, p) and (c,), and derivatives (n, d, p) and (n, d, c), row by row."""
        pose = self.evaluated(local, common, jacobian=True)
        assert pose.by_error is not None
        nuisance = self.own_of(local)
        by_local = np.concatenate(
            [*(basis.displacement(pose.by_error) for basis in self._bases), self.by_own(nuisance, pose)],
            axis=-1,
        )
        by_common = np.zeros((len(self.context), pose.residual.shape[1], len(common)))
        for added, columns in zip(self.shared, self.common_columns, strict=True):
            by_common[:, :, columns] = added.displacement(common[columns], pose.by_error)
        return self._white(pose.residual), self._white(by_local), self._white(by_common)

    def condensed(self, local: Array, common: Array) -> Linearisation:
        """The same fit in p + c + 1 rows a run, and behind them its calibrated quantities: ``condensed.py``."""
        unknowns = local.shape[1]
        rows = triangles(self._numbers_of_blocks(local, common), len(self.runs), unknowns + len(common) + 1)
        return self.with_calibrated(
            Linearisation(rows[..., -1], rows[..., :unknowns], rows[..., unknowns:-1]), local
        )

    def _numbers_of_blocks(
        self, local: Array, common: Array
    ) -> Iterator[tuple[npt.NDArray[np.int64], Array]]:
        for block in self.blocks():
            residual, by_local, by_common = block.of_rows(local, common)
            yield block._run, np.concatenate([by_local, by_common, residual[..., None]], axis=-1)

    def with_calibrated(self, of_rows: Linearisation, local: Array) -> Linearisation:
        """What rows say at (R, p), and behind it what is known of the calibrated quantities of every run."""
        extra, by_extra = self.extras(self.own_of(local))
        count = len(self.base_names)
        none = np.zeros((*extra.shape, of_rows.common.shape[-1]))
        return Linearisation(
            np.concatenate([of_rows.residual, extra], axis=1),
            np.concatenate([of_rows.local, np.pad(by_extra, ((0, 0), (0, 0), (count, 0)))], axis=1),
            np.concatenate([of_rows.common, none], axis=1),
        )

    def _white(self, rows: Array) -> Array:
        observed = self.observe(rows)
        return np.asarray(observed / self.sigma.reshape(self.sigma.shape + (1,) * (observed.ndim - 2)))


def stops(problem: ChainProblem, solution: Solution) -> Array:
    """Where the joints that are stopping do so (n, J) under a solution: the readings less the shortest move that would
    do away with a row's residual."""
    chain, stopping = problem.context.chain, problem.stopping
    measured = list(stopping.joints)
    pose = problem.evaluated(solution.local, solution.common, jacobian=True)
    assert pose.by_error is not None
    along = np.array([chain.joints[index].direction for index in measured])
    moved = problem.observe(np.einsum("nrac,ac->nra", pose.by_error[:, :, measured, MOTION, :3], along))
    positions = problem.context.positions.copy()
    shift = np.einsum("nad,nd->na", np.linalg.pinv(moved), problem.observe(pose.residual))
    positions[:, measured] -= np.where(stopping.rows[:, None], shift, 0.0)
    return positions


#: What gives the solution of a problem: ``solve_problem``, or who has it already.
Solver = Callable[[ChainProblem], Solution]


def solve_problem(
    problem: ChainProblem,
    local: Array | None = None,
    common: Array | None = None,
    most: int = MOST_ITERATIONS,
) -> Solution:
    """The least-squares point of a problem, from ``local`` (R, p) and ``common`` (c,) or from no errors at all.

    A searched time constant is begun from several values and the best end is taken, since the sum of squares
    may have more than one minimum in it. Where no start converges, because the readings show only that something
    follows and not how late, it is held at the best of these values and is not determined. Raises DataError where
    that does not converge either, or where the readings fit only another machine. ``most`` bounds the steps where
    nothing is searched. Of a problem that ``is_in_parts`` the solution's ``last`` is condensed.
    """
    begin = problem.start if local is None else local
    first = problem.common_start if common is None else common
    held = np.zeros(len(first), dtype=bool)
    if several_of_an_error(problem.shared):
        held = held_at_zero(problem.shared, problem.linearise(begin, first))

    def linearise(local: Array, common: Array) -> Linearisation:
        at = problem.condensed(local, common) if problem.is_in_parts else problem.linearise(local, common)
        return without_held(at, held)

    starts = [np.where(held, 0.0, first)]
    searched = any(added.searched for added in problem.shared)
    if common is None and searched:
        starts = [problem.common_from(start) for start in STARTS_S]
    elif not searched:
        return _accepted(problem, _solved(problem, linearise, begin, starts[0], most), held)
    try:
        solution = _best_of(problem, linearise, begin, starts)
    except NotConvergedError:
        constant = _time_constants(problem)
        solution = _best_of(
            problem, lambda local, common: without_held(linearise(local, common), constant), begin, starts
        )
    return _accepted(problem, solution, held)


def _accepted(problem: ChainProblem, solution: Solution, held: npt.NDArray[np.bool_]) -> Solution:
    """A solution with what was held at zero; DataError where it is that of another machine."""
    solution = replace(solution, common_held=held)
    limited = [
        Limited(
            problem.base_names[columns.start],
            columns.start,
            isinstance(effect, ChainEffect) and effect.is_gain,
        )
        for effect, columns in zip(problem.base, problem.base_columns, strict=True)
        if problem.is_limited[columns.start]
    ]
    refuse_another_machine(problem, solution, limited)
    return solution


def _solved(
    problem: ChainProblem,
    linearise: Callable[[Array, Array], Linearisation],
    begin: Array,
    common: Array,
    most: int = MOST_ITERATIONS,
) -> Solution:
    """The point of one search; what stays for a session is one number in its runs."""
    stays = problem.stays
    if stays is None:
        return solve(linearise, begin, common, most, problem.squares, problem.stays_small)
    return solve_sessions(linearise, stays, len(problem.extra_names), begin, common, most)


def _time_constants(problem: ChainProblem) -> npt.NDArray[np.bool_]:
    """Which of the common unknowns (c,) are searched time constants."""
    constant = np.zeros(len(problem.added_names), dtype=bool)
    for added, columns in zip(problem.shared, problem.common_columns, strict=True):
        constant[columns.stop - 1] = added.searched
    return constant


def _best_of(
    problem: ChainProblem,
    linearise: Callable[[Array, Array], Linearisation],
    begin: Array,
    starts: Sequence[Array],
) -> Solution:
    """The best end of several starts (c,) of the common unknowns; the fault of the last where none converges."""
    solutions: list[Solution] = []
    fault: DataError | None = None
    for start in starts:
        try:
            solutions.append(_solved(problem, linearise, begin, start))
        except DataError as error:
            fault = error
    if not solutions:
        assert fault is not None
        raise fault
    return min(solutions, key=lambda solution: float(np.sum(solution.last.residual**2)))
