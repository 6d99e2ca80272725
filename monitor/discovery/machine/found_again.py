"""What was found under one noise of neighbours, found again under another: verified by scans that begin with it, in
place of a whole search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.missing import standing_out
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import is_free, of_parts, parts_anew
from monitor.discovery.machine.shapes.gears import gear_variants
from monitor.discovery.machine.shapes.scale_steps import steps_of
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.machine.shapes.teeth import teeth_of
from monitor.discovery.machine.suspects.station_moves import station_moves
from monitor.discovery.search.scan import ScanResult, by_error_taken_away, except_for, findings_of, scan
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shapes import Nodes, Sawtooth, Step

# Parts and edges chosen anew that have not settled after so many turns are searched.
MOST_TURNS = 4


class Found(NamedTuple):
    """A scene and what a search of it found."""

    scene: ChainScene
    result: ChainScan


def still_found(scene: ChainScene, near: Found, drivers: Sequence[str], rate: float) -> ChainScan | None:
    """What a scan that begins with the findings in a ``near`` scene of the same candidates finds, where it is these and
    nothing else, and parts of free shapes would be chosen as there; else None."""
    begin = _in_scene(scene, near.result.candidates)
    result = _scanned(scene, begin, ChainAcceptance(scene, drivers, rate))
    if not _are_same(result.candidates, begin):
        return None
    if parts_anew(scene, begin) != parts_anew(near.scene, near.result.candidates):
        return None
    return by_error_taken_away(scene, result)


def found_in_other_noise(
    scene: ChainScene, first: Callable[[], ChainScan], earlier: Found, drivers: Sequence[str], rate: float
) -> Found | None:
    """What was found under an ``earlier`` noise without what is noise under this one, of which ``first`` tells what the
    first scan finds: steady effects stand by the places that were measured, whatever the noise.

    None where a scan that begins with them adds to them, where the first scan does not name a drift or the error of
    what has edges, or where something new stands out.
    """
    texts = {candidate.effect.text for candidate in scene.candidates}
    # Shapes that were searched for under that noise are asked for where they stand, and chosen anew.
    catalogued = [each for each in earlier.scene.candidates if not _is_searched(each)]
    lacking = [each.variant for each in catalogued if each.effect.text not in texts]
    scene = replace(scene, candidates=(*scene.candidates, *scene_of(scene.fit, lacking).candidates))
    begin = _in_scene(scene, earlier.result.candidates)
    result = _settled(scene, begin, first, ChainAcceptance(scene, drivers, rate))
    if result is None:
        return None
    standing = result.candidates
    is_sound = _only_noise_fell(begin, standing) and _is_named_by(first, standing)
    if not is_sound or _stands_out(scene, standing, rate):
        return None
    new = [each for each in standing if not _is_among(each, scene.candidates)]
    scene = replace(scene, candidates=(*scene.candidates, *new))
    return Found(scene, by_error_taken_away(scene, result))


def _settled(
    scene: ChainScene,
    begin: Sequence[ChainCandidate],
    first: Callable[[], ChainScan],
    rules: ChainAcceptance,
) -> ChainScan | None:
    """What stands of the effects to ``begin`` with, in parts and edges chosen anew, once these stay; None where a scan
    adds to them, or nothing stands."""
    standing, result = list(begin), None
    for _ in range(MOST_TURNS):
        shaped = _shaped_anew(scene, standing)
        if result is not None and _are_same(shaped, standing):
            return result
        result = _without_other_shapes(scene, shaped, _scanned(scene, shaped, rules), first)
        standing = [each for each in shaped if _is_among(each, result.candidates)]
        if not standing or len(standing) < len(result.findings):
            return None
    return None


def _only_noise_fell(begin: Sequence[ChainCandidate], standing: Sequence[ChainCandidate]) -> bool:
    """Whether all errors that do not stand any more are what noise of neighbours may do: drifts, and free shapes."""
    errors = {error_of(each) for each in standing}
    fallen = [each for each in begin if error_of(each) not in errors]
    return all(is_free(each) or not is_steady(each) for each in fallen)


def _is_named_by(first: Callable[[], ChainScan], standing: Sequence[ChainCandidate]) -> bool:
    """Whether a first scan names the same drifts, and all errors of which edges stand; it may name drifts of an error
    that stands in a free shape, a table or edges. It is not asked where neither stands."""
    with_edges = {error_of(each) for each in standing if _has_edges(each)}
    drifts = _names_of_drifts(standing)
    if not with_edges and not drifts:
        return True
    candidates = first().candidates
    searched = {error_of(each) for each in standing if _is_searched(each)}
    named = [each for each in candidates if error_of(each) not in searched]
    has_drifts = not drifts or drifts == _names_of_drifts(named)
    return has_drifts and with_edges <= {error_of(each) for each in candidates}


def _without_other_shapes(
    scene: ChainScene, begin: Sequence[ChainCandidate], result: ChainScan, first: Callable[[], ChainScan]
) -> ChainScan:
    """A result without what it adds to those errors that stand as it began with them: parts of a free shape would say
    that at less than their price, and other shapes count that the first scan of all names, too."""
    still = [each for each in begin if _is_among(each, result.candidates)]
    of_begin = {error_of(each) for each in still}
    free = {error_of(each) for each in still if is_free(each)}
    more = [each for each in result.candidates if not _is_among(each, begin) and error_of(each) in of_begin]
    doubtful = [each for each in more if error_of(each) not in free]
    named = {each.family for each in first().candidates} if doubtful else set()
    without = [each for each in more if error_of(each) in free or each.family not in named]
    standing = [each for each in result.candidates if not _is_among(each, without)]
    return ScanResult(findings_of(scene, standing)) if without else result


def is_steady(candidate: ChainCandidate) -> bool:
    """Whether an effect is the same whenever its axes come to a place: noise of neighbours does nothing like it."""
    effect = candidate.effect
    return isinstance(effect, ChainEffect) and isinstance(effect.driver, Always)


def _names_of_drifts(candidates: Sequence[ChainCandidate]) -> set[str]:
    return {candidate.family for candidate in candidates if not is_steady(candidate)}


def _shaped_anew(scene: ChainScene, selected: Sequence[ChainCandidate]) -> list[ChainCandidate]:
    """The selected effects with the parts of free shapes and the places of edges chosen anew, each beside the others as
    they were; without those of which none is worth its price."""
    parts_of_each = iter(parts_anew(scene, selected))
    shaped: list[ChainCandidate] = []
    for index, effect in enumerate(selected):
        mine = [each for each in selected if error_of(each) == error_of(effect)]
        if is_free(effect):
            if parts := next(parts_of_each):
                shaped += _anew([effect], [_free(scene, effect, parts, except_for(selected, index))])
        elif not any(map(_has_edges, mine)):
            shaped.append(effect)
        elif effect is mine[0]:
            others = [each for each in selected if not _is_among(each, mine)]
            of_error = teeth_of if any(map(_has_teeth, mine)) else steps_of
            edges = of_error(scene, effect)
            shaped += [] if edges is None else _anew(mine, edges.beside(others))
    return shaped


def _free(
    scene: ChainScene, shape: ChainCandidate, parts: Sequence[int], others: Sequence[ChainCandidate]
) -> ChainCandidate:
    """The error of a free shape in other parts."""
    symbol = error_of(shape)
    shapes = [each for each in scene.candidates if error_of(each) == symbol and not is_free(each)]
    return of_parts(scene, symbol, parts, shapes, others)


def _anew(before: Sequence[ChainCandidate], after: Sequence[ChainCandidate]) -> Sequence[ChainCandidate]:
    """The effects ``after`` a new choice, as the candidates ``before`` where they are the same."""
    same = {each.effect.text for each in before} == {each.effect.text for each in after}
    return before if same else after


def _is_searched(candidate: ChainCandidate) -> bool:
    """Whether a search made the shape of an effect out of parts, nodes or edges."""
    effect = candidate.effect
    is_table = isinstance(effect, ChainEffect) and isinstance(effect.shape, Nodes)
    return is_table or is_free(candidate) or _has_edges(candidate)


def _has_teeth(candidate: ChainCandidate) -> bool:
    effect = candidate.effect
    return isinstance(effect, ChainEffect) and isinstance(effect.shape, Sawtooth)


def _has_edges(candidate: ChainCandidate) -> bool:
    """Whether the place of an edge was searched."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect) and isinstance(effect.shape, Sawtooth | Step) and is_steady(candidate)
    )


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


def _scanned(scene: ChainScene, begin: Sequence[ChainCandidate], rules: ChainAcceptance) -> ChainScan:
    return standing_out(scene, scan(scene, rules, rate=rules.rate, begin=begin))


def _are_same(some: Sequence[ChainCandidate], others: Sequence[ChainCandidate]) -> bool:
    return {id(each) for each in some} == {id(each) for each in others}


def _is_among(candidate: ChainCandidate, others: Sequence[ChainCandidate]) -> bool:
    return any(candidate is other for other in others)
