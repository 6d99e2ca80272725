"""A fitted chain as the scan sees it: its residual, and candidates with everything that is free in every run taken out.

The columns of a candidate are the whitened change of the tip-to-target vector that each coefficient of its effect
causes, with the nuisance (base parameters, targets and tip, free in every run) projected out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.evidence.held_out import (
    LeftOutBlocks,
    PoseFold,
    held_out_by_poses,
    pose_folds,
    pose_parts,
)
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene_columns import columns_of, raw_columns, raw_lengths
from monitor.discovery.search.candidate import Candidate, Variant
from monitor.discovery.search.held_out import held_out_rms
from monitor.discovery.search.memory import Memory
from monitor.discovery.search.remainder import Remainders
from monitor.discovery.search.scene import family_count
from monitor.effects import Basis, ChainEffect, ParsedEffect
from monitor.effects.drivers import Always
from monitor.effects.joint_error import JointError
from monitor.effects.shapes import Lag, Poly
from monitor.exceptions import EffectError
from monitor.machine import MOTION
from monitor.methods.chain.shared_effects import largest_coefficient
from monitor.records import Array

# An effect is found for certain where its visible part is this many standard deviations long: the 1 % level
# over some 300 candidates lies at 4.2.
DETECTABLE = 5.0

# By so much scores differ where effects are one at all poses but for rounding, which is below 1e-5 of a score; nothing
# else is decided by it.
BEHIND = 2e-4

MachineEffect: TypeAlias = ParsedEffect
ChainVariant: TypeAlias = Variant[MachineEffect]


@dataclass(frozen=True)
class ChainCandidate(Candidate[MachineEffect]):
    """An effect of a chain as the data of a ``fit`` see it; ``basis`` is the effect at every probing, ``largest`` the
    coefficients that a machine in use is likely to have at most."""

    fit: Fit
    basis: Basis

    @property
    def behind(self) -> float:
        """By how much its score stands behind that of a commoner cause which does the same at these poses."""
        return BEHIND * _less_common(self.effect)

    @property
    def raw(self) -> Array:
        """The displacement (n, d, k) in mm at every probing for a unit of each coefficient."""
        return np.moveaxis(raw_columns(self.fit, self.basis), 0, 2)

    @property
    def raw_lengths(self) -> Array:
        """The lengths (k,) in mm of those displacements over all probings."""
        return raw_lengths(self.fit, self.basis)

    @cached_property
    def detectable(self) -> bool:
        """Whether an effect as large as a machine in use may hide would be found with this plan."""
        longest = float(np.sqrt(np.einsum("mk,mk->k", self.columns, self.columns).max(initial=0.0)))
        return self.visible and longest * self.largest > DETECTABLE


@dataclass(frozen=True)
class ChainScene:
    """The residual (M,) of a fit, whitened, and the candidates that may explain it.

    ``shared`` (M, c) are the projected columns of the effects that the model has already and all runs share;
    ``refused`` names effects that the recorded columns do not allow, and why.
    """

    fit: Fit
    shared: Array
    candidates: tuple[ChainCandidate, ...]
    refused: tuple[tuple[str, str], ...]

    @cached_property
    def residual(self) -> Array:
        """The whitened residual (M,), run by run."""
        return self.fit.white.reshape(-1)

    @property
    def degrees_of_freedom(self) -> int:
        """Those that the runs' own unknowns leave, before ``shared`` takes its part."""
        return self.fit.degrees_of_freedom + self.fit.nuisance.shared_rank

    @cached_property
    def run(self) -> npt.NDArray[np.int64]:
        """The index (M,) of the run of every row."""
        runs, rows = self.fit.solution.last.residual.shape
        return np.repeat(np.arange(runs), rows)

    def columns(self, candidates: Sequence[Candidate[object]]) -> Array:
        """The shared columns, then those of the candidates."""
        return _side_by_side(self.shared, candidates)

    @cached_property
    def remainders(self) -> Remainders:
        """What selected effects, beside ``shared``, leave of the residual."""
        # Of the columns alone: with the scene it would be a circle, which stays until Python looks for garbage.
        return Remainders(self.residual, self.degrees_of_freedom, partial(_side_by_side, self.shared))

    @cached_property
    def families(self) -> int:
        """The number of families of which the data see anything."""
        return family_count(self)

    @cached_property
    def powers(self) -> tuple[ChainCandidate, ...]:
        """The powers of a position that the data see anything of and that follow no driver."""
        return tuple(filter(_is_power, self.candidates))

    @property
    def held_out_errors(self) -> tuple[Callable[[Array], float | None], ...]:
        """Those of runs (of blocks of poses where there is one run), and of poses left out of every run."""
        return self.held_out_error, self.held_out_error_by_poses

    def held_out_error(self, columns: Array) -> float | None:
        """Root mean square error in mm of runs left out in turn, of blocks of poses where there is one run."""
        return self.held_out_error_of(columns, np.arange(len(self.fit.problem.runs)))

    @cached_property
    def _pose_folds(self) -> tuple[PoseFold, ...]:
        return pose_folds(self.fit)

    def held_out_error_by_poses(self, columns: Array) -> float | None:
        """Root mean square error in mm of poses left out of every run with ``columns`` (M, c) of shared effects; None
        where the plan has too few."""
        if len(self.fit.problem.runs) == 1 and self._left_out_blocks is not None:
            # Blocks of poses are what is left out of a single run anyway.
            return self.held_out_error(columns)
        error = held_out_by_poses(self.fit.white, columns, self._pose_folds)
        return None if error is None else self.fit.sigma * error

    @cached_property
    def _errors_by_poses(self) -> Memory[float | None]:
        return Memory()

    def error_by_poses_beside(self, selected: Sequence[ChainCandidate]) -> float | None:
        """That error with selected effects, to which each that may come to them is compared."""
        return self._errors_by_poses.answer(
            selected, None, lambda: self.held_out_error_by_poses(self.columns(selected))
        )

    def held_out_error_of(self, columns: Array, fold: npt.NDArray[np.int64]) -> float | None:
        """Root mean square error in mm with ``columns`` (M, c) of shared effects; ``fold`` (R,) is that of every run.

        Runs are left out where there are two folds or more, blocks of poses where there is one run, None otherwise.
        """
        fit = self.fit
        if len(fold) > 1:
            return held_out_rms(self.residual, columns, fold[self.run], self.degrees_of_freedom, fit.sigma)
        if self._left_out_blocks is None:
            return None
        squares = self._left_out_blocks.sum_of_squares(self.residual, columns)
        return fit.sigma * float(np.sqrt(squares / fit.readings))

    @cached_property
    def _left_out_blocks(self) -> LeftOutBlocks | None:
        parts = pose_parts(self.fit)
        if parts is None:
            return None
        return LeftOutBlocks(self.fit.nuisance.basis.reshape(len(self.residual), -1), parts)


def _less_common(effect: MachineEffect) -> int:
    """How much less common a cause an error motion is than that of the drive of its axis, 0: a displacement across it
    (1), a tilt (2); 0 for all others. What lags in proportion to the last move is less common than any play (3):
    between moves of one length the two are one."""
    if not isinstance(effect, ChainEffect) or effect.term.stage != MOTION:
        return 0
    lags = 3 if isinstance(effect.shape, Lag) else 0
    if JointError(effect.term, effect.joint).is_of_drive:
        return lags
    return lags + (2 if effect.term.is_rotation else 1)


def _is_power(candidate: ChainCandidate) -> bool:
    effect = candidate.effect
    if not isinstance(effect, ChainEffect) or not isinstance(effect.driver, Always):
        return False
    return candidate.visible and isinstance(effect.shape, Poly)


def _side_by_side(shared: Array, candidates: Sequence[Candidate[object]]) -> Array:
    return np.concatenate([shared, *(candidate.columns for candidate in candidates)], axis=1)


def scene_of(fit: Fit, variants: Sequence[ChainVariant]) -> ChainScene:
    """The residual of a fit and what the data can see of every effect."""
    problem = fit.problem
    allowed: list[tuple[ChainVariant, Basis]] = []
    refused = []
    for variant in variants:
        try:
            allowed.append((variant, variant.effect.basis(problem.context)))
        except EffectError as error:
            refused.append((variant.family, str(error)))
    candidates = []
    every = columns_of(fit, [basis for _, basis in allowed])
    for (variant, basis), effect_columns in zip(allowed, every, strict=True):
        largest = largest_coefficient(variant.effect, basis, effect_columns.peak, problem.largest_effect)
        candidates.append(
            ChainCandidate(variant, effect_columns.columns.T, effect_columns.share, largest, fit, basis)
        )
    return ChainScene(fit, fit.nuisance.shared, tuple(candidates), tuple(refused))
