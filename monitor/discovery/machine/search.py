"""The scan of a chain: with gears where some stand out of what it leaves, with tables instead of several shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.joints.joint_curves import all_curves_were_searched
from monitor.discovery.machine.missing import standing_out
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.gears import gear_variants
from monitor.discovery.machine.shapes.tables import ChainScan, with_tables
from monitor.discovery.machine.shapes.unknown_shapes import with_unknown_shapes
from monitor.discovery.machine.suspects.wander import with_base_instead
from monitor.discovery.search.scan import by_error_taken_away, scan

# More orders of gears than this are noise that no order explains.
MOST_GEARS = 12


def search_chain(scene: ChainScene, drivers: Sequence[str], rate: float) -> tuple[ChainScene, ChainScan]:
    """Scan a scene; where gears stand out of what it leaves, once more with them; at last with tables instead of
    several shapes. Return the scene with the candidates that were added."""

    def scanned(
        scene: ChainScene, begin: Sequence[ChainCandidate], shared: Sequence[ChainCandidate] = ()
    ) -> ChainScan:
        return scan(scene, ChainAcceptance(scene, drivers, rate, shared), rate=rate, begin=begin)

    gears: set[str] = set()
    selected: Sequence[ChainCandidate] = ()
    while True:
        result = standing_out(scene, scanned(scene, selected))
        selected = result.candidates
        variants = gear_variants(scene, result.candidates, rate)
        new = [variant for variant in variants if variant.effect.text not in gears]
        if not new or len(gears) > MOST_GEARS:
            if not all_curves_were_searched(scene.fit):
                scene, result = with_tables(scene, result, scanned)
            result = with_base_instead(scene, result, rate)
            scene, result = with_unknown_shapes(scene, standing_out(scene, result))
            return scene, by_error_taken_away(scene, standing_out(scene, result))
        gears |= {variant.effect.text for variant in new}
        scene = replace(scene, candidates=(*scene.candidates, *scene_of(scene.fit, new).candidates))
