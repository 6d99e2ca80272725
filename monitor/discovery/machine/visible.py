"""What the data can see of an effect: its columns with everything that is free in every run taken out.

A candidate is an effect with the whitened change of the tip-to-target vector that each of its coefficients
causes, with the nuisance (base parameters, targets and tip, free in every run) projected out. What is left of
it is all that the evidence rests on; where nothing is left, the plan is blind for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.fit import Fit
from monitor.effects import ArtefactEffect, ChainEffect
from monitor.exceptions import EffectError
from monitor.methods.chain.least_squares import COMMON_RANK_TOLERANCE
from monitor.methods.chain.shared_effects import largest_coefficient
from monitor.records import Array

# Directions of an effect of which less than this part is left hold rounding and products of small errors; a fit
# leaves them out too.
SMALLEST_SHARE = COMMON_RANK_TOLERANCE
# A unit of a coefficient (1 mm, 1 rad) that moves the tip by less than this, in mm, is a sine of 180 degrees.
ROUNDING = 1e-9
# An effect is found for certain where its visible part is this many standard deviations long: the 1 % level
# over some 300 candidates lies at 4.2.
DETECTABLE = 5.0


@dataclass(frozen=True)
class Variant:
    """An effect to be looked at. ``family`` is how it is written; ``tries`` variants of it are searched; ``odds`` are
    those against it beforehand, where a simpler effect would do."""

    family: str
    effect: ChainEffect | ArtefactEffect
    tries: int = 1
    odds: float = 1.0


@dataclass(frozen=True)
class Candidate:
    """An effect as the data see it.

    ``columns`` (M, k) whitened and projected, M rows of all runs; ``raw`` (n, d, k) mm the displacement at
    every probing for a unit of each coefficient; ``share`` the part that projection leaves; ``largest`` the
    coefficients that a machine in use is likely to have at most, in internal units.
    """

    variant: Variant
    columns: Array
    raw: Array
    share: float
    largest: float

    @property
    def family(self) -> str:
        """How the effect is written."""
        return self.variant.family

    @cached_property
    def detectable(self) -> bool:
        """Whether an effect as large as a machine in use may hide would be found with this plan."""
        longest = float(np.sqrt(np.einsum("mk,mk->k", self.columns, self.columns).max(initial=0.0)))
        return self.share > SMALLEST_SHARE and longest * self.largest > DETECTABLE


@dataclass(frozen=True)
class Visible:
    """The residual (M,) of a fit and the candidates.

    ``added`` (M, c) are the projected columns of the effects that the model has already and all runs share, ``run``
    (M,) the run's place of every row; ``degrees_of_freedom`` are those that the runs' own unknowns leave, before
    ``added`` takes its part; ``refused`` names effects that the recorded columns do not allow, and why.
    """

    residual: Array
    added: Array
    run: npt.NDArray[np.int64]
    degrees_of_freedom: int
    candidates: tuple[Candidate, ...]
    refused: tuple[tuple[str, str], ...]


def see(fit: Fit, variants: Sequence[Variant]) -> Visible:
    """What the data of a fit can see of every effect."""
    problem, last = fit.problem, fit.solution.last
    kept: list[tuple[Variant, Array, float]] = []
    refused = []
    for variant in variants:
        try:
            basis = variant.effect.basis(problem.context)
        except EffectError as error:
            refused.append((variant.family, str(error)))
            continue
        raw = np.ascontiguousarray(np.moveaxis(fit.moved_by(basis), 2, 0))
        raw[np.abs(raw).max(axis=(1, 2), initial=0.0) < ROUNDING] = 0.0
        peak = float(np.sqrt(np.einsum("kna,kna->kn", raw, raw).max(initial=0.0)))
        kept.append((variant, raw, largest_coefficient(variant.effect, basis, peak, problem.largest_effect)))
    own = fit.own
    left, before = _projected(fit, [raw for _, raw, _ in kept], own.basis)
    candidates = []
    place = 0
    for variant, raw, largest in kept:
        rows = slice(place, place + len(raw))
        place += len(raw)
        columns, share = _significant(left[rows], before[rows])
        candidates.append(Candidate(variant, columns.T, np.moveaxis(raw, 0, 2), share, largest))
    return Visible(
        residual=last.residual.reshape(-1),
        added=own.shared,
        run=np.repeat(np.arange(len(last.residual)), last.residual.shape[1]),
        degrees_of_freedom=fit.degrees_of_freedom + own.shared_rank,
        candidates=tuple(candidates),
        refused=tuple(refused),
    )


def _projected(fit: Fit, raw: Sequence[Array], basis_of_runs: Array) -> tuple[Array, Array]:
    """Whitened columns (K, M) of all effects less what every run's own unknowns can do, and their lengths (K,)
    before. One contiguous row a coefficient: the rows are read effect by effect."""
    problem = fit.problem
    runs, rows = fit.solution.last.residual.shape
    count = sum(len(one) for one in raw)
    # Calibrated quantities follow the probings of a run and do not depend on the effects.
    weights = 1.0 / problem.sigma
    places = problem.padded(np.arange(float(weights.size)).reshape(weights.shape) + 1.0).astype(np.int64) - 1
    left = np.zeros((count, runs, rows))
    filled = places >= 0
    # Probings of one run after another, all runs of the same length: the usual file needs no reordering.
    straight = np.array_equal(places.reshape(-1), np.arange(weights.size))
    place = 0
    # Effect by effect: all columns once more beside ``left`` would be fetched from the system page by page.
    for one in raw:
        white = (one * weights).reshape(len(one), -1)
        into = left[place : place + len(one), :, : places.shape[1]]
        place += len(one)
        if straight:
            into[...] = white.reshape(len(one), *places.shape)
        else:
            into[...] = np.where(filled, white[:, np.where(filled, places, 0)], 0.0)
    before = np.sqrt(np.einsum("krn,krn->k", left, left))
    for run, basis in enumerate(basis_of_runs):
        part = left[:, run]
        part -= (part @ basis) @ basis.T
    return left.reshape(count, runs * rows), before


def _significant(left: Array, before: Array) -> tuple[Array, float]:
    """Rows (k, M) without the directions of which nothing is left, and the largest share that is left."""
    scale = np.where(before == 0, 1.0, before)
    if len(left) == 1:
        share = float(np.sqrt(left[0] @ left[0])) / float(scale[0])
        return (left if share > SMALLEST_SHARE else np.zeros_like(left)), share
    scaled = left / scale[:, None]
    values, vectors = np.linalg.eigh(scaled @ scaled.T)
    share = float(np.sqrt(max(values.max(initial=0.0), 0.0)))
    if values.min(initial=1.0) > SMALLEST_SHARE**2:
        return left, share
    keep = vectors[:, values > SMALLEST_SHARE**2]
    cleaned: Array = (keep @ keep.T) @ scaled
    # A coefficient of which nothing is left (a ball touched once) must not come back as rounding at full length.
    cleaned[np.sqrt(np.sum(cleaned**2, axis=1)) <= SMALLEST_SHARE] = 0.0
    return cleaned * scale[:, None], share
