"""What a plan shows of an effect of a given size: whether a rehearsal that hides it can be found out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.discovery import fit
from monitor.discovery.machine.scene import DETECTABLE, scene_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.units import MICROMETRE


@dataclass(frozen=True)
class EffectSight:
    """What the readings of one campaign show of an effect, all that the model leaves free taken out.

    ``standard_deviations`` is its length in those of the readings; 0 for a blind spot, which the other errors of the
    model take up whole. ``certain_from_um`` is the largest displacement from which a search sees that something is
    missing; to name it among effects that are much alike may take more. None for a blind spot.
    """

    standard_deviations: float
    certain_from_um: float | None

    @property
    def is_certain(self) -> bool:
        """Whether a search finds an effect of this size for certain."""
        return self.standard_deviations > DETECTABLE


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
    if shown == 0.0:
        return EffectSight(0.0, None)
    return EffectSight(shown, peak * DETECTABLE / shown / MICROMETRE.factor)


def _beside(shared: Array, column: Array) -> Array:
    """What is left of a column (M,) beside those (M, c) of the coefficients that the runs share."""
    if not shared.shape[1]:
        return column
    return np.asarray(column - shared @ np.linalg.lstsq(shared, column, rcond=None)[0])
