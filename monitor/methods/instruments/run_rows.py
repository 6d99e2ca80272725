"""The rows of one run as its joint fit sees them: derivatives and residuals at the joint point, and whose they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from monitor.methods.chain.least_squares import (
    MEMBER_SHARE,
    RANK_TOLERANCE,
    Solution,
    inverse_of_full_rank,
)
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.records import Array

#: Of an unknown that an instrument does not show, its rows have this part of the derivatives, or less, by rounding.
ROUNDING = 1e-7


@dataclass(frozen=True)
class Separated:
    """What rows separate of the unknowns (p,): the ``projector`` (p, p) on it, as many combinations of them as its rank
    says, ``unknowns`` (p, r), and which of them are ``determined`` (p,)."""

    projector: Array
    unknowns: Array
    determined: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class RunRows:
    """Whitened ``jacobian`` (N, p) and ``residual`` (N,) of a run at its joint point, those of what is known beforehand
    last (from ``extras`` on), and the derivatives ``nominal`` (N, p) on a machine without errors."""

    problem: InstrumentProblem
    run: int
    jacobian: Array
    residual: Array
    nominal: Array

    @property
    def extras(self) -> int:
        """Where the rows of what is known beforehand begin."""
        return len(self.residual) - len(self.problem.extra_names)

    @cached_property
    def is_read(self) -> npt.NDArray[np.bool_]:
        """Which rows (N,) are numbers that were read."""
        read: npt.NDArray[np.bool_] = np.any(self.jacobian != 0.0, axis=1)
        read[self.extras :] = False
        return read

    def of_setups(self, setups: tuple[str, ...]) -> npt.NDArray[np.int64]:
        """Where the numbers of setups stand, without what is known of them beforehand."""
        at = np.concatenate([part.at for part in self.problem.parts if part.id in setups])
        of_run = np.flatnonzero(self.problem.context.run == self.run)
        within = np.flatnonzero(np.isin(of_run, at))
        numbers = self.problem.sigma.shape[1]
        return np.asarray((within[:, None] * numbers + np.arange(numbers)).ravel(), dtype=np.int64)

    def known_of(self, setups: tuple[str, ...]) -> npt.NDArray[np.int64]:
        """Where what is known beforehand of setups stands; a bar that several share stands with the first of them."""
        several = len(self.problem.parts) > 1
        return np.array(
            [
                self.extras + number
                for number, extra in enumerate(self.problem.extra_names)
                if not several or any(extra.startswith(f"{setup} ") for setup in setups)
            ],
            dtype=np.int64,
        )

    def shared_beforehand(self) -> dict[str, tuple[npt.NDArray[np.int64], frozenset[str]]]:
        """What is known beforehand of an unknown that several setups have in common (the length of a bar), by what it
        is: its rows, and the setups."""
        rows: dict[str, list[int]] = {}
        setups: dict[str, frozenset[str]] = {}
        for number, extra in enumerate(self.problem.extra_names):
            column = self.problem.own_names.index(extra)
            parts = [
                part
                for part, columns in zip(self.problem.parts, self.problem.own_columns, strict=True)
                if column in columns
            ]
            if len(parts) > 1:
                unknown = extra.removeprefix(f"{parts[0].id} ").removesuffix(" x")
                unknown = unknown.removesuffix(" y").removesuffix(" z")
                name = f"the stated {unknown} of {parts[0].instrument}"
                rows.setdefault(name, []).append(self.extras + number)
                setups[name] = frozenset(part.id for part in parts)
        return {name: (np.array(of_name), setups[name]) for name, of_name in rows.items()}

    def made_independent(self, white: Callable[[Array], Array]) -> Self:
        """The rows with numbers that ``white`` (..., R, N) makes independent within every setup; what is nominal says
        only what can be separated, which that does not change."""
        index = int(np.searchsorted(self.problem.runs, self.run))
        columns = np.column_stack([self.jacobian, self.residual]).T
        of_runs = np.zeros((len(columns), len(self.problem.runs), columns.shape[1]))
        of_runs[:, index] = columns
        independent = white(of_runs)[:, index].T
        return replace(self, jacobian=independent[:, :-1], residual=independent[:, -1])

    @cached_property
    def sizes(self) -> Array:
        """The lengths (p,) of the derivatives by all rows on a machine without errors."""
        return np.asarray(np.linalg.norm(self.nominal, axis=0))

    def separated(self, rows: npt.NDArray[np.int64]) -> Separated:
        """What rows (m,) separate."""
        return separated_by(self.nominal[rows], self.sizes)


def separated_by(nominal: Array, sizes: Array) -> Separated:
    """What derivatives (m, p) separate.

    What is small beside the ``sizes`` (p,) of the derivatives by all rows is rounding.
    """
    length = np.linalg.norm(nominal, axis=0)
    is_shown = (length >= ROUNDING * sizes) & (length > 0.0)
    scale = np.where(is_shown, length, 1.0)
    matrix = np.where(is_shown, nominal, 0.0) / scale
    triangle = np.asarray(np.linalg.qr(matrix[:, is_shown], mode="r"))
    if inverse_of_full_rank(triangle) is not None:
        # Nothing is open but what these rows do not show.
        unknowns = np.eye(len(scale))[:, is_shown] / scale[:, None]
        return Separated(np.diag(is_shown.astype(np.float64)), unknowns, is_shown)
    _, strength, vectors = np.linalg.svd(np.linalg.qr(matrix, mode="r"))
    rank = int(np.count_nonzero(strength > RANK_TOLERANCE * strength.max(initial=0.0)))
    unknowns, left_open = vectors[:rank].T, vectors[rank:]
    projector = np.eye(len(scale)) - left_open.T @ left_open
    projector *= np.linalg.norm(projector, axis=0) > ROUNDING
    determined = np.abs(left_open).max(axis=0, initial=0.0) < MEMBER_SHARE
    return Separated(projector * scale[None, :] / scale[:, None], unknowns / scale[:, None], determined)


def run_rows(problem: ChainProblem, solution: Solution, run: int, *, knows_others: bool = False) -> RunRows:
    """The rows of a run at the point of a joint fit, by itself: with what is stated of its bars and scales.

    A run that ``knows_others`` has its covariance in the joint fit: it knows what the other runs say of what they
    share. Whether instruments agree is asked without that: each run would vouch for the same wrong bar in the others.
    """
    assert isinstance(problem, InstrumentProblem)
    index = int(np.searchsorted(problem.runs, run))
    alone = replace(problem, shares_bars=False, from_others=None)
    by_itself = problem.beside_others(solution, run) if knows_others else alone
    at = by_itself.linearise(solution.local, solution.common)
    whole = replace(problem, is_whole=True).linearise(problem.start, problem.common_start)
    return RunRows(
        problem,
        run,
        np.hstack([at.local[index], at.common[index]]),
        at.residual[index],
        np.hstack([whole.local[index], whole.common[index]]),
    )


def instruments_of(problem: InstrumentProblem) -> dict[str, tuple[str, ...]]:
    """The setups of each instrument, by its words; by its id where a setup says none."""
    groups: dict[str, tuple[str, ...]] = {}
    for setup in problem.setups:
        name = setup.instrument or setup.id
        groups[name] = (*groups.get(name, ()), setup.id)
    return groups
