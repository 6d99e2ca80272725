"""The scan of a chain: with gears and drifts of one run where some stand out of what it leaves, with tables instead of
several shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.found_again import Found
from monitor.discovery.machine.joints.joint_curves import all_curves_were_searched
from monitor.discovery.machine.missing import standing_out
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, ChainVariant, scene_of
from monitor.discovery.machine.separation.drive_first import drive_first
from monitor.discovery.machine.shapes.axes_of_plate import axes_of_plate
from monitor.discovery.machine.shapes.beside_steps import with_those_beside_steps
from monitor.discovery.machine.shapes.drift_instead import drift_instead
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.machine.shapes.gears import gear_variants
from monitor.discovery.machine.shapes.long_waves import without_longest
from monitor.discovery.machine.shapes.one_instead import one_instead
from monitor.discovery.machine.shapes.plate_instead import plate_instead
from monitor.discovery.machine.shapes.several_instead import several_instead
from monitor.discovery.machine.shapes.shapes_of_model import (
    beside_free_shapes,
    may_be_mimics,
    under_the_model,
)
from monitor.discovery.machine.shapes.tables import ChainScan, with_tables
from monitor.discovery.machine.shapes.unknown_shapes import with_unknown_shapes
from monitor.discovery.machine.suspects.station_moves import may_be_a_move, station_moves
from monitor.discovery.machine.suspects.wander import with_base_instead
from monitor.discovery.search.scan import by_error_taken_away, scan
from monitor.effects.artefact.station import Moved

# More orders of gears, drifts, and moves of a station than these are noise that none explains.
MOST_GEARS, MOST_DRIFTS, MOST_MOVES = 12, 60, 4


def search_chain(
    scene: ChainScene, drivers: Sequence[str], rate: float, first: ChainScan | None = None
) -> Found:
    """Scan a scene, and where a free shape of the model does not follow its error, once more beside all that this error
    could do; return the scene with the candidates that were added. ``first`` is what `first_found` says, if that is
    known."""
    searched, result = _searched(scene, drivers, rate, first)
    if may_be_mimics(searched, result.candidates, rate):
        beside = beside_free_shapes(scene)
        searched, result = under_the_model(scene, *_searched(beside, drivers, rate))
    searched, result = drive_first(searched, standing_out(searched, result))
    return Found(searched, by_error_taken_away(searched, result))


def first_found(scene: ChainScene, drivers: Sequence[str], rate: float) -> ChainScan:
    """What the first scan of a search finds."""
    return standing_out(scene, scan(scene, ChainAcceptance(scene, drivers, rate), rate=rate))


def _searched(
    scene: ChainScene, drivers: Sequence[str], rate: float, first: ChainScan | None = None
) -> tuple[ChainScene, ChainScan]:
    """Scan a scene; where gears, drifts of one run or moves of the station stand out of what it leaves, once more with
    them; at last with tables instead of several shapes."""

    def scanned(
        scene: ChainScene, begin: Sequence[ChainCandidate], shared: Sequence[ChainCandidate] = ()
    ) -> ChainScan:
        return scan(scene, ChainAcceptance(scene, drivers, rate, shared), rate=rate, begin=begin)

    gears: set[str] = set()
    drifts: set[str] = set()
    moves: set[str] = set()
    first_moments: dict[type[Moved], tuple[ChainCandidate, ...]] = {}
    result = first or first_found(scene, drivers, rate)
    while True:
        selected = result.candidates
        new = _not_yet(gear_variants(scene, selected, rate), gears, MOST_GEARS)
        new += _not_yet(drifts_of_runs(scene, selected, rate), drifts, MOST_DRIFTS)
        moved = _not_yet(station_moves(scene, selected, rate, first_moments), moves, MOST_MOVES)
        if moved:
            # Several drifts together are what comes nearest to one move: each has to stand beside it.
            selected = [candidate for candidate in selected if not may_be_a_move(candidate)]
        new += moved
        if not new:
            if not all_curves_were_searched(scene.fit):
                tabled = with_tables(scene, result, scanned)
                # A table that does not stand out would leave nothing of the shapes that it took the place of.
                if len(standing_out(*tabled).findings) == len(tabled[1].findings):
                    scene, result = tabled
            result = with_base_instead(scene, result, rate)
            plain, catalogued = scene, standing_out(scene, result)
            shaped = with_unknown_shapes(plain, catalogued)
            scene, result = several_instead(
                plain,
                with_those_beside_steps(*shaped, lambda *of: standing_out(of[0], scanned(*of))),
                partial(_in_their_own_shapes, plain, catalogued, drivers, rate),
            )
            accepts = ChainAcceptance(scene, drivers, rate).accepts
            scene, result = without_longest(*one_instead(scene, result, accepts))
            scene, result = drift_instead(scene, result, drivers, accepts)
            return axes_of_plate(*plate_instead(scene, result, accepts), accepts)
        scene = replace(scene, candidates=(*scene.candidates, *scene_of(scene.fit, new).candidates))
        result = standing_out(scene, scanned(scene, selected))


def _in_their_own_shapes(
    scene: ChainScene, begin: ChainScan, drivers: Sequence[str], rate: float
) -> ChainScan:
    """A scan in which no error may have another shape than the one that was found."""
    rules = ChainAcceptance(scene, drivers, rate, any_shape=False)
    return standing_out(scene, scan(scene, rules, rate=rate, begin=begin.candidates))


def _not_yet(variants: Sequence[ChainVariant], searched: set[str], most: int) -> list[ChainVariant]:
    """The variants that were not searched yet, which are from now on; none where more than ``most`` were."""
    new = [variant for variant in variants if variant.effect.text not in searched]
    if len(searched) > most:
        return []
    searched |= {variant.effect.text for variant in new}
    return new
