"""A fitted curve as the scan sees it: whitened rows, and effects as columns with the model taken out.

A polynomial is the part of its power that the lower ones cannot do (orthogonal over the measured rows), so that
neither origin nor unit of the input matters and a line is not mistaken for a parabola.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from monitor.discovery.search.candidate import SMALLEST_SHARE, Candidate, Variant, side_by_side
from monitor.discovery.search.held_out import folds_of, held_out_rms
from monitor.discovery.search.projection import orthonormal_to_full_precision, without
from monitor.discovery.search.remainder import Remainders
from monitor.effects.curve import CurveEffect, curve_columns
from monitor.methods.curve.fit import CurveFit
from monitor.methods.curve.problem import CurveProblem
from monitor.records import Array
from monitor.statistics.noise import Noise

CurveCandidate: TypeAlias = Candidate[CurveEffect]


def variant_of(effect: CurveEffect, tries: int = 1) -> Variant[CurveEffect]:
    """An effect as the scan looks at it."""
    return Variant(effect.family, effect, tries)


@dataclass(frozen=True)
class WhitenedCurve:
    """A fitted curve: rows with weight in the order of time, whitened by ``noise``.

    ``basis`` (m, r) spans the whitened columns of the model; ``measured`` (m,) is the whitened response.
    """

    fit: CurveFit
    noise: Noise
    measured: Array
    basis: Array

    @property
    def problem(self) -> CurveProblem:
        """The problem that was fitted."""
        return self.fit.problem

    def whitened(self, columns: Array) -> Array:
        """Whiten columns (n, k) of all rows; the model is not yet taken out."""
        return self.noise.whiten(columns[self.problem.order])[0]

    def candidates(self, variants: Sequence[Variant[CurveEffect]]) -> list[CurveCandidate]:
        """Take the model out of the columns of effects."""
        raw = [self.columns(variant.effect) for variant in variants]
        if not raw:
            return []
        white = self.whitened(np.concatenate(raw, axis=1))
        remainder = without(self.basis, white)
        before, after = np.linalg.norm(white, axis=0), np.linalg.norm(remainder, axis=0)
        share = after / np.where(before == 0, 1.0, before)
        remainder[:, share <= SMALLEST_SHARE] = 0.0
        ends = np.cumsum([columns.shape[1] for columns in raw])
        parts = [slice(end - columns.shape[1], end) for columns, end in zip(raw, ends, strict=True)]
        return [
            Candidate(variant, remainder[:, part], float(share[part].max(initial=0.0)), np.inf)
            for variant, part in zip(variants, parts, strict=True)
        ]

    def candidate(self, variant: Variant[CurveEffect]) -> CurveCandidate:
        """Take the model out of the columns of one effect."""
        return self.candidates([variant])[0]

    def columns(self, effect: CurveEffect) -> Array:
        """Columns (n, k) of an effect; of a polynomial the part that the lower powers cannot do."""
        if not effect.order:
            return curve_columns(effect, self.problem.inputs)
        rows = self.problem.order
        x = self.problem.inputs.numbers[effect.column]
        low, high = x[rows].min(), x[rows].max()
        middle, half = (high + low) / 2.0, (high - low) / 2.0 or 1.0
        powers = ((x - middle) / half)[:, None] ** np.arange(effect.order + 1)
        lower, highest = powers[:, :-1], powers[:, -1:]
        return np.asarray(highest - lower @ np.linalg.lstsq(lower[rows], highest[rows], rcond=1e-12)[0])


@dataclass(frozen=True)
class CurveScene:
    """The residual (m,) of a whitened curve and the effects that may explain it."""

    curve: WhitenedCurve
    residual: Array
    candidates: tuple[CurveCandidate, ...]
    refused: tuple[tuple[str, str], ...]

    @property
    def degrees_of_freedom(self) -> int:
        """Those of the residual."""
        return len(self.residual) - int(self.curve.basis.shape[1])

    def columns(self, candidates: Sequence[Candidate[object]]) -> Array:
        """The columns (m, c) of candidates; those of the model are taken out of everything."""
        return side_by_side(len(self.residual), candidates)

    @cached_property
    def remainders(self) -> Remainders:
        """What selected effects leave of the residual."""
        return Remainders(self.residual, self.degrees_of_freedom, self.columns)

    @property
    def held_out_errors(self) -> tuple[Callable[[Array], float | None], ...]:
        """Root mean square error on folds of rows left out in turn."""
        return (self._held_out_error,)

    def _held_out_error(self, columns: Array) -> float | None:
        return held_out_rms(
            self.residual, columns, folds_of(len(self.residual)), self.degrees_of_freedom, 1.0
        )


def whitened_curve(fit: CurveFit, noise: Noise) -> WhitenedCurve:
    """Whiten a fitted curve by a noise."""
    rows = fit.problem.order
    white = noise.whiten(np.column_stack([fit.problem.curve.measured, fit.design])[rows])[0]
    return WhitenedCurve(fit, noise, white[:, 0], orthonormal_to_full_precision(white[:, 1:]))
