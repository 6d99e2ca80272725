"""An error that stepped once within a run: a mirror that slipped, a clamp that gave way, an encoder that lost its zero.

No effect of the catalogue is such a step: a drift takes its place by half, and what that leaves looks like noise that
neighbours share. So where nothing is named every moment of every run is tried for each error that may drift. A step has
to say more at its price than any effect, and it has to stand out of the noise of neighbours that it leaves itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.scene_columns import columns_of
from monitor.discovery.search.evidence import Evidence
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.rivals import UNDECIDED
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always, RunTime
from monitor.effects.effect import ChainBasis
from monitor.records import Array

# Readings before and after: fewer are bad points.
READINGS_EACH_SIDE = 8
# So many moments of a run are tried, then all those between the neighbours of the best one.
MOMENTS = 40


@dataclass(frozen=True)
class SteppedWithin:
    """The error that stepped in a ``run`` from the reading ``sequence`` on, the likeliest of ``errors`` that these data
    do not tell apart, and the root mean square in mm that the step would leave."""

    errors: tuple[str, ...]
    run: int
    sequence: int
    rms_after: float


@dataclass(frozen=True)
class _Step:
    """A step of the error of a drift from a reading on, and the sum of squares that it explains."""

    drift: ChainEffect
    run: int
    sequence: int
    explained: float

    @property
    def error(self) -> ChainEffect:
        """What stepped."""
        return _steady(self.drift)

    def basis(self, fit: Fit) -> ChainBasis:
        """What it does at every probing, for a unit."""
        return _basis(fit, self.drift, self.run, self.sequence)


def stepped_within(scene: ChainScene, best: Evidence[ChainCandidate], rate: float) -> SteppedWithin | None:
    """The step within a run that says most in what the model leaves, in a ``scene`` of independent noise; None where
    ``best``, the effect that says most, says as much, or where it does not stand out at a ``rate`` of the noise of
    neighbours that it leaves."""
    fit = scene.fit
    if poses_of_rows(fit) is not None:
        return None
    drifts = [each.effect for each in scene.candidates if each.visible and _drifts(each.effect)]
    steps, tries = _steps(scene, [effect for effect in drifts if isinstance(effect, ChainEffect)])
    if not steps:
        return None
    first = max(steps, key=lambda step: step.explained)
    beside = scene.remainders.beside(())
    total, freedom = float(beside.residual @ beside.residual), beside.degrees_of_freedom
    if freedom < 2 or first.explained >= total:
        return None
    price = np.log(freedom) + 2.0 * np.log(tries)
    if -freedom * np.log1p(-first.explained / total) - price < best.score + UNDECIDED:
        return None
    # Which error it is, and whether it is any, the noise says that it leaves.
    shape, design = fit.solution.last.residual.shape, fit.whole_noise_design
    noisy = fit.with_correlation(design.correlation(_left(scene, first).reshape(shape)))
    in_noise = [(step, *_in_noise(noisy, step)) for step in steps if step.run == first.run]
    first, most, p_value = max(in_noise, key=lambda each: each[1])
    if p_value * tries > rate:
        return None
    # Noise that walks looks stepped at some moment or other: it has to be the less likely of the two.
    walking = fit.with_correlation(design.correlation(beside.residual.reshape(shape)))
    if _deviance(walking) - _deviance(noisy) + most - price < UNDECIDED:
        return None
    likely = sorted((each for each in in_noise if each[1] > most - UNDECIDED), key=lambda each: -each[1])
    return SteppedWithin(
        tuple(step.error.text for step, *_ in likely),
        first.run,
        first.sequence,
        fit.rms_of(_left(scene, first)),
    )


def _left(scene: ChainScene, step: _Step) -> Array:
    """What the model leaves (M,) with a step in it, in independent noise."""
    beside, fit = scene.remainders.beside(()), scene.fit
    column = without(beside.basis, columns_of(fit, [step.basis(fit)])[0].columns.T)
    return np.asarray(without(orthonormal(column), beside.residual[:, None])[:, 0])


def _drifts(effect: object) -> bool:
    """Whether an effect is an error that drifts evenly through every run."""
    return isinstance(effect, ChainEffect) and effect.driver == RunTime()


def _steady(drift: ChainEffect) -> ChainEffect:
    """The error of a drift, the same at all times."""
    return replace(drift, driver=Always(), driver_text="")


def _basis(fit: Fit, drift: ChainEffect, run: int, sequence: int) -> ChainBasis:
    context = fit.problem.context
    constant = _steady(drift).basis(context)
    after = (context.run == run) & (context.sequence >= sequence)
    return ChainBasis(constant.term, constant.columns * after[:, None])


def _steps(scene: ChainScene, drifts: Sequence[ChainEffect]) -> tuple[list[_Step], int]:
    """The best step of every error in every run, and how many steps there are to choose from."""
    context = scene.fit.problem.context
    steps: list[_Step] = []
    tries = 0
    for run in scene.fit.problem.runs:
        moments = np.unique(context.sequence[context.run == run])[READINGS_EACH_SIDE:-READINGS_EACH_SIDE]
        tries += len(moments) * len(drifts)
        apart = max(len(moments) // MOMENTS, 1)
        for drift in drifts if len(moments) else ():
            best = _best(scene, drift, int(run), moments[::apart])
            if apart > 1:
                at = int(np.searchsorted(moments, best.sequence))
                best = _best(scene, drift, int(run), moments[max(at - apart, 0) : at + apart + 1])
            steps.append(best)
    return steps, tries


def _best(scene: ChainScene, drift: ChainEffect, run: int, moments: npt.NDArray[np.int64]) -> _Step:
    """The step of an error that explains most of what the model leaves."""
    fit, beside = scene.fit, scene.remainders.beside(())
    bases = [_basis(fit, drift, run, int(moment)) for moment in moments]
    every = [without(beside.basis, columns.columns.T) for columns in columns_of(fit, bases)]
    explained = [_explained(orthonormal(columns), beside.residual) for columns in every]
    index = int(np.argmax(explained))
    return _Step(drift, run, int(moments[index]), explained[index])


def _explained(basis: Array, residual: Array) -> float:
    return float(np.sum((basis.T @ residual) ** 2))


def _deviance(fit: Fit) -> float:
    """Minus twice the logarithm of the likelihood of what a model leaves in the noise of a fit."""
    correlation = None if fit.whitening is None else fit.whitening.correlation
    design = fit.noise_design_under(correlation, whole=True)
    residual = without(orthonormal(fit.nuisance.shared), fit.white.reshape(-1, 1))
    return float(design.deviance(float(np.sum(residual**2)), correlation))


def _in_noise(fit: Fit, step: _Step) -> tuple[float, float]:
    """Twice the logarithm of the likelihood ratio of a step under the noise of a fit, and its p-value of F."""
    shared = orthonormal(fit.nuisance.shared)
    residual = without(shared, fit.white.reshape(-1, 1))[:, 0]
    tested = orthonormal(without(shared, columns_of(fit, [step.basis(fit)])[0].columns.T))
    rank = tested.shape[1]
    freedom = fit.degrees_of_freedom + fit.nuisance.shared_rank - shared.shape[1] - rank
    explained, total = _explained(tested, residual), float(residual @ residual)
    if rank == 0 or freedom < 1 or explained >= total:
        return 0.0, 1.0
    f = explained / rank / ((total - explained) / freedom)
    return -freedom * float(np.log1p(-explained / total)), float(scipy.special.fdtrc(rank, freedom, f))
