"""What lack of fit may do to the parameters: a systematic deviation is no noise, and pulls where noise would not.

A deviation that is the same in every run leaves part of itself in the residual and hides the other part in the
parameters. Taken as more noise of the same size, the hidden part comes out several times too small, because
physical effects are smooth and parameters are smooth too. So every effect of the catalogue that could have left
what is seen is asked what it would do to the parameters at the size that fits best, and the answers are averaged
with the effects' posterior probabilities (equal ones before, each with the penalty of BIC for its coefficients).
No effect is confirmed by this, so nothing is corrected; the squared pull counts as a variance (JCGM 100:2008
F.2.4.5). What the effects leave unexplained counts as one more noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from monitor.discovery.machine.compare import lack_of_fit
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.visible import Candidate, Variant, see
from monitor.methods.chain.least_squares import eliminate
from monitor.records import Array

# Lack of fit is an uncertainty from a p-value on at which it is hardly chance; called missing it is much later.
LEVEL = 0.05
# Effects less probable than this by their evidence change nothing that is printed.
LEAST_PROBABLE = 1e-6


@dataclass(frozen=True)
class ModelUncertainty:
    """Covariance (p, p) of a run's unknowns by lack of fit, whitened units; ``dof`` its degrees of freedom.

    ``effects`` are the most probable causes with their probabilities, the first ones first.
    """

    covariance: Array
    dof: float
    effects: tuple[tuple[str, float], ...]


def model_uncertainty(fit: Fit, place: int, variants: Sequence[Variant]) -> ModelUncertainty | None:
    """What lack of fit adds to the covariance of the unknowns of the run at ``place``; None where there is none.

    ``variants`` are the effects that may have caused it.
    """
    found_lack = _lack(fit)
    if found_lack is None:
        return None
    lack, freedom, pure, runs = found_lack
    seen = see(fit, variants)
    pulls, explained, sizes, names = [], [], [], []
    for one in seen.candidates:
        if not one.detectable:
            continue
        found = _pull(fit, place, one, seen.residual)
        if found is None:
            continue
        pulls.append(found[0])
        explained.append(min(found[1], 0.999 * lack))
        sizes.append(one.columns.shape[1])
        names.append(one.family)
    local = fit.solution.local_covariance[place]
    if not pulls:
        return ModelUncertainty((lack / freedom - pure) / runs * local, freedom, ())
    weights = _probabilities(np.array(explained), np.array(sizes), lack, freedom)
    # What is left, as noise of one run: its expectation without lack of fit is one pure error a degree of freedom.
    left = max(0.0, (lack - float(weights @ explained)) / freedom - pure) / runs
    spread = np.einsum("e,ei,ej->ij", weights, np.array(pulls), np.array(pulls))
    order = [int(i) for i in np.argsort(-weights, kind="stable") if weights[i] > LEAST_PROBABLE]
    return ModelUncertainty(
        spread + left * local, freedom, tuple((names[i], float(weights[i])) for i in order)
    )


def _lack(fit: Fit) -> tuple[float, float, float, int] | None:
    """Sum of squares of lack of fit, its degrees of freedom, the mean square of noise, and how many runs share it.

    Without repeated runs the probe's stated uncertainty is the only yardstick: all of the residual counts then.
    """
    test, _ = lack_of_fit(fit)
    if test is not None:
        if test.f <= 1.0 or test.p_value > LEVEL:
            return None
        pure = fit.sum_of_squares / (test.f * test.degrees_of_freedom + test.pure_error_degrees_of_freedom)
        return pure * test.f * test.degrees_of_freedom, test.degrees_of_freedom, pure, len(fit.problem.runs)
    freedom = fit.degrees_of_freedom
    if fit.scale <= 1.0 or float(scipy.special.chdtrc(freedom, fit.sum_of_squares)) > LEVEL:
        return None
    return fit.sum_of_squares, float(freedom), 1.0, 1


def _probabilities(explained: Array, sizes: Array, lack: float, freedom: float) -> Array:
    """Posterior probabilities (e,) for residuals of unknown variance, from BIC."""
    score = -0.5 * freedom * np.log1p(-explained / lack) - 0.5 * sizes * np.log(freedom)
    weights = np.exp(score - score.max())
    return np.asarray(weights / weights.sum())


def _pull(fit: Fit, place: int, one: Candidate, residual: Array) -> tuple[Array, float] | None:
    """How the effect at its best size moves the unknowns of a run (p,), and the sum of squares that it explains."""
    scale = np.linalg.norm(one.columns, axis=0)
    if not np.all(scale > 0.0):
        return None
    size, _, rank, _ = np.linalg.lstsq(one.columns / scale, residual, rcond=1e-6)
    if rank < len(scale):
        return None
    size = size / scale
    explained = float(np.sum((one.columns @ size) ** 2))
    problem = fit.problem
    rows = problem.padded(one.raw / problem.sigma[..., None])[place] @ size
    space = eliminate(fit.solution.last.local[[place]])
    basis = space.basis[0][: len(rows)]
    return space.inverse[0] @ (basis.T @ rows), explained
