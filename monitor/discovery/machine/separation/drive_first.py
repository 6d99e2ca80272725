"""Which of two errors of an axis leads that the data do not tell apart: that of its drive before all others.

A tilt whose arm is the same at all touches moves the tip as the positioning does, but for the micrometres by which the
arm varies. What is left of one beside the other is then far below the scatter of the readings, and chance decides which
of the two explains more.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.amplitudes import amplitudes
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.projection import orthonormal, without
from monitor.discovery.search.scan import ScanResult, except_for, findings_of
from monitor.effects import ChainEffect, parse_effect
from monitor.exceptions import EffectError
from monitor.machine import COMPONENTS, MOTION

#: Standard deviations by which two effects differ over all readings together. Of two that differ by less the hidden one
#: explains more in fewer than 60 of 100 campaigns: the probability is that of a normal deviate above minus half of it.
UNTOLD = 0.5


def drive_first(scene: ChainScene, result: ChainScan) -> tuple[ChainScene, ChainScan]:
    """The findings with the likeliest cause in place of each that the data do not tell from it: of errors of one axis
    with the same shape and driver that of the drive, then a displacement; the scene with what is new in it."""
    selected = before = result.candidates
    for index in range(len(selected)):
        for likelier in _likelier(scene, selected[index]):
            if _says_as_much(scene, selected, index, likelier):
                selected = [*selected[:index], likelier, *selected[index + 1 :]]
                break
    if all(now_leads is before_led for now_leads, before_led in zip(selected, before, strict=True)):
        return scene, result
    families = {candidate.family for candidate in selected}
    rest = tuple(each for each in scene.candidates if each.family not in families)
    scene = replace(scene, candidates=(*rest, *selected))
    return scene, ScanResult(findings_of(scene, selected))


def _likelier(scene: ChainScene, candidate: ChainCandidate) -> Iterator[ChainCandidate]:
    """The shape of a candidate as that of the errors of its axis that are likelier causes, the likeliest first."""
    effect, variant = candidate.effect, candidate.variant
    if not isinstance(effect, ChainEffect) or effect.term.stage != MOTION or candidate.behind == 0.0:
        return
    symbol = effect.term.symbol
    variants = []
    for component, letter in enumerate(COMPONENTS):
        other = f"E{letter}{effect.joint.name}"
        moved = replace(effect, term=replace(effect.term, symbol=other, component=component))
        try:
            parse_effect(moved.text, scene.fit.problem.context.chain)
        except EffectError:
            # A torque bends no slide.
            continue
        family = variant.family.replace(symbol, other, 1)
        nearest = variant.nearest and variant.nearest.replace(symbol, other, 1)
        variants.append(replace(variant, family=family, effect=moved, nearest=nearest))
    likelier = [each for each in scene_of(scene.fit, variants).candidates if each.behind < candidate.behind]
    yield from sorted(likelier, key=lambda each: each.behind)


def _says_as_much(
    scene: ChainScene, selected: list[ChainCandidate], index: int, other: ChainCandidate
) -> bool:
    """Whether another effect does, as far as the data tell, what the selected one at an index does beside the rest."""
    others = except_for(selected, index)
    if not other.visible or other.family in {each.family for each in others}:
        return False
    beside = scene.remainders.beside(selected)
    noise = float(beside.residual @ beside.residual) / max(beside.degrees_of_freedom, 1)
    estimate = amplitudes(scene, selected).estimate
    first = sum(each.columns.shape[1] for each in selected[:index])
    size = estimate[first : first + selected[index].columns.shape[1]]
    basis = scene.remainders.beside(others).basis
    does, can = (without(basis, each.columns) for each in (selected[index], other))
    difference = without(orthonormal(can), (does @ size)[:, None])
    if float(np.sum(difference**2)) >= UNTOLD**2 * noise:
        return False
    # A shape that would have to be larger than a machine in use hides is no likelier cause.
    mine, its = (weigh_beside(scene, [each], others)[0] for each in (selected[index], other))
    return its.rank == mine.rank and its.too_large <= mine.too_large
