"""What was found under one noise of neighbours, found again under another: verified by scans that begin with it, in
place of a whole search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.missing import standing_out
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import is_free, of_parts, parts_anew
from monitor.discovery.machine.shapes.gears import gear_variants
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.suspects.station_moves import station_moves
from monitor.discovery.search.scan import ScanResult, by_error_taken_away, except_for, findings_of, scan
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always

# Parts of free shapes chosen anew that have not settled after so many turns are searched.
MOST_TURNS = 4


class Found(NamedTuple):
    """A scene and what a search of it found."""

    scene: ChainScene
    result: ChainScan


def still_found(scene: ChainScene, near: Found, drivers: Sequence[str], rate: float) -> ChainScan | None:
    """What a scan that begins with the findings in a ``near`` scene of the same candidates finds, where it is these and
    nothing else, and parts of free shapes would be chosen as there; else None."""
    begin = _in_scene(scene, near.result.candidates)
    result = _scanned(scene, begin, drivers, rate)
    if not _are_same(result.candidates, begin):
        return None
    if parts_anew(scene, begin) != parts_anew(near.scene, near.result.candidates):
        return None
    return by_error_taken_away(scene, result)


def found_in_other_noise(
    scene: ChainScene, first: ChainScan, earlier: Found, drivers: Sequence[str], rate: float
) -> Found | None:
    """What was found under an ``earlier`` noise without what is noise under this one, of which ``first`` is what the
    first scan found: steady effects stand by the places that were measured, whatever the noise. None where a scan that
    begins with them adds to them, where they drift and the first scan does not name them, or something new stands out.
    """
    texts = {candidate.effect.text for candidate in scene.candidates}
    lacking = [each.variant for each in earlier.scene.candidates if each.effect.text not in texts]
    scene = replace(scene, candidates=(*scene.candidates, *scene_of(scene.fit, lacking).candidates))
    begin = _in_scene(scene, earlier.result.candidates)
    standing = begin
    for _ in range(MOST_TURNS):
        shaped = _in_parts_anew(scene, standing)
        result = _without_other_shapes(scene, _scanned(scene, shaped, drivers, rate))
        if not result.candidates or not all(_is_among(each, shaped) for each in result.candidates):
            return None
        if _are_same(result.candidates, standing):
            break
        standing = [each for each in shaped if _is_among(each, result.candidates)]
    else:
        return None
    errors = {error_of(each) for each in standing}
    fallen = [each for each in begin if error_of(each) not in errors]
    if any(is_steady(each) and not is_free(each) for each in fallen):
        return None
    if _names_of_drifts(standing) != _names_of_drifts(first.candidates) or _stands_out(scene, standing, rate):
        return None
    return Found(scene, by_error_taken_away(scene, result))


def _without_other_shapes(scene: ChainScene, result: ChainScan) -> ChainScan:
    """A result without other shapes of errors that have a free one: what they add its parts would say at less than
    their price."""
    free = {error_of(each) for each in result.candidates if is_free(each)}
    kept = [each for each in result.candidates if is_free(each) or error_of(each) not in free]
    return result if len(kept) == len(result.findings) else ScanResult(findings_of(scene, kept))


def is_steady(candidate: ChainCandidate) -> bool:
    """Whether an effect is the same whenever its axes come to a place: noise of neighbours does nothing like it."""
    effect = candidate.effect
    return isinstance(effect, ChainEffect) and isinstance(effect.driver, Always)


def _names_of_drifts(candidates: Sequence[ChainCandidate]) -> set[str]:
    return {candidate.family for candidate in candidates if not is_steady(candidate)}


def _in_parts_anew(scene: ChainScene, selected: Sequence[ChainCandidate]) -> list[ChainCandidate]:
    """The selected effects with the parts of free shapes chosen anew, each beside the others as they were; without
    those of which no part is worth its price."""
    parts = iter(parts_anew(scene, selected))
    shaped = []
    for index, effect in enumerate(selected):
        chosen = next(parts) if is_free(effect) else []
        if not chosen:
            shaped += [] if is_free(effect) else [effect]
            continue
        symbol = error_of(effect)
        shapes = [each for each in scene.candidates if error_of(each) == symbol and not is_free(each)]
        anew = of_parts(scene, symbol, chosen, shapes, except_for(selected, index))
        shaped.append(effect if anew.effect.text == effect.effect.text else anew)
    return shaped


def _stands_out(scene: ChainScene, selected: Sequence[ChainCandidate], rate: float) -> bool:
    """Whether a gear, a drift of one run or a move of the station that the scene does not have stands out of what
    selected effects leave."""
    names = {candidate.effect.text for candidate in scene.candidates}
    new = [
        *gear_variants(scene, selected, rate),
        *drifts_of_runs(scene, selected, rate),
        *station_moves(scene, selected, rate),
    ]
    return any(variant.effect.text not in names for variant in new)


def _in_scene(scene: ChainScene, selected: Sequence[ChainCandidate]) -> list[ChainCandidate]:
    """The candidates of a scene for the effects that were selected in another one."""
    candidates = {each.effect.text: each for each in scene.candidates}
    # Searched values that an earlier scan chose between those of the candidates are none of these.
    apart = [each.variant for each in selected if each.effect.text not in candidates]
    candidates |= {each.effect.text: each for each in scene_of(scene.fit, apart).candidates}
    return [candidates[each.effect.text] for each in selected]


def _scanned(
    scene: ChainScene, begin: Sequence[ChainCandidate], drivers: Sequence[str], rate: float
) -> ChainScan:
    return standing_out(scene, scan(scene, ChainAcceptance(scene, drivers, rate), rate=rate, begin=begin))


def _are_same(some: Sequence[ChainCandidate], others: Sequence[ChainCandidate]) -> bool:
    return {id(each) for each in some} == {id(each) for each in others}


def _is_among(candidate: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    return any(candidate is other for other in others)
