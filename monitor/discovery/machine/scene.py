"""A fitted chain as the scan sees it: its residual, and candidates with everything that is free in every run taken out.

The columns of a candidate are the whitened change of the tip-to-target vector that each coefficient of its effect
causes, with the nuisance (base parameters, targets and tip, free in every run) projected out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
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
from monitor.discovery.search.candidate import SMALLEST_SHARE, Candidate, Variant
from monitor.discovery.search.held_out import held_out_rms
from monitor.discovery.search.remainder import Remainders
from monitor.effects import ParsedEffect
from monitor.exceptions import EffectError
from monitor.methods.chain.shared_effects import largest_coefficient
from monitor.records import Array

# A unit of a coefficient (1 mm, 1 rad) that moves the tip by less than this, in mm, is a sine of 180 degrees.
ROUNDING = 1e-9
# An effect is found for certain where its visible part is this many standard deviations long: the 1 % level
# over some 300 candidates lies at 4.2.
DETECTABLE = 5.0

MachineEffect: TypeAlias = ParsedEffect
ChainVariant: TypeAlias = Variant[MachineEffect]


@dataclass(frozen=True)
class ChainCandidate(Candidate[MachineEffect]):
    """An effect of a chain as the data see it; ``raw`` (n, d, k) mm is the displacement at every probing for a unit of
    each coefficient, ``largest`` the coefficients that a machine in use is likely to have at most."""

    raw: Array

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
        return np.concatenate([self.shared, *(candidate.columns for candidate in candidates)], axis=1)

    @cached_property
    def remainders(self) -> Remainders:
        """What selected effects, beside ``shared``, leave of the residual."""
        return Remainders(self.residual, self.degrees_of_freedom, self.columns)

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


def scene_of(fit: Fit, variants: Sequence[ChainVariant]) -> ChainScene:
    """The residual of a fit and what the data can see of every effect."""
    problem = fit.problem
    raw: list[Array] = []
    allowed: list[tuple[ChainVariant, float]] = []
    refused = []
    for variant in variants:
        try:
            basis = variant.effect.basis(problem.context)
        except EffectError as error:
            refused.append((variant.family, str(error)))
            continue
        moved = np.ascontiguousarray(np.moveaxis(fit.moved_by(basis), 2, 0))
        moved[np.abs(moved).max(axis=(1, 2), initial=0.0) < ROUNDING] = 0.0
        peak = float(np.sqrt(np.einsum("kna,kna->kn", moved, moved).max(initial=0.0)))
        raw.append(moved)
        allowed.append((variant, largest_coefficient(variant.effect, basis, peak, problem.largest_effect)))
    projected, before = _projected(fit, raw)
    candidates = []
    start = 0
    for moved, (variant, largest) in zip(raw, allowed, strict=True):
        rows = slice(start, start + len(moved))
        start += len(moved)
        columns, share = _significant(projected[rows], before[rows])
        candidates.append(ChainCandidate(variant, columns.T, share, largest, np.moveaxis(moved, 0, 2)))
    return ChainScene(fit, fit.nuisance.shared, tuple(candidates), tuple(refused))


def _projected(fit: Fit, raw: Sequence[Array]) -> tuple[Array, Array]:
    """Whitened columns (K, M) of all effects less what every run's own unknowns can do, and their lengths (K,)
    before. One contiguous row a coefficient: the rows are read effect by effect."""
    problem = fit.problem
    runs, rows = fit.solution.last.residual.shape
    count = sum(len(moved) for moved in raw)
    # Calibrated quantities follow the probings of a run and do not depend on the effects.
    weights = 1.0 / problem.sigma
    sources = problem.padded(np.arange(float(weights.size)).reshape(weights.shape) + 1.0).astype(np.int64) - 1
    projected = np.zeros((count, runs, rows))
    filled = sources >= 0
    # Probings of one run after another, all runs of the same length: the usual file needs no reordering.
    straight = np.array_equal(sources.reshape(-1), np.arange(weights.size))
    start = 0
    # Effect by effect: all columns once more beside ``projected`` would be fetched from the system page by page.
    for moved in raw:
        white = (moved * weights).reshape(len(moved), -1)
        target = projected[start : start + len(moved), :, : sources.shape[1]]
        start += len(moved)
        if straight:
            target[...] = white.reshape(len(moved), *sources.shape)
        else:
            target[...] = np.where(filled, white[:, np.where(filled, sources, 0)], 0.0)
    if fit.whitening is not None:
        projected = fit.whitening(projected)
    before = np.sqrt(np.einsum("krn,krn->k", projected, projected))
    for run, basis in enumerate(fit.nuisance.basis):
        part = projected[:, run]
        part -= (part @ basis) @ basis.T
    return projected.reshape(count, runs * rows), before


def _significant(projected: Array, before: Array) -> tuple[Array, float]:
    """Rows (k, M) without the directions of which nothing remains, and the largest share that remains."""
    scale = np.where(before == 0, 1.0, before)
    if len(projected) == 1:
        share = float(np.sqrt(projected[0] @ projected[0])) / float(scale[0])
        return (projected if share > SMALLEST_SHARE else np.zeros_like(projected)), share
    scaled = projected / scale[:, None]
    values, vectors = np.linalg.eigh(scaled @ scaled.T)
    share = float(np.sqrt(max(values.max(initial=0.0), 0.0)))
    if values.min(initial=1.0) > SMALLEST_SHARE**2:
        return projected, share
    keep = vectors[:, values > SMALLEST_SHARE**2]
    cleaned: Array = (keep @ keep.T) @ scaled
    # A coefficient of which nothing remains (a ball touched once) must not come back as rounding at full length.
    cleaned[np.sqrt(np.sum(cleaned**2, axis=1)) <= SMALLEST_SHARE] = 0.0
    return cleaned * scale[:, None], share
