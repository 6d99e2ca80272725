"""Drifts of one run alone: something warmed up, settled or gave way while that run was measured, and in no other.

Errors that drift through every run are in the catalogue. One that drifts in a single run of several is searched where
a run stands out of what the effects so far leave, judged by how the same errors drift in the other runs: noise that
walks makes all of them drift.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, MachineEffect, scene_of
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import SMALLEST_REMAINDER
from monitor.discovery.search.projection import without
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.drivers import Always, RunTime
from monitor.machine import COMPONENTS
from monitor.records import Array

# Of two runs one drifts unlike the other, and nobody knows which is as usual.
FEWEST_RUNS = 3
# Odds against a drift of one run: what all runs share leads where it does as well.
ODDS_OF_ONE_RUN = 20.0


def in_one_run(effect: MachineEffect, runs: Iterable[int], tries: int) -> list[ChainVariant]:
    """The error of an effect drifting through each of ``runs`` alone, ``tries`` of them searched; none for what
    depends on no time or temperature."""
    if not isinstance(effect, ChainEffect) or isinstance(effect.driver, Always):
        return []
    driven = [replace(effect, driver=RunTime(run), driver_text=f"run_time({run})") for run in runs]
    return [Variant(drift.text, drift, tries, ODDS_OF_ONE_RUN) for drift in driven]


def drifts_of_runs(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> list[ChainVariant]:
    """Drifts of one run that stand out of what the selected effects leave, at a false-alarm ``rate``."""
    runs = scene.fit.problem.runs
    if len(runs) < FEWEST_RUNS or poses_of_rows(scene.fit) is not None:
        return []
    drifting = _drifting(scene)
    if not drifting:
        return []
    beside = scene.remainders.beside(selected)
    columns = without(beside.basis, np.concatenate([candidate.columns for candidate in drifting], axis=1))
    # Whitened numbers stand run by run: a drift of one run is that part of a drift of all.
    of_runs = columns.T.reshape(len(drifting), len(runs), -1)
    lengths = np.linalg.norm(of_runs, axis=2)
    acts = lengths > np.sqrt(SMALLEST_REMAINDER) * np.linalg.norm(lengths, axis=1, keepdims=True)
    units = np.where(acts, 1.0 / np.where(acts, lengths, 1.0), 0.0)[..., None] * of_runs
    variance = float(beside.residual @ beside.residual) / max(beside.degrees_of_freedom, 1)
    onto = np.einsum("erm,rm->er", units, beside.residual.reshape(len(runs), -1))
    p_values = _against_other_runs(onto**2 / variance, units, acts) * acts.sum()
    return [
        variant
        for index, number in np.argwhere(acts & (p_values <= rate))
        for variant in in_one_run(drifting[index].effect, [int(runs[number])], len(runs))
    ]


def _against_other_runs(squares: Array, units: Array, acts: npt.NDArray[np.bool_]) -> Array:
    """The p-values (E, R) of drifts whose squares (E, R) stand for one standard deviation each: F against the mean
    square of all drifts in the other runs, where these are larger than noise makes them.

    Drifts that move the tip alike, ``units`` (E, R, m), count as fewer (Satterthwaite, Biometrics Bulletin 2 (1946)
    110).
    """
    alike = np.einsum("erm,frm->ref", units, units) ** 2
    drifts = acts.sum(axis=0)
    independent = drifts**2 / np.maximum(alike.sum(axis=(1, 2)), 1.0)
    p_values = np.ones_like(squares)
    for run in range(squares.shape[1]):
        others = np.arange(squares.shape[1]) != run
        count = int(drifts[others].sum())
        if count == 0:
            continue
        usual = max(float(squares[:, others][acts[:, others]].mean()), 1.0)
        freedom = float(independent[others].sum())
        p_values[:, run] = scipy.special.fdtrc(1, freedom, squares[:, run] / usual)
    return p_values


def _drifting(scene: ChainScene) -> list[ChainCandidate]:
    """The errors of axes that, drifting evenly through every run, move the tip: those that were searched, and tilts of
    linear axes, of which the base has no more than what stays the same through a run needs."""
    chain = scene.fit.problem.context.chain
    texts = [
        f"{error}@run_time"
        for joint in chain.of_kind("linear")
        for index, letter in enumerate("XYZ")
        if index != joint.main
        for error in (f"E{letter}{joint.name}:poly1", f"E{COMPONENTS[3 + index]}0{joint.name}")
    ]
    searched = [candidate for candidate in scene.candidates if _drifts(candidate)]
    texts_searched = {candidate.effect.text for candidate in searched}
    tilts = [parse_effect(text, chain) for text in texts if text not in texts_searched]
    more = scene_of(scene.fit, [Variant(tilt.text, tilt) for tilt in tilts]).candidates
    return [*searched, *filter(_drifts, more)]


def _drifts(candidate: ChainCandidate) -> bool:
    """Whether an effect is an error of an axis that drifts evenly through every run, of one size."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect)
        and effect.driver == RunTime()
        and candidate.visible
        and candidate.columns.shape[1] == 1
    )
