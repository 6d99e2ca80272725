"""Variation from run to run: effects with another size in every run, which a recorded column follows or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.evidence.run_evidence import weigh_in_each_run
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.missing import ChainMissing, missing_effects
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, MachineEffect, scene_of
from monitor.discovery.machine.shapes.refine import refine_all
from monitor.discovery.machine.shapes.variants import NEVER_FOUND, each_run, with_drivers
from monitor.discovery.machine.surroundings import Surroundings
from monitor.discovery.search.evidence import Evidence
from monitor.discovery.search.plausible import nearly_cancelled
from monitor.discovery.search.scan import scan

# With fewer runs, another size in every run is no pattern.
FEWEST_RUNS = 3
# One false alarm in a thousand campaigns, so that this search adds little to the scan's own one in a hundred.
FALSE_ALARM = 1e-3
# Others that may vary instead are compared in detail where their evidence comes this close, twice what rules out.
CLOSE = 24.0
MOST_RIVALS = 12


@dataclass(frozen=True)
class Varying:
    """An effect that varies, with what its sizes explain, less their price, in squared standard deviations of
    the residual."""

    effect: MachineEffect
    gain: float


def _weigh(scene: ChainScene, variants: Sequence[ChainVariant]) -> list[Evidence[ChainCandidate]]:
    """Evidence for those of the variants that the plan can see, with another size in every run."""
    # By identity: equal variants are the same objects here, and comparing effects is slow.
    wanted = {id(variant) for variant in variants}
    candidates = [
        candidate
        for candidate in scene.candidates
        if id(candidate.variant) in wanted and candidate.detectable
    ]
    return sorted(weigh_in_each_run(candidates, scene), key=lambda evidence: -evidence.score)


def _is_cancelled(scene: ChainScene, evidence: Evidence[ChainCandidate]) -> bool:
    """Whether an effect is many times as large in a run as what it takes of the residual: the run's own unknowns nearly
    cancel it, as those of a plate cancel a cycle of which its spacing is a multiple."""
    fit, candidate = scene.fit, evidence.candidate
    columns = candidate.columns.reshape(*fit.white.shape, -1)
    raw, run, peak = candidate.raw, fit.problem.context.run, 0.0
    for number, of_run in enumerate(fit.problem.runs):
        sizes = np.linalg.lstsq(columns[number], fit.white[number], rcond=None)[0]
        moved = np.linalg.norm(raw[run == of_run] @ sizes, axis=1)
        peak = max(peak, float(moved.max(initial=0.0)))
    return nearly_cancelled(peak, fit.sigma**2 * evidence.explained, fit.readings)


def most_varying(
    fit: Fit, variants: Sequence[ChainVariant], scene: ChainScene | None = None
) -> Varying | None:
    """The effect that, with another size in every run, explains most of what the model leaves; None if none does.

    ``scene`` is that of the fit with all ``variants``, where it is known.
    """
    if len(fit.problem.runs) < FEWEST_RUNS:
        return None
    added = {effect.text for effect in fit.problem.added}
    bare = [
        variant
        for variant in variants
        if variant.tries == 1
        and variant.odds < NEVER_FOUND
        and (varying := each_run(variant.effect)) is not None
        and varying.effect.text not in added
    ]
    scene = scene_of(fit, bare) if scene is None else scene
    weighed = _weigh(scene, bare)
    surely = (evidence for evidence in weighed if evidence.p_value * len(weighed) <= FALSE_ALARM)
    best = next((evidence for evidence in surely if not _is_cancelled(scene, evidence)), None)
    if best is None:
        return None
    remainder = float(scene.residual @ scene.residual) - best.explained
    freedom = max(scene.degrees_of_freedom - best.rank, 1)
    gain = best.explained * freedom / remainder - best.rank * np.log(scene.degrees_of_freedom)
    return Varying(best.candidate.effect, float(gain))


def varying_effects(
    steady: Fit,
    effects: Sequence[MachineEffect],
    others: Sequence[ChainVariant],
    rate: float,
    surroundings: Surroundings,
) -> tuple[ChainMissing, ...]:
    """Effects that vary as results; ``steady`` is the fit with all else that was found, ``others`` the effects that
    may be their rivals.

    Where a recorded column follows the sizes, the effect with that driver explains as much with one coefficient,
    and is the finding.
    """
    bare = [
        variant
        for variant in others
        if variant.tries == 1 and variant.odds < NEVER_FOUND and each_run(variant.effect) is not None
    ]
    weighed = _weigh(scene_of(steady, bare), bare)
    close = [evidence for evidence in weighed if evidence.score > weighed[0].score - CLOSE][:MOST_RIVALS]
    names = {effect.text for effect in effects}
    rivals = [evidence.candidate.effect for evidence in close if evidence.candidate.family not in names]
    variants = [variant for effect in (*effects, *rivals) if (variant := each_run(effect)) is not None]
    variants += [variant for effect in effects for variant in with_drivers(effect, surroundings.drivers)]
    scene = scene_of(steady, variants)
    result = scan(scene, rate=rate, most=len(effects))
    return missing_effects(scene, result, refine_all(scene, result.candidates), surroundings)
