"""The least-squares problem of runs on a kinematic chain: what is the same whatever the method measures.

Something on the tool side is brought to, or seen from, something on the work side. The unknowns of a run are the
coefficients of the model's base effects and those of its own that the method adds (balls, stylus tip, frames,
faces); those common to the campaign are the coefficients of the effects that were added. A method says where the two
ends of the chain are (``ends``), how they depend on its own unknowns (``by_own``), which part of the vector between
them a reading measures (``observe``), and which calibrated quantities it has besides (``extras``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from monitor.effects import Basis, ChainEffect, Context, Effect
from monitor.effects.catalogue import of_balls
from monitor.exceptions import DataError
from monitor.machine import MOTION, ChainPose, evaluate
from monitor.methods.chain.added_effects import STARTS_S, Added, added_in, columns_of, resolved
from monitor.methods.chain.least_squares import MOST_ITERATIONS, Linearisation, Solution, solve
from monitor.methods.chain.redundant import held_at_zero, several_of_an_error, without_held
from monitor.records import Array
from monitor.units import Unit

# A wrong sign of an axis fits the readings perfectly with a gain of -2 and mirrored targets. A turn of 0.1 rad or
# a gain of 100 mm/m is no error of a machine but another machine; real ones stay below a hundredth of that.
LARGEST_ERROR = 0.1
# The largest effect that a machine in use is likely to have: 50 µm at the tip, or an angle of 1 mrad. The
# tolerances of geometric tests of machining centres (ISO 10791-1 to -3) are about 10 µm and 60 µrad. A plan that
# leaves an uncertainty as large as that says nothing of the effect.
LARGEST_DISPLACEMENT = 50e-3
LARGEST_ANGLE = 1e-3


@dataclass(frozen=True)
class ChainProblem(ABC):
    """Readings on a chain as a least-squares problem: n rows, R runs, d numbers a row.

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

    def as_vectors(self, rows: Array) -> Array:
        """Residuals (n, d) as the shortest vectors (n, 3) mm in the frame of the last work axis."""
        if self.components == ("x", "y", "z"):
            return rows
        directions = self.observe(np.tile(np.eye(3), (len(self.context), 1, 1)))
        return np.asarray(np.einsum("nik,nk->ni", np.linalg.pinv(directions), rows))

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the d numbers of a row."""
        return ("x", "y", "z")

    @property
    def measured_joints(self) -> tuple[int, ...]:
        """Indices of the joints whose readings are what is measured; the others stand where the plan says."""
        return ()

    def foreseen(self) -> Self:
        """The problem with ``context.expected``, for effects that look at the measured joints.

        Expected is where the base effects and the own unknowns, fitted to all readings, let a measured joint stop. Of
        Gaussian noise the fitted values are independent of what the fit leaves, so no function of them explains it
        better than chance (J. B. Ramsey, J. R. Stat. Soc. B 31 (1969) 350, tests models so). At the readings
        themselves sin(2 pi x / 10 mm) at points 10 mm apart is the noise in another unit.
        """
        if self.context.expected is not None or not self.measured_joints:
            return self
        bare = replace(self, added=())
        return replace(self, context=self.context.expecting(stops(bare, solve_problem(bare))))

    def for_search(self) -> Self:
        """The problem in which missing effects are searched."""
        return self.foreseen()

    @property
    def extra_names(self) -> tuple[str, ...]:
        """Names of the e calibrated quantities that every run has besides its rows."""
        return ()

    def extras(self, nuisance: Array) -> tuple[Array, Array]:
        """Whitened residuals (R, e) of the calibrated quantities and derivatives (R, e, q) by the own unknowns."""
        return np.zeros((len(self.runs), 0)), np.zeros((len(self.runs), 0, nuisance.shape[1]))

    @property
    def standard_lengths(self) -> Array:
        """Change (e,) of each calibrated quantity with a strain of the measurement standard of 1, in the unit that its
        deviation has as an input of the uncertainty: 0 where no standard expands."""
        return np.zeros(len(self.extra_names))

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
        return of_balls(drivers)

    def contradiction(self, solution: Solution) -> str | None:
        """Why the readings cannot come from this chain, in words; None where they may."""
        return None

    @property
    def known_errors(self) -> tuple[tuple[ChainEffect, str], ...]:
        """Errors of the machine that are own unknowns, because they were measured by other means: effect and name."""
        return ()

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

    @property
    def largest_error(self) -> float:
        """The location angle (rad) or gain from which on the readings contradict the machine file."""
        return LARGEST_ERROR

    @cached_property
    def runs(self) -> npt.NDArray[np.int64]:
        """The runs' numbers, in order."""
        return np.unique(self.context.run)

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

    def vectors(self, local: Array, common: Array) -> Array:
        """Residuals (n, d) in mm, in file order."""
        return self.observe(self.evaluated(local, common).residual)

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives at (R, p) and (c,)."""
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
        extra, by_extra = self.extras(nuisance)
        count = len(self.base_names)
        return Linearisation(
            np.concatenate([self._white(pose.residual), extra], axis=1),
            np.concatenate([self._white(by_local), np.pad(by_extra, ((0, 0), (0, 0), (count, 0)))], axis=1),
            np.concatenate([self._white(by_common), np.zeros((*extra.shape, len(common)))], axis=1),
        )

    def _white(self, rows: Array) -> Array:
        observed = self.observe(rows)
        return self.padded(observed / self.sigma.reshape(self.sigma.shape + (1,) * (observed.ndim - 2)))


def stops(problem: ChainProblem, solution: Solution) -> Array:
    """Where the measured joints stop (n, J) under a solution: the readings less the shortest move that would do away
    with a row's residual."""
    chain, measured = problem.context.chain, list(problem.measured_joints)
    pose = problem.evaluated(solution.local, solution.common, jacobian=True)
    assert pose.by_error is not None
    along = np.array([chain.joints[index].direction for index in measured])
    moved = problem.observe(np.einsum("nrac,ac->nra", pose.by_error[:, :, measured, MOTION, :3], along))
    positions = problem.context.positions.copy()
    positions[:, measured] -= np.einsum("nad,nd->na", np.linalg.pinv(moved), problem.observe(pose.residual))
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
    may have more than one minimum in it. Raises DataError where no start converges, or where the readings fit
    only another machine. ``most`` bounds the steps where nothing is searched.
    """
    begin = problem.start if local is None else local
    first = problem.common_start if common is None else common
    held = np.zeros(len(first), dtype=bool)
    if several_of_an_error(problem.shared):
        held = held_at_zero(problem.shared, problem.linearise(begin, first))

    def linearise(local: Array, common: Array) -> Linearisation:
        return without_held(problem.linearise(local, common), held)

    if common is not None or not any(added.searched for added in problem.shared):
        solution = solve(linearise, begin, np.where(held, 0.0, first), most)
    else:
        solution = _from_several_starts(problem, linearise, begin)
    solution = replace(solution, common_held=held)
    _refuse_another_machine(problem, solution)
    return solution


def _from_several_starts(
    problem: ChainProblem, linearise: Callable[[Array, Array], Linearisation], begin: Array
) -> Solution:
    solutions: list[Solution] = []
    fault: DataError | None = None
    for start in STARTS_S:
        try:
            solutions.append(solve(linearise, begin, problem.common_from(start)))
        except DataError as error:
            fault = error
    if not solutions:
        assert fault is not None
        raise fault
    return min(solutions, key=lambda solution: float(np.sum(solution.last.residual**2)))


def _refuse_another_machine(problem: ChainProblem, solution: Solution) -> None:
    """DataError where a location angle or a gain comes out too large to be an error, or too much is left."""
    for effect, columns in zip(problem.base, problem.base_columns, strict=True):
        if not problem.is_limited[columns.start]:
            continue
        free, values = solution.local_free[:, columns.start], solution.local[:, columns.start]
        errors = np.where(free, values, 0.0)
        worst = int(np.abs(errors).argmax())
        if abs(errors[worst]) > problem.largest_error:
            unit = "mm/mm" if isinstance(effect, ChainEffect) and effect.is_gain else "rad"
            raise DataError(
                f"run {problem.runs[worst]}: {problem.base_names[columns.start]} comes out at {errors[worst]:.3g} "
                f"{unit}, which is no error of a machine: the readings contradict the machine file; check the axis "
                "signs, the topology, the units, the columns and the order of the targets"
            )
    wrong = problem.contradiction(solution)
    if wrong is not None:
        raise DataError(f"the readings contradict the machine file: {wrong}")
