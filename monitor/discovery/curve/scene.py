"""A fitted curve as the scan sees it: whitened rows, and effects as columns with the model taken out.

A polynomial is the part of its power that the lower ones cannot do (orthogonal over the measured rows), so that
neither origin nor unit of the input matters and a line is not taken for a parabola.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from monitor.discovery.machine.evidence import without
from monitor.discovery.machine.visible import SMALLEST_SHARE, Candidate, Variant
from monitor.effects import ChainEffect
from monitor.effects.curve import CurveEffect, curve_columns
from monitor.methods.curve.fit import CurveFit
from monitor.records import Array
from monitor.statistics.noise import Noise


@dataclass(frozen=True)
class CurveVariant(Variant):
    """A variant of an effect of a curve. The scan itself reads family, tries and odds only."""

    @property
    def curve(self) -> CurveEffect:
        """The effect."""
        return cast(CurveEffect, self.effect)


def variant(effect: CurveEffect, tries: int = 1, family: str | None = None) -> CurveVariant:
    """An effect as the scan takes it."""
    return CurveVariant(family or effect.family, cast(ChainEffect, effect), tries)


def effect_of(candidate: Candidate) -> CurveEffect:
    """The effect of a candidate of a curve."""
    assert isinstance(candidate.variant, CurveVariant)
    return candidate.variant.curve


@dataclass(frozen=True)
class Scene:
    """A fitted curve as the scan sees it: rows with weight in the order of time, whitened by ``noise``.

    ``design`` (m, c) are the whitened columns of the model and ``basis`` spans them; ``measured`` (m,) is the
    whitened response.
    """

    fit: CurveFit
    noise: Noise
    measured: Array
    design: Array
    basis: Array

    def whitened(self, columns: Array) -> Array:
        """Columns (n, k) of all rows as the scan sees them, the model not yet taken out."""
        return self.noise.whiten(columns[self.fit.problem.order])[0]

    def candidate(self, effect: CurveEffect, tries: int = 1, family: str | None = None) -> Candidate:
        """One candidate, the model taken out of its columns."""
        return self.candidates([effect], [tries], [family])[0]

    def candidates(
        self,
        effects: Sequence[CurveEffect],
        tries: Sequence[int],
        families: Sequence[str | None] | None = None,
    ) -> list[Candidate]:
        """Several candidates at once, the model taken out of their columns."""
        raw = [self.columns(effect) for effect in effects]
        if not raw:
            return []
        white = self.whitened(np.concatenate(raw, axis=1))
        left = without(self.basis, white)
        before, after = np.linalg.norm(white, axis=0), np.linalg.norm(left, axis=0)
        share = after / np.where(before == 0, 1.0, before)
        left[:, share <= SMALLEST_SHARE] = 0.0
        made, place = [], 0
        for number, effect in enumerate(effects):
            own = slice(place, place + raw[number].shape[1])
            place = own.stop
            family = None if families is None else families[number]
            made.append(
                Candidate(
                    variant(effect, tries[number], family),
                    left[:, own],
                    np.zeros((0, 3, own.stop - own.start)),
                    float(share[own].max(initial=0.0)),
                    np.inf,
                )
            )
        return made

    def columns(self, effect: CurveEffect, value: float | None = None) -> Array:
        """Columns (n, k) of an effect; of a polynomial the part that the lower powers cannot do."""
        if not effect.order:
            return curve_columns(effect, self.fit.problem.inputs, value)
        x = self.fit.problem.inputs.numbers[effect.column]
        kept = x[self.fit.problem.order]
        middle, half = (kept.max() + kept.min()) / 2.0, (kept.max() - kept.min()) / 2.0 or 1.0
        powers = ((x - middle) / half)[:, None] ** np.arange(effect.order + 1)
        lower, own = powers[:, :-1], powers[:, -1:]
        rows = self.fit.problem.order
        return np.asarray(own - lower @ np.linalg.lstsq(lower[rows], own[rows], rcond=1e-12)[0])


def scene_of(fit: CurveFit, noise: Noise) -> Scene:
    """A fit as the scan sees it."""
    rows = fit.problem.order
    white = noise.whiten(np.column_stack([fit.problem.curve.measured, fit.design])[rows])[0]
    return Scene(fit, noise, white[:, 0], white[:, 1:], orthonormal_to_full_precision(white[:, 1:]))


def orthonormal_to_full_precision(columns: Array) -> Array:
    """An orthonormal basis (m, r) of columns, to full precision: calendar years to the third power."""
    scale = np.linalg.norm(columns, axis=0)
    u, values, _ = np.linalg.svd(columns / np.where(scale == 0, 1.0, scale), full_matrices=False)
    return np.asarray(u[:, values > 1e-12 * max(values.max(initial=0.0), 1e-300)])
