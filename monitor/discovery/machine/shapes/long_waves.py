"""Waves of one and a half to two periods over the travel, which bends and bumps come near to as well.

Whether so long a wave repeats nobody has seen. It is told where it alone is its error: where it says as much at the
price of its pitch as a free shape or several powers, and no shape says more beside it. A cycle whose best pitch is the
longest that was sought is none where a longer one would say more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.alias_pitches import as_it_appears
from monitor.discovery.machine.shapes.bends import bends_instead, foretells_poses, score_beside
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import (
    PRICE,
    of_parts,
    of_parts_alone,
    parts_worth_keeping,
    priced,
    whole_basis,
)
from monitor.discovery.machine.shapes.refine import AT_END, LIMIT, NAMED_TO, refine
from monitor.discovery.machine.shapes.shown_cycles import is_cycle
from monitor.discovery.machine.shapes.slight_shapes import p_value_of_all
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.variants import (
    BEND_PERIODS,
    SHORTEST_PITCH_MM,
    longest_pitch,
    pitch_limits,
    pitches_over,
)
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.rivals import UNDECIDED
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.effects import ChainEffect, parse_effect
from monitor.effects.drivers import Always
from monitor.effects.shapes import Cyclic
from monitor.machine import MOTION

# A wave and its pitch, a zero and a gain are five numbers: at fewer positions it passes for a bump of any kind.
FEWEST_POSITIONS = 8
# Where an error in any shape says so much more beside a wave, the wave is not the whole of it.
LEVEL = 0.01
# A pitch within this part of half of the travel is the end of its range, to the tolerance of the search.
AT_HALF = 2e-3
# From where longer pitches are tried, in halves of the travel.
JUST_LONGER = 1.02


def long_wave(
    scene: ChainScene, shape: ChainCandidate, others: Sequence[ChainCandidate]
) -> list[ChainCandidate]:
    """The wave of one and a half to two periods that beside others is the whole of the error of which a candidate is a
    shape; none where something else is, and where others are of that error."""
    effect, symbol = shape.effect, error_of(shape)
    assert isinstance(effect, ChainEffect)
    if any(error_of(other) == symbol for other in others):
        return []
    context = scene.fit.problem.context
    positions = np.sort(context.positions[:, effect.term.joint])
    if int(np.sum(np.diff(positions) > SHORTEST_PITCH_MM / 2.0)) + 1 < FEWEST_POSITIONS:
        return []
    shortest, travel = pitch_limits(context)[effect.joint.name]
    longest = travel / BEND_PERIODS
    pitches = pitches_over(travel, longest)
    long = [pitch for pitch in pitches if max(shortest, longest_pitch(travel)) < pitch]
    texts = [f"{symbol}:cyclic{pitch:.6g}mm" for pitch in long]
    variants = [
        Variant(f"{symbol}:cyclic", parse_effect(text, context.chain), len(pitches)) for text in texts
    ]
    starts = [wave for wave in scene_of(scene.fit, variants).candidates if wave.visible]
    waves = [refine(scene, [*others, wave], len(others)).candidate for wave in starts]
    weighed = weigh_beside(scene, waves, others)
    if not weighed or is_at_longest(weighed[0].candidate, longest):
        return []
    wave = weighed[0].candidate
    return [wave] if _pitch(wave) <= longest_pitch(travel) or _is_whole(scene, wave, others) else []


def is_at_longest(cycle: ChainCandidate, longest: float) -> bool:
    """Whether a cycle has the longest pitch, in mm, that is sought: longer ones would say more."""
    return _pitch(cycle) > (1.0 - AT_END) * longest


def _pitch(cycle: ChainCandidate) -> float:
    effect = cycle.effect
    assert isinstance(effect, ChainEffect)
    assert isinstance(effect.shape, Cyclic)
    return effect.shape.pitch


def is_long(candidate: ChainCandidate) -> bool:
    """Whether a candidate is a cycle of a sought pitch with fewer than two periods over the travel of its axis."""
    if candidate.variant.tries == 1 or not is_cycle(candidate):
        return False
    effect = candidate.effect
    assert isinstance(effect, ChainEffect)
    travel = pitch_limits(candidate.fit.problem.context)[effect.joint.name][1]
    return _pitch(candidate) > (1.0 + NAMED_TO) * longest_pitch(travel)


def price_of_several(
    scene: ChainScene, several: Sequence[ChainCandidate], others: Sequence[ChainCandidate]
) -> float:
    """What the choice of each of several shapes beyond the first takes from their score, where one wave would do; a
    screw has one lead: each further shape that looks long has to be shown beyond doubt."""
    context = scene.fit.problem.context
    long = [
        each for each in several if as_it_appears(each.effect, context) or is_clipped(scene, each, others)
    ]
    choice = 2.0 * float(np.log(scene.families))
    return choice * (len(several) - 1) + UNDECIDED * max(len(long) - 1, 0)


def _is_whole(scene: ChainScene, wave: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    """Whether a wave says beside others no less of its error at its price than its free shape and its powers do, and no
    shape of it more than chance beside the wave."""
    whole = whole_basis(scene, error_of(wave), wave)
    if p_value_of_all(scene, whole.columns, [*others, wave]) < LEVEL:
        return False
    worth = score_beside(scene, [wave], others) - 2.0 * PRICE
    parts = parts_worth_keeping(scene, whole, others)
    if parts and priced(scene, [of_parts_alone(scene, error_of(wave), parts)], others) > worth:
        return False
    return not bends_instead(scene, error_of(wave), worth, others)


def without_longest(scene: ChainScene, result: ChainScan) -> tuple[ChainScene, ChainScan]:
    """The findings with the free shape of an error in place of its shapes where the pitch of one was sought and is best
    at half of the travel; without that cycle where no free shape is worth its price or foretells poses."""
    selected = before = result.candidates
    for clipped in before:
        others = [each for each in selected if each is not clipped]
        if len(others) == len(selected) or not is_clipped(scene, clipped, others):
            continue
        of_others = [each for each in others if error_of(each) != error_of(clipped)]
        mine = [each for each in selected if error_of(each) == error_of(clipped)]
        parts = parts_worth_keeping(scene, whole_basis(scene, error_of(clipped), clipped), of_others)
        free = [of_parts(scene, error_of(clipped), parts, mine, of_others)] if parts else []
        if free and foretells_poses(scene, free, of_others):
            scene = replace(scene, candidates=(*scene.candidates, *free))
            selected = [*of_others, *free]
        else:
            selected = others
    return (scene, result) if selected is before else (scene, ScanResult(findings_of(scene, selected)))


def is_clipped(scene: ChainScene, cycle: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    """Whether a candidate is a cycle whose pitch was sought and is best, beside others, at half of the travel, where a
    longer one says more."""
    effect = cycle.effect
    if cycle.variant.tries == 1 or not is_cycle(cycle) or not isinstance(effect, ChainEffect):
        return False
    if not isinstance(effect.driver, Always) or effect.term.stage != MOTION:
        return False
    context = scene.fit.problem.context
    travel = pitch_limits(context)[effect.joint.name][1]
    longest = longest_pitch(travel)
    best = refine(scene, [*others, cycle], len(others)).candidate
    if abs(_pitch(best) / longest - 1.0) > AT_HALF:
        return False
    text = f"{error_of(cycle)}:cyclic{JUST_LONGER * longest:.6g}mm"
    longer = scene_of(
        scene.fit, [replace(cycle.variant, effect=parse_effect(text, context.chain))]
    ).candidates
    if not longer[0].visible:
        return True
    long = refine(scene, [*others, longer[0]], len(others)).candidate
    if is_at_longest(long, travel / BEND_PERIODS):
        return True
    (of_long,), (of_best,) = (weigh_beside(scene, [each], others) for each in (long, best))
    return of_long.likelihood - of_best.likelihood > LIMIT
