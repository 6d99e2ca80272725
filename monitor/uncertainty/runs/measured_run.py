"""One run as a measurement model: which numbers go in, and how trials are put to it.

``MeasuredRun`` is what every method has. ``touched_run`` has that of touched balls, ``row_run`` that of all others and
the function that chooses.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.methods.chain.least_squares import Linearisation, solve
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array

#: Trials that are solved at once by the plain Gauss-Newton: 62 probings of 200 trials take some 100 MB.
CHUNK = 200
#: Numbers of a Jacobian (3 n p) that are held at once: 80 MB.
LARGEST_JACOBIAN = 10_000_000


class Trials(Protocol):
    """The problem whose runs are trials."""

    def linearise(self, local: Array, common: Array) -> Linearisation:
        """Whitened residuals and derivatives of every trial, as ``ChainProblem.linearise``."""
        ...


@dataclass(frozen=True)
class MeasuredRun(ABC):
    """One run: a problem whose context holds this run alone, with the common unknowns held.

    ``common`` (c,) are the coefficients of the effects that all runs share, at their estimates. The inputs are
    the readings and the calibrated quantities of the run, in this order.
    """

    problem: ChainProblem
    common: Array

    @property
    @abstractmethod
    def reading_names(self) -> tuple[str, ...]:
        """Names of the readings, in mm."""

    @property
    @abstractmethod
    def stated(self) -> Array:
        """The stated standard uncertainties of the readings, in mm."""

    @property
    @abstractmethod
    def calibrated(self) -> tuple[tuple[str, ...], str, Array]:
        """Names of the calibrated quantities, their unit and their stated standard uncertainties."""

    @property
    @abstractmethod
    def inputs(self) -> Array:
        """The inputs (N,) as measured."""

    @abstractmethod
    def repeated(self, inputs: Array) -> Trials:
        """The problem whose runs are the trials ``inputs`` (N, B)."""

    @abstractmethod
    def by_inputs(self, unknowns: Array, by_residual: Array) -> Array:
        """Turn derivatives (k, M) by the whitened residuals into derivatives (k, N) by the inputs, to first order.

        The M residuals are those of ``problem.linearise``, the calibrated quantities last; ``unknowns`` (p,) say where.
        """

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of all inputs."""
        return (*self.reading_names, *self.calibrated[0])

    @property
    def numbers(self) -> int:
        """How many rows a Jacobian has before those of the calibrated quantities."""
        return self.problem.sigma.size

    @property
    def probings(self) -> int:
        """The number of probings n."""
        return len(self.problem.context)

    @property
    def unknowns(self) -> int:
        """The number of unknowns p."""
        return len(self.problem.local_names)

    def gradient(self, unknowns: Array, inputs: Array) -> Array:
        """J^T r (p, B), whitened, at ``unknowns`` (p, B) and ``inputs`` (N, B): plain, exact, slow."""
        gradients = np.empty(unknowns.shape)
        for first in range(0, inputs.shape[1], self.at_once):
            chunk = slice(first, first + self.at_once)
            at = self.repeated(inputs[:, chunk]).linearise(
                np.ascontiguousarray(unknowns[:, chunk].T), self.common
            )
            gradients[:, chunk] = np.einsum("rnp,rn->pr", at.local, at.residual)
        return gradients

    @property
    def at_once(self) -> int:
        """So many trials are computed together that their Jacobians fit into memory."""
        return max(1, min(CHUNK, LARGEST_JACOBIAN // max(1, self.probings * 3 * self.unknowns)))

    def solve(self, inputs: Array, start: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Gauss-Newton with a fresh Jacobian in every step for trials ``inputs`` (N, B).

        From ``start`` (p,); returns the unknowns (p, B), NaN where not converged, and which converged (B,).
        """
        trials = inputs.shape[1]
        solved = np.full((self.unknowns, trials), np.nan)
        for first in range(0, trials, self.at_once):
            chunk = slice(first, min(first + self.at_once, trials))
            try:
                solved[:, chunk] = self._solve(inputs[:, chunk], start)
            except (DataError, np.linalg.LinAlgError):
                if inputs[:, chunk].shape[1] == 1:
                    continue
                for trial in range(chunk.start, chunk.stop):
                    solved[:, [trial]] = self.solve(inputs[:, [trial]], start)[0]
        return solved, np.all(np.isfinite(solved), axis=0)

    def _solve(self, inputs: Array, start: Array) -> Array:
        several = self.repeated(inputs)
        fixed = np.zeros(0)

        # The common unknowns are held: they enter the residual, and take no step.
        def linearise(local: Array, _: Array) -> Linearisation:
            at = several.linearise(local, self.common)
            return replace(at, common=at.common[..., :0])

        begin = np.tile(start, (inputs.shape[1], 1))
        return np.asarray(solve(linearise, begin, fixed).local.T)


AnyProblem = TypeVar("AnyProblem", bound=ChainProblem)


def rows_of_run(problem: AnyProblem, run: int) -> AnyProblem:
    """The problem of one run, in which added effects are what they are in the whole campaign."""
    rows = np.flatnonzero(problem.context.run == run)
    single = problem.taken(rows, problem.context.run[rows])
    return replace(single, context=problem.context.part(rows))


def same_plan(first: ChainProblem, other: ChainProblem) -> bool:
    """Whether two problems of one run each have the same targets, at the same set angles, in the same order."""
    if len(first.context) != len(other.context) or not np.array_equal(
        first.context.target, other.context.target
    ):
        return False
    turning = [index for index, joint in enumerate(first.context.chain.joints) if joint.turns]
    return bool(np.allclose(first.context.positions[:, turning], other.context.positions[:, turning]))
