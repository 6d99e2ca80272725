"""A drift of an error in place of its free shape: what shifts in the time of a run, or with a temperature.

Poses that are visited in one order in every run take a drift for a shape of any axis that goes with that order, and the
catalogue has drifts of few errors. Whatever a free shape follows, one coefficient in place of several is asked for.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import is_free, priced
from monitor.discovery.machine.shapes.refine import refine
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.drivers import Always
from monitor.machine import MOTION

#: Whether the second is believed beside the first.
Accepts = Callable[[Sequence[ChainCandidate], ChainCandidate], bool]


def drift_instead(
    scene: ChainScene, result: ChainScan, drivers: Sequence[str], accepts: Accepts
) -> tuple[ChainScene, ChainScan]:
    """The findings with a drift in place of all shapes of an error of which one is free, by whichever driver says at
    least as much at the price of its choice and is accepted; the scene with what is new in it."""
    selected = list(result.candidates)
    for free in filter(is_free, result.candidates):
        mine = [each for each in selected if _is_plain(each) and error_of(each) == error_of(free)]
        others = [each for each in selected if all(each is not other for other in mine)]
        drift = _best_drift(scene, free, drivers, others)
        if drift is None:
            continue
        choice = 2.0 * float(np.log(scene.families))
        if priced(scene, [drift], others) - choice >= priced(scene, mine, others) and accepts(others, drift):
            selected = [*others, drift]
            # The shape that it looked like is no rival of it.
            rest = [each for each in scene.candidates if all(each is not other for other in mine)]
            is_searched = any(each.family == drift.family for each in rest)
            scene = replace(scene, candidates=(*rest, *([] if is_searched else [drift])))
    if len(selected) == len(result.candidates) and all(map(operator.is_, selected, result.candidates)):
        return scene, result
    return scene, ScanResult(findings_of(scene, selected))


def _is_plain(candidate: ChainCandidate) -> bool:
    """Whether a candidate is an error motion of an axis that follows no driver."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect) and isinstance(effect.driver, Always) and effect.term.stage == MOTION
    )


def _best_drift(
    scene: ChainScene, shape: ChainCandidate, drivers: Sequence[str], others: Sequence[ChainCandidate]
) -> ChainCandidate | None:
    """The drift of the error of a candidate that says most beside others, at its best time constant."""
    chain, taken = scene.fit.problem.context.chain, {other.family for other in others}
    texts = [f"{error_of(shape)}:const@{driver}" for driver in drivers]
    variants = [
        variant for text in texts if text not in taken for variant in variants_of(parse_effect(text, chain))
    ]
    drifts = [drift for drift in scene_of(scene.fit, variants).candidates if drift.visible]
    weighed = weigh_beside(scene, drifts, others)
    return refine(scene, [*others, weighed[0].candidate], len(others)).candidate if weighed else None
