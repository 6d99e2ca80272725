"""What a plan shows of an effect of a given size: whether a rehearsal that hides it can be found out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from monitor.discovery import fit
from monitor.discovery.machine.scene import DETECTABLE, scene_of
from monitor.discovery.machine.sizes import peak_of
from monitor.discovery.search.candidate import Variant
from monitor.documents import OMITTED
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.shapes import Poly
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.reporting import rehearsal_words
from monitor.units import MICROMETRE

#: So few standard deviations are rounding.
NOTHING = 1e-6
#: Peaks that differ by less are one.
ALIKE = 0.9


@dataclass(frozen=True)
class EffectSight:
    """What the readings of one campaign show of an effect, all that the model leaves free taken out.

    ``standard_deviations`` is its length in those of the readings; 0 for a blind spot, which the other errors of the
    model take up whole. ``certain_from_um`` is the largest displacement from which a search sees that something is
    missing; to name it among effects that are much alike may take more. None for a blind spot. ``told_um`` is the
    peak that a search tells of a power of a position, beyond the constant and the straight line that the model takes
    up; None of other effects.
    """

    standard_deviations: float
    certain_from_um: float | None
    told_um: float | None = field(default=None, metadata=OMITTED)

    @property
    def is_certain(self) -> bool:
        """Whether a search finds an effect of this size for certain."""
        return self.standard_deviations > DETECTABLE

    def words(self, effect: str, peak_um: float) -> str:
        """What is said of an ``effect`` that is hidden with a peak."""
        if not self.is_certain:
            return rehearsal_words.hardly_seen(effect, self.standard_deviations, self.certain_from_um)
        if self.told_um is not None and self.told_um < ALIKE * peak_um:
            return rehearsal_words.told_smaller(effect, self.told_um)
        return ""


def effect_sight(problem: ChainProblem, text: str, peak: float) -> EffectSight:
    """Return what the plan of a problem shows of an effect that moves a row by at most ``peak`` (mm).

    All coefficients of the effect are alike. Noise is taken as white, with the stated uncertainties. Raises EffectError
    for an effect that the machine does not have.
    """
    effect = parse_effect(text, problem.context.chain)
    scene = scene_of(fit(problem), [Variant(text, effect)])
    if not scene.candidates or not scene.candidates[0].visible:
        return EffectSight(0.0, None)
    candidate = scene.candidates[0]
    # As large as the rehearsal makes it: the largest displacement of a row is the peak.
    largest = float(np.linalg.norm(candidate.raw.sum(axis=2), axis=1).max())
    remaining = _beside(scene.shared, candidate.columns.sum(axis=1)) / largest
    shown = peak * float(np.linalg.norm(remaining))
    if shown < NOTHING:
        return EffectSight(0.0, None)
    told_um = None
    if isinstance(effect, ChainEffect) and isinstance(effect.shape, Poly):
        of_one = peak_of(scene, candidate, candidate.raw, np.ones(candidate.raw.shape[2]))
        told_um = peak * of_one / largest / MICROMETRE.factor
    return EffectSight(shown, peak * DETECTABLE / shown / MICROMETRE.factor, told_um)


def _beside(shared: Array, column: Array) -> Array:
    """What is left of a column (M,) beside those (M, c) of the coefficients that the runs share."""
    if not shared.shape[1]:
        return column
    return np.asarray(column - shared @ np.linalg.lstsq(shared, column, rcond=None)[0])
