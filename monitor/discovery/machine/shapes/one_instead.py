"""One shape of an error in place of several of it, where it explains as much at its price.

At five angles two harmonics follow whatever a table does, and at ten positions two cycles a third one between them. A
step by step search meets the two first: each takes more alone than what the one leaves beside the base, or the one is
not asked for at all, as over a part of a turn, with many periods or with a long pitch. Told as two it would be an error
too many, and a search for two causes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.alias_pitches import as_it_appears
from monitor.discovery.machine.shapes.cycles import best_cycle
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import is_free, priced
from monitor.discovery.machine.shapes.long_waves import is_clipped, is_long, price_of_several
from monitor.discovery.machine.shapes.shown_cycles import is_cycle
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.waves import many_periods
from monitor.discovery.search.evidence import Evidence, weigh_beside
from monitor.discovery.search.scan import WORTH_EXCHANGING, ScanResult, findings_of
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.machine import MOTION

#: Scores that differ by less differ by rounding.
DECIMALS = 6
#: Whether the second is believed beside the first.
Accepts = Callable[[Sequence[ChainCandidate], ChainCandidate], bool]


def one_instead(scene: ChainScene, result: ChainScan, accepts: Accepts) -> tuple[ChainScene, ChainScan]:
    """The findings with one shape of the catalogue in place of several of the same error, most of them first, wherever
    it says at least as much at its price and is accepted, and with the best pitch of a cycle; the scene with what is
    new in it."""
    selected = before = result.candidates
    while True:
        better = next(_instead(scene, selected, accepts), None)
        if better is None:
            break
        selected = better
        # A shape that was never to be found by itself is at its odds here; its namesake is no rival of it.
        families = {candidate.family for candidate in selected}
        rest = tuple(each for each in scene.candidates if each.family not in families)
        scene = replace(scene, candidates=(*rest, *selected))
    if selected is before:
        return scene, result
    return scene, ScanResult(findings_of(scene, selected))


def _instead(
    scene: ChainScene, selected: Sequence[ChainCandidate], accepts: Accepts
) -> Iterator[list[ChainCandidate]]:
    """The selected effects with one in place of several of an error, or of a lead that looks longer at its positions:
    the scan weighs so long pitches on a grid, on which the best one may say less than what a lead looks like."""
    shapes = [candidate for candidate in selected if _is_motion(candidate)]
    for symbol in dict.fromkeys(map(error_of, shapes)):
        mine = [shape for shape in shapes if error_of(shape) == symbol]
        for size in range(len(mine), 0, -1):
            for several in combinations(mine, size):
                others = [each for each in selected if all(each is not other for other in several)]
                if size == 1 and not _may_be_another(scene, several[0], others):
                    continue
                worth = priced(scene, several, others)
                for evidence in _shapes_of_error(scene, several[0], others):
                    single = evidence.candidate
                    less = price_of_several(scene, several, others) if is_long(single) else 0.0
                    outdoes = evidence.score >= worth - less + (WORTH_EXCHANGING if size == 1 else 0.0)
                    if outdoes and accepts(others, single):
                        yield [*others, single]


def _may_be_another(scene: ChainScene, shape: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    """Whether one shape is asked against others of its error: a lead that looks longer, a cycle of the longest pitch
    that was sought, and the free shape of a turning axis, of which one part may follow at a few angles what takes a
    cosine and a sine."""
    effect = shape.effect
    turns = isinstance(effect, ChainEffect) and effect.joint.turns
    if (is_free(shape) and turns) or as_it_appears(effect, scene.fit.problem.context):
        return True
    return is_clipped(scene, shape, others)


def _shapes_of_error(
    scene: ChainScene, shape: ChainCandidate, others: Sequence[ChainCandidate]
) -> list[Evidence[ChainCandidate]]:
    """The evidence for single shapes of the error of which a candidate is one, beside others; the most convincing
    first, and of waves that are one at the angles visited the slowest."""
    taken = {other.family for other in others}
    shapes = [
        _at_even_odds(each)
        for each in scene.candidates
        if _is_motion(each) and not is_free(each) and error_of(each) == error_of(shape)
    ]
    waves = many_periods(scene, [shape, *shapes])
    able = [
        each
        for each in (*shapes, *waves, *best_cycle(scene, shape, others))
        if each.visible and each.family not in taken
    ]
    position = {each.family: index for index, each in enumerate(able)}
    return sorted(
        weigh_beside(scene, able, others),
        key=lambda evidence: (-round(evidence.score, DECIMALS), position[evidence.candidate.family]),
    )


def _is_motion(candidate: ChainCandidate) -> bool:
    """Whether a candidate is an error motion of an axis that follows no driver."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect) and isinstance(effect.driver, Always) and effect.term.stage == MOTION
    )


def _at_even_odds(candidate: ChainCandidate) -> ChainCandidate:
    """A candidate without odds against it beforehand: what it takes the place of are shapes of the same error, which
    bend no less than it. A cycle keeps those of a pitch that repeats at no positions."""
    if is_cycle(candidate):
        return candidate
    return replace(candidate, variant=replace(candidate.variant, odds=1.0))
