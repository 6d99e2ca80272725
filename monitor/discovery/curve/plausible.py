"""Whether an effect of a fitted curve can be a finding: its value determined, its size not cancelled by others."""

from __future__ import annotations

import numpy as np

from monitor.discovery.search.plausible import is_determined, nearly_cancelled
from monitor.discovery.search.projection import orthonormal_to_full_precision, without
from monitor.effects.curve import PLACED, CurveEffect, coefficient_names
from monitor.methods.curve.fit import CurveFit
from monitor.records import Array


def is_plausible(fitted: CurveFit, index: int) -> bool:
    """Return whether the effect at an index of a fit's ``effects`` can be a finding."""
    effect = fitted.effects[index]
    # A place lies between two values of the input and has no uncertainty.
    searched = effect.free and effect.shape not in PLACED
    if searched and not is_determined(float(effect.value or 0.0), fitted.u_values[index]):
        return False
    names = coefficient_names(effect, fitted.problem.inputs)
    of_effect = np.array([name in names for name in fitted.names])
    size = fitted.estimate[of_effect]
    if not np.isfinite(size).all():
        return True
    rows = fitted.problem.order
    design = fitted.design[rows]
    share = design[:, : len(of_effect)][:, of_effect] @ size
    # What the others leave of it is what the fit would lose without it; its value has no part in that.
    others = np.concatenate([~of_effect, _slopes_of_others(fitted, index)])
    lost = without(orthonormal_to_full_precision(design[:, others]), share[:, None])
    peak = float(np.abs(without(_lower(fitted, effect), share[:, None])).max())
    return not nearly_cancelled(peak, float(np.sum(lost**2)), len(rows))


def _slopes_of_others(fitted: CurveFit, index: int) -> np.ndarray:
    """Which columns behind those of the coefficients belong to the searched values of other effects."""
    searched = [at for at, effect in enumerate(fitted.effects) if effect.free and effect.shape not in PLACED]
    return np.array([at != index for at in searched], dtype=np.bool_)


def _lower(fitted: CurveFit, effect: CurveEffect) -> Array:
    """A basis (m, r) of the constant, and of the lower powers of a power, which say nothing of its size."""
    rows = fitted.problem.order
    if not effect.order:
        return np.full((len(rows), 1), 1.0 / np.sqrt(len(rows)))
    x = fitted.problem.inputs.numbers[effect.column][rows]
    scaled = (x - x.mean()) / max(float(np.ptp(x)), 1e-300)
    return orthonormal_to_full_precision(scaled[:, None] ** np.arange(effect.order))
