"""The uncertainty by lack of fit: a systematic deviation is no noise, and pulls parameters where noise would not.

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
from monitor.discovery.machine.scene import ChainCandidate, ChainVariant, scene_of
from monitor.methods.chain.least_squares import eliminate, project_out
from monitor.records import Array

# Lack of fit is an uncertainty from a p-value on at which it is hardly chance; called missing it is much later.
LEVEL = 0.05
# Effects less probable than this by their evidence change nothing that is printed.
LEAST_PROBABLE = 1e-6


@dataclass(frozen=True)
class ModelUncertainty:
    """Covariance (p + c, p + c) by lack of fit of a run's unknowns and of the common ones, whitened units; ``dof`` its
    degrees of freedom.

    ``effects`` are the most probable causes with their probabilities, the first ones first.
    """

    covariance: Array
    dof: float
    effects: tuple[tuple[str, float], ...]


def model_uncertainty(
    fit: Fit, run: int, variants: Sequence[ChainVariant], covered: float = 0.0
) -> ModelUncertainty | None:
    """Evaluate what lack of fit adds to the covariance of the unknowns of a run, counted from 0; None where there is
    none.

    ``variants`` are the effects that may have caused it. ``covered`` is the variance of a reading, over the stated one,
    that the covariance of the readings has already: what no effect explains counts from there.
    """
    lack = _lack(fit)
    if lack is None:
        return None
    scene = scene_of(fit, variants)
    unknowns = _unknowns_of(fit, run)
    pulls = [
        pull
        for candidate in scene.candidates
        if candidate.detectable and (pull := _pull(fit, unknowns, candidate, scene.residual)) is not None
    ]
    local = unknowns.covariance(fit.solution.local_covariance[run])
    if not pulls:
        added = max(0.0, lack.squares / lack.degrees_of_freedom - max(lack.pure, covered)) / lack.runs
        return ModelUncertainty(added * local, lack.degrees_of_freedom, ())
    explained = [min(pull.explained, 0.999 * lack.squares) for pull in pulls]
    sizes = np.array([pull.size for pull in pulls])
    weights = _probabilities(np.array(explained), sizes, lack)
    # What remains, as noise of one run: its expectation without lack of fit is one pure error a degree of freedom.
    unexplained = (lack.squares - float(weights @ explained)) / lack.degrees_of_freedom
    remainder = max(0.0, unexplained - max(lack.pure, covered)) / lack.runs
    shifts = np.array([pull.shift for pull in pulls])
    spread = np.einsum("e,ei,ej->ij", weights, shifts, shifts)
    order = [int(i) for i in np.argsort(-weights, kind="stable") if weights[i] > LEAST_PROBABLE]
    effects = tuple((pulls[i].effect, float(weights[i])) for i in order)
    return ModelUncertainty(spread + remainder * local, lack.degrees_of_freedom, effects)


@dataclass(frozen=True)
class _Lack:
    """Sum of ``squares`` of lack of fit, its degrees of freedom, the mean square of noise, and how many runs share
    it."""

    squares: float
    degrees_of_freedom: float
    pure: float
    runs: int


@dataclass(frozen=True)
class _Pull:
    """An effect with ``size`` coefficients at its best size: how it moves the unknowns of a run and the common ones
    (p + c,), and the sum of squares that it explains."""

    effect: str
    size: int
    shift: Array
    explained: float


def _lack(fit: Fit) -> _Lack | None:
    """Lack of fit where it is significant.

    Without repeated runs the probe's stated uncertainty is the only yardstick: all of the residual counts then.
    """
    test, _ = lack_of_fit(fit)
    if test is not None:
        if test.f <= 1.0 or test.p_value > LEVEL:
            return None
        pure = fit.sum_of_squares / (test.f * test.degrees_of_freedom + test.pure_error_degrees_of_freedom)
        squares = pure * test.f * test.degrees_of_freedom
        return _Lack(squares, test.degrees_of_freedom, pure, len(fit.problem.runs))
    freedom = fit.degrees_of_freedom
    if fit.scale <= 1.0 or float(scipy.special.chdtrc(freedom, fit.sum_of_squares)) > LEVEL:
        return None
    return _Lack(fit.sum_of_squares, float(freedom), 1.0, 1)


def _probabilities(explained: Array, sizes: Array, lack: _Lack) -> Array:
    """Posterior probabilities (e,) for residuals of unknown variance, from BIC."""
    freedom = lack.degrees_of_freedom
    score = -0.5 * freedom * np.log1p(-explained / lack.squares) - 0.5 * sizes * np.log(freedom)
    weights = np.exp(score - score.max())
    return np.asarray(weights / weights.sum())


def _pull(fit: Fit, unknowns: _Unknowns, candidate: ChainCandidate, residual: Array) -> _Pull | None:
    """The pull of an effect at its best size on the unknowns of a run; None where it has no size."""
    scale = np.linalg.norm(candidate.columns, axis=0)
    if not np.all(scale > 0.0):
        return None
    size, _, rank, _ = np.linalg.lstsq(candidate.columns / scale, residual, rcond=1e-6)
    if rank < len(scale):
        return None
    size = size / scale
    explained = float(np.sum((candidate.columns @ size) ** 2))
    problem = fit.problem
    rows = problem.padded(candidate.raw / problem.sigma[..., None]) @ size
    return _Pull(candidate.family, len(scale), unknowns.moved_by(rows), explained)


@dataclass(frozen=True)
class _Unknowns:
    """What the unknowns of a run and the common ones do to whitened numbers, linearised at a solution.

    ``basis`` (N, p) and ``inverse`` (p, p) of the run alone as ``eliminate`` has them, ``common`` (N, c) its
    derivatives by the common unknowns; ``remainder`` (R, N, c): what all runs' own unknowns leave of these.
    """

    run: int
    basis: Array
    inverse: Array
    common: Array
    remainder: Array
    common_covariance: Array

    def moved_by(self, rows: Array) -> Array:
        """How a displacement of all runs' numbers (R, n) moves the unknowns of the run and the common ones (p + c,)."""
        length = rows.shape[1]
        # What the common unknowns take of it, the run's own do not.
        of_common = self.common_covariance @ np.einsum("rmc,rm->c", self.remainder[:, :length], rows)
        rest = rows[self.run] - self.common[:length] @ of_common
        return np.concatenate([self.inverse @ (self.basis[:length].T @ rest), of_common])

    def covariance(self, local: Array) -> Array:
        """Their covariance (p + c, p + c) for residuals of unit variance, from that (p, p) of the run's."""
        response = -(self.inverse @ (self.basis.T @ self.common))
        beside = response @ self.common_covariance
        return np.block([[local, beside], [beside.T, self.common_covariance]])


def _unknowns_of(fit: Fit, run: int) -> _Unknowns:
    solution, count = fit.solution, len(fit.solution.common)
    common = solution.last.common[..., :count]
    # Without common unknowns no other run moves those of this one.
    space = eliminate(solution.last.local if count else solution.last.local[[run]])
    place_of_run = run if count else 0
    return _Unknowns(
        run,
        space.basis[place_of_run],
        space.inverse[place_of_run],
        common[run],
        project_out(space.basis, common) if count else common,
        solution.common_covariance[:count, :count],
    )
