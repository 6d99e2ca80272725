"""Touching targets: residuals and derivatives of runs in which a stylus tip is brought to targets.

The unknowns of a run are the coefficients of the model's base effects, the targets' coordinates and the
stylus tip; those common to the campaign are the coefficients of the effects that were added.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.effects import Basis, ChainEffect, Context, Effect
from monitor.exceptions import DataError
from monitor.machine import evaluate
from monitor.methods.least_squares import Linearisation, Solution, solve
from monitor.methods.searched import STARTS_S, Added, added_in, resolved
from monitor.records import Array

# A wrong sign of an axis fits the readings perfectly with a gain of -2 and mirrored balls. A turn of 0.1 rad or
# a gain of 100 mm/m is no error of a machine but another machine; real ones stay below a hundredth of that.
LARGEST_ERROR = 0.1


@dataclass(frozen=True)
class Distance:
    """A calibrated distance between two targets: length and standard uncertainty (R,) in mm, one a run."""

    between: tuple[str, str]
    length: Array
    standard_uncertainty: float


@dataclass(frozen=True)
class TouchProblem:
    """Probings as a least-squares problem.

    ``base`` effects are free in every run, ``added`` ones common to all. ``sigma`` (n, 3) mm is the standard
    uncertainty of each coordinate of the tip-to-target vector. ``tip`` (3,) mm is the start for the stylus tip.
    """

    context: Context
    base: tuple[Effect, ...]
    added: tuple[Effect, ...]
    sigma: Array
    distances: tuple[Distance, ...] = ()
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)

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
        """Place of every probing within its run."""
        places = np.empty(len(self.context), dtype=np.int64)
        for run in range(len(self.runs)):
            rows = np.flatnonzero(self._run == run)
            places[rows] = np.arange(len(rows))
        return places

    @cached_property
    def _own(self) -> tuple[Basis, ...]:
        return tuple(effect.basis(self.context) for effect in self.base)

    @cached_property
    def shared(self) -> tuple[Added, ...]:
        """The added effects in this context, with their unknowns in the order of the common ones."""
        return added_in(self.added, self.context)

    @cached_property
    def base_names(self) -> tuple[str, ...]:
        """Names of the base effects' coefficients."""
        return tuple(name for effect in self.base for name in effect.parameters(self.context))

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
        place = 0
        for added in self.shared:
            place += added.unknowns
            if added.searched:
                start[place - 1] = np.log(time_constant_s)
        return start

    def resolved(self, common: Array) -> tuple[TouchProblem, Array]:
        """The problem with every searched time constant fixed at ``common`` (c,), and the coefficients alone."""
        effects, coefficients = resolved(self.shared, common)
        return replace(self, added=effects), coefficients

    @cached_property
    def local_names(self) -> tuple[str, ...]:
        """Names of all unknowns of a run."""
        targets = tuple(f"ball {target} {axis}" for target in self.targets for axis in "xyz")
        return (*self.base_names, *targets, "tip x", "tip y", "tip z")

    @cached_property
    def start(self) -> Array:
        """Where the search begins (R, p): no errors, targets at their nominal places."""
        first = {str(t): row for row, t in reversed(list(enumerate(self.context.target)))}
        nominal = np.concatenate([self.context.nominal[first[t]] for t in self.targets])
        one = np.concatenate([np.zeros(len(self.base_names)), nominal, self.tip])
        return np.tile(one, (len(self.runs), 1))

    def _split(self, local: Array) -> tuple[Array, Array, Array]:
        count = len(self.base_names)
        targets = local[:, count:-3].reshape(len(self.runs), len(self.targets), 3)
        return local[:, :count], targets, local[:, -3:]

    def padded(self, rows: Array) -> Array:
        """Rows (n, 3, ...) of probings as runs (R, 3 m, ...), m the longest run; the rest is zero."""
        depth = int(self._row.max()) + 1
        found = np.zeros((len(self.runs), depth, 3, *rows.shape[2:]))
        found[self._run, self._row] = rows
        return found.reshape(len(self.runs), depth * 3, *rows.shape[2:])

    def state(self, local: Array, common: Array) -> tuple[Array, Array, Array]:
        """Errors (n, J, 2, 6), targets (n, 3) and tips (n, 3) at (R, p) and (c,), in internal units."""
        coefficients, targets, tips = self._split(local)
        errors = np.zeros((len(self.context), len(self.context.chain.joints), 2, 6))
        target = targets[self._run, self._target]
        place = 0
        for basis in self._own:
            basis.apply(coefficients[self._run, place : place + basis.size], errors, target)
            place += basis.size
        place = 0
        for added in self.shared:
            unknowns = common[place : place + added.unknowns]
            added.basis(unknowns).apply(unknowns[: added.size], errors, target)
            place += added.unknowns
        return errors, target, tips[self._run]

    def vectors(self, local: Array, common: Array) -> Array:
        """Tip-to-target vectors (n, 3) in mm, in file order."""
        errors, target, tip = self.state(local, common)
        return evaluate(self.context.chain, self.context.positions, errors, target, tip).residual

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives at (R, p) and (c,)."""
        errors, target, tip = self.state(local, common)
        seen = evaluate(self.context.chain, self.context.positions, errors, target, tip, jacobian=True)
        assert seen.by_error is not None
        _, targets, _ = self._split(local)
        count = len(self.base_names)
        by_local = np.zeros((len(self.context), 3, local.shape[1]))
        if self._own:
            by_local[:, :, :count] = np.concatenate(
                [basis.displacement(seen.by_error) for basis in self._own], axis=-1
            )
        for axis in range(3):
            by_local[np.arange(len(self.context)), axis, count + 3 * self._target + axis] = -1.0
        by_local[:, :, -3:] = seen.by_tip
        by_common = np.zeros((len(self.context), 3, len(common)))
        place = 0
        for added in self.shared:
            own = slice(place, place + added.unknowns)
            place += added.unknowns
            by_common[:, :, own] = added.displacement(common[own], seen.by_error)
        lengths, by_lengths = self._lengths(targets, local.shape[1])
        return Linearisation(
            np.concatenate([self.padded(seen.residual / self.sigma), lengths], axis=1),
            np.concatenate([self.padded(by_local / self.sigma[..., None]), by_lengths], axis=1),
            np.concatenate(
                [
                    self.padded(by_common / self.sigma[..., None]),
                    np.zeros((len(self.runs), len(self.distances), by_common.shape[-1])),
                ],
                axis=1,
            ),
        )

    def _lengths(self, targets: Array, width: int) -> tuple[Array, Array]:
        residual = np.zeros((len(self.runs), len(self.distances)))
        by_local = np.zeros((len(self.runs), len(self.distances), width))
        count = len(self.base_names)
        for place, distance in enumerate(self.distances):
            first, second = (self.targets.index(name) for name in distance.between)
            between = targets[:, first] - targets[:, second]
            length = np.linalg.norm(between, axis=-1)
            residual[:, place] = (length - distance.length) / distance.standard_uncertainty
            slope = between / length[:, None] / distance.standard_uncertainty
            by_local[:, place, count + 3 * first : count + 3 * first + 3] = slope
            by_local[:, place, count + 3 * second : count + 3 * second + 3] = -slope
        return residual, by_local


def solve_touch(problem: TouchProblem, local: Array | None = None, common: Array | None = None) -> Solution:
    """The least-squares point of a problem, from ``local`` (R, p) and ``common`` (c,) or from no errors at all.

    A searched time constant is begun from several values and the best end is taken, since the sum of squares
    may have more than one minimum in it. Raises DataError where no start converges, or where the readings fit
    only another machine.
    """
    begin = problem.start if local is None else local
    if common is not None or not any(added.searched for added in problem.shared):
        solution = solve(problem.linearise, begin, problem.common_start if common is None else common)
    else:
        solution = _from_several_starts(problem, begin)
    _refuse_another_machine(problem, solution)
    return solution


def _from_several_starts(problem: TouchProblem, begin: Array) -> Solution:
    found: list[Solution] = []
    fault: DataError | None = None
    for start in STARTS_S:
        try:
            found.append(solve(problem.linearise, begin, problem.common_from(start)))
        except DataError as error:
            fault = error
    if not found:
        assert fault is not None
        raise fault
    return min(found, key=lambda one: float(np.sum(one.last.residual**2)))


def _refuse_another_machine(problem: TouchProblem, solution: Solution) -> None:
    """DataError where a location angle or a gain comes out too large to be an error."""
    place = 0
    for effect in problem.base:
        names = effect.parameters(problem.context)
        if isinstance(effect, ChainEffect) and (
            effect.is_gain or (effect.term.is_rotation and effect.text == effect.term.symbol)
        ):
            found = np.where(solution.local_free[:, place], solution.local[:, place], 0.0)
            worst = int(np.abs(found).argmax())
            if abs(found[worst]) > LARGEST_ERROR:
                what = "mm/mm" if effect.is_gain else "rad"
                raise DataError(
                    f"run {problem.runs[worst]}: {names[0]} comes out at {found[worst]:.3g} {what}, which is no error "
                    "of a machine: the readings contradict the machine file; check the axis signs, the topology, the "
                    "units, the columns and the order of the targets"
                )
        place += len(names)
