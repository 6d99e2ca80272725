"""An error that stepped once within a run: a mirror that slipped, a clamp that gave way, an encoder that lost its zero.

A drift takes its place by half, and what that leaves looks like noise that neighbours share. So every moment of every
run is tried for each error that may drift. A step has to say more at its price than what is named, and than any effect
where nothing is; it has to stand out of the noise of neighbours that it leaves itself, and to be likelier than noise
that walks and than the same error that goes over within some readings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.scene_columns import columns_of
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.rivals import UNDECIDED
from monitor.effects import Basis, ChainEffect
from monitor.effects.drivers import Always, RunTime, Stepped
from monitor.effects.effect import ChainBasis
from monitor.effects.shapes import Const
from monitor.records import Array

# Readings before and after: fewer are bad points. What goes over within as many is no step.
READINGS_EACH_SIDE = 8
# So many moments of a run are tried, then all those between the neighbours of the best one.
MOMENTS = 40
# The sum of squares of the noise of a run is less than usual by no more than so many standard deviations.
LEAST_NOISE = 4.0


@dataclass(frozen=True)
class SteppedWithin:
    """The step of an error within a run, the likeliest of ``effects`` that these data do not tell apart, its ``size``
    and standard uncertainty in internal units, and the root mean square in mm that is left of ``rms_before``. It says
    more than the effects that were named ``instead_of`` it."""

    effects: tuple[ChainEffect, ...]
    size: float
    u: float
    rms_before: float
    rms_after: float
    instead_of: tuple[str, ...] = ()

    @property
    def effect(self) -> ChainEffect:
        """The likeliest step, as it is added to a model."""
        return self.effects[0]

    @property
    def errors(self) -> tuple[str, ...]:
        """What stepped, by the names of the errors."""
        return tuple(_steady(effect).text for effect in self.effects)

    @property
    def moment(self) -> Stepped:
        """When it did."""
        driver = self.effect.driver
        assert isinstance(driver, Stepped)
        return driver


@dataclass(frozen=True)
class _Step:
    """A step of the error of a drift from a reading on, and its score: what it says at its price."""

    drift: ChainEffect
    run: int
    sequence: int
    score: float

    @property
    def effect(self) -> ChainEffect:
        """What the step is as an effect."""
        moment = Stepped(self.run, self.sequence)
        return replace(self.drift, driver=moment, driver_text=moment.text)

    def basis(self, fit: Fit) -> ChainBasis:
        """What it does at every probing, for a unit."""
        return self.effect.basis(fit.problem.context)


def stepped_within(
    scene: ChainScene, selected: Sequence[ChainCandidate], others: Sequence[ChainCandidate], rate: float
) -> SteppedWithin | None:
    """The step within a run that says most in what the model leaves beside ``selected`` effects, in a ``scene`` of
    independent noise; None where the ``others``, which it would take the place of, say as much, or where it does not
    stand out at a ``rate`` of the noise of neighbours that it leaves."""
    fit, beside = scene.fit, scene.remainders.beside(selected)
    steps, tries = _Search(scene, selected, others).steps()
    if not steps:
        return None
    first = max(steps, key=lambda step: step.score)
    if first.score < _score(scene, selected, others) + UNDECIDED:
        return None
    # Which error it is, and whether it is any, the noise says that it leaves.
    design, shape = fit.whole_noise_design, fit.solution.last.residual.shape
    bases = [candidate.basis for candidate in selected]
    noisy = fit.with_correlation(design.correlation(_left(scene, selected, first).reshape(shape)))
    steps = [step for step in steps if step.run == first.run]
    price = np.log(beside.degrees_of_freedom) + 2.0 * np.log(tries)
    costs = [_deviance(noisy, [*bases, step.basis(fit)]) for step in steps]
    least = min(costs)
    first = steps[costs.index(least)]
    if _p_value(noisy, bases, first) * tries > rate:
        return None
    # What is named, or noise that walks, looks stepped at some moment or other: it has to be less likely.
    for instead in ((), others):
        residual = scene.remainders.beside([*selected, *instead]).residual
        walking = fit.with_correlation(design.correlation(residual.reshape(shape)))
        more = [candidate.basis for candidate in instead]
        worth = price - sum(basis.size for basis in more) * np.log(beside.degrees_of_freedom)
        if _deviance(walking, [*bases, *more]) - least - worth < UNDECIDED:
            return None
    if min(_deviance(noisy, [*bases, gradual]) for gradual in _gradual(fit, first)) < least:
        return None
    likely = sorted(zip(costs, steps, strict=True), key=lambda each: each[0])
    effects = tuple(step.effect for cost, step in likely if cost < least + UNDECIDED)
    size, u = _size(noisy, selected, effects[0])
    return SteppedWithin(
        effects,
        size,
        u,
        fit.rms_of(scene.residual),
        fit.rms_of(_left(scene, selected, first)),
    )


def _score(scene: ChainScene, selected: Sequence[ChainCandidate], others: Sequence[ChainCandidate]) -> float:
    """What other effects say beside the selected ones, at their price."""
    beside = list(selected)
    score = 0.0
    for other in others:
        score += weigh_beside(scene, [other], beside)[0].score
        beside.append(other)
    return score


def _left(scene: ChainScene, selected: Sequence[ChainCandidate], step: _Step) -> Array:
    """What selected effects leave (M,) with a step beside them, in independent noise."""
    beside, fit = scene.remainders.beside(selected), scene.fit
    column = without(beside.basis, columns_of(fit, [step.basis(fit)])[0].columns.T)
    return np.asarray(without(orthonormal(column), beside.residual[:, None])[:, 0])


def _size(noisy: Fit, selected: Sequence[ChainCandidate], step: ChainEffect) -> tuple[float, float]:
    """The size of a step beside selected effects in the noise of a fit, and its standard uncertainty."""
    variants = [*(candidate.variant for candidate in selected), Variant(step.text, step)]
    scene = scene_of(noisy, variants)
    sizes = amplitudes(scene, scene.candidates)
    return float(sizes.estimate[-1]), float(np.sqrt(sizes.covariance[-1, -1]))


def _drifts(effect: object) -> bool:
    """Whether an effect is an error that drifts evenly through every run, the same wherever the axes stand."""
    return isinstance(effect, ChainEffect) and effect.driver == RunTime() and isinstance(effect.shape, Const)


def _steady(effect: ChainEffect) -> ChainEffect:
    """The error of a drift or a step, the same at all times."""
    return replace(effect, driver=Always(), driver_text="")


class _Search:
    """The steps of all errors that may drift, beside ``selected`` effects."""

    def __init__(
        self, scene: ChainScene, selected: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
    ) -> None:
        self.scene, self.fit = scene, scene.fit
        self.beside = scene.remainders.beside(selected)
        self.with_others = scene.remainders.beside([*selected, *others])
        drifts = (each.effect for each in scene.candidates if each.visible)
        self.drifts = [effect for effect in drifts if isinstance(effect, ChainEffect) and _drifts(effect)]

    def steps(self) -> tuple[list[_Step], int]:
        """The best step of every error in every run that may have one, and how many there are to choose from."""
        context = self.fit.problem.context
        tried: list[tuple[ChainEffect, int, Array]] = []
        tries = 0
        for run, is_possible in zip(self.fit.problem.runs, self._possible(), strict=True):
            moments = np.unique(context.sequence[context.run == run])
            moments = moments[READINGS_EACH_SIDE:-READINGS_EACH_SIDE]
            tries += len(moments) * len(self.drifts)
            if is_possible and len(moments):
                tried += [(drift, int(run), moments) for drift in self.drifts]
        return [self._best_of_run(*each, tries) for each in tried], tries

    def _possible(self) -> npt.NDArray[np.bool_]:
        """Which runs (R,) may have a step that says more than the others: without the least noise that is likely they
        leave more than the others take of all runs."""
        runs = len(self.fit.problem.runs)
        squares = np.sum(self.beside.residual.reshape(runs, -1) ** 2, axis=1)
        usual = np.sum(self.with_others.residual.reshape(runs, -1) ** 2, axis=1)
        numbers = max(self.beside.degrees_of_freedom / runs, 1.0)
        if runs < 3:
            return np.ones(runs, dtype=bool)
        noise = float(np.median(usual)) * max(1.0 - LEAST_NOISE * np.sqrt(2.0 / numbers), 0.0)
        taken = float(np.sum(self.beside.residual**2) - np.sum(self.with_others.residual**2))
        return np.asarray(squares - noise > taken)

    def _best_of_run(self, drift: ChainEffect, run: int, moments: Array, tries: int) -> _Step:
        apart = max(len(moments) // MOMENTS, 1)
        best = self._best(drift, run, moments[::apart], tries)
        if apart == 1:
            return best
        at = int(np.searchsorted(moments, best.sequence))
        return self._best(drift, run, moments[max(at - apart, 0) : at + apart + 1], tries)

    def _best(self, drift: ChainEffect, run: int, moments: Array, tries: int) -> _Step:
        """The step of an error that explains most of what the model leaves."""
        context = self.fit.problem.context
        constant = _steady(drift).basis(context)
        is_after = (context.run == run) & (context.sequence >= moments[:, None])
        bases = [ChainBasis(constant.term, constant.columns * after[:, None]) for after in is_after]
        columns = [without(self.beside.basis, each.columns.T) for each in columns_of(self.fit, bases)]
        explained = [float(np.sum((orthonormal(each).T @ self.beside.residual) ** 2)) for each in columns]
        index = int(np.argmax(explained))
        total, freedom = float(self.beside.residual @ self.beside.residual), self.beside.degrees_of_freedom
        score = -np.inf
        if freedom >= 2 and explained[index] < total:
            score = -freedom * float(np.log1p(-explained[index] / total))
            score -= float(np.log(freedom) + 2.0 * np.log(tries))
        return _Step(drift, run, int(moments[index]), score)


def _gradual(fit: Fit, step: _Step) -> list[ChainBasis]:
    """The error of a step that goes over within some readings, evenly or settling, about its moment."""
    context = fit.problem.context
    of_run = context.run == step.run
    moments = np.unique(context.sequence[of_run])
    number = np.searchsorted(moments, context.sequence)
    at = int(np.searchsorted(moments, step.sequence))
    constant = _steady(step.drift).basis(context)
    bases = []
    width = READINGS_EACH_SIDE
    while width < 2 * len(moments):
        for begin in range(max(at - width, 0), at + 1, max(width // READINGS_EACH_SIDE, 1)):
            since = np.maximum(number - begin + 1, 0) / width
            bases += [
                ChainBasis(constant.term, constant.columns * (of_run * part)[:, None])
                for part in (np.minimum(since, 1.0), -np.expm1(-2.0 * since))
            ]
        width *= 2
    return bases


def _deviance(fit: Fit, bases: Sequence[Basis]) -> float:
    """Minus twice the logarithm of the likelihood of what a model leaves with further effects in the noise of a fit."""
    correlation = None if fit.whitening is None else fit.whitening.correlation
    design = fit.noise_design_under(correlation, whole=True)
    residual = without(_beside(fit, bases), fit.white.reshape(-1, 1))
    return float(design.deviance(float(np.sum(residual**2)), correlation))


def _beside(fit: Fit, bases: Sequence[Basis]) -> Array:
    """An orthonormal basis (M, r) of what further effects do, with what all runs share."""
    columns = [each.columns.T for each in columns_of(fit, bases)]
    return orthonormal(np.concatenate([fit.nuisance.shared, *columns], axis=1))


def _p_value(fit: Fit, bases: Sequence[Basis], step: _Step) -> float:
    """The p-value of F of a step beside other effects under the noise of a fit."""
    shared = _beside(fit, bases)
    residual = without(shared, fit.white.reshape(-1, 1))[:, 0]
    tested = orthonormal(without(shared, columns_of(fit, [step.basis(fit)])[0].columns.T))
    rank = tested.shape[1]
    freedom = fit.degrees_of_freedom + fit.nuisance.shared_rank - shared.shape[1] - rank
    explained, total = float(np.sum((tested.T @ residual) ** 2)), float(residual @ residual)
    if rank == 0 or freedom < 1 or explained >= total:
        return 1.0
    return float(scipy.special.fdtrc(rank, freedom, explained / rank / ((total - explained) / freedom)))
