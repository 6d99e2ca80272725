"""What stands beside steps: no flexible shape follows a jump, so that it hides other errors until it is told."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from monitor.discovery.machine.scene import ChainCandidate, ChainScene
from monitor.discovery.machine.shapes.flexible import error_of
from monitor.discovery.machine.shapes.free_parts import priced
from monitor.discovery.machine.shapes.scale_steps import StepsOfError
from monitor.discovery.machine.shapes.shown_cycles import is_cycle
from monitor.discovery.machine.shapes.tables import ChainScan
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.effects import ChainEffect
from monitor.effects.drivers import Always
from monitor.effects.shapes import Step

# What is found beside steps moves them, and beside these the search goes on, so often at most.
MOST_TURNS = 3
#: A scan of a scene that begins with effects.
Scanned = Callable[[ChainScene, Sequence[ChainCandidate]], ChainScan]


def with_those_beside_steps(
    scene: ChainScene, result: ChainScan, scanned: Scanned
) -> tuple[ChainScene, ChainScan]:
    """The findings with the steps among them where they say most beside the others, and with what a scan finds beside
    them."""
    for _ in range(MOST_TURNS):
        if not any(map(has_steps, result.candidates)):
            break
        scene, result = _with_steps_anew(scene, result)
        further = scanned(scene, result.candidates)
        if {each.family for each in further.candidates} <= {each.family for each in result.candidates}:
            break
        result = further
    return scene, result


def has_steps(candidate: ChainCandidate) -> bool:
    """Return whether an effect jumps at readings of its axis, whatever happens besides."""
    effect = candidate.effect
    return (
        isinstance(effect, ChainEffect)
        and isinstance(effect.shape, Step)
        and isinstance(effect.driver, Always)
    )


def _with_steps_anew(scene: ChainScene, result: ChainScan) -> tuple[ChainScene, ChainScan]:
    """The findings with the steps that say most beside those of other errors, in place of the steps among them and of
    what stands beside these, where that says more; and the scene with them."""
    selected = result.candidates
    for steps in _of_different_errors(filter(has_steps, result.candidates)):
        effect = steps.effect
        assert isinstance(effect, ChainEffect)
        mine = [each for each in selected if error_of(each) == error_of(steps) and not is_cycle(each)]
        others = [each for each in selected if not any(each is some for some in mine)]
        anew = StepsOfError(scene, effect).beside(others)
        if anew and priced(scene, anew, others) > priced(scene, mine, others):
            selected = [*others, *anew]
            gone = list(filter(has_steps, mine))
            without_steps = [each for each in scene.candidates if not any(each is some for some in gone)]
            scene = replace(scene, candidates=(*without_steps, *filter(has_steps, anew)))
    return (
        (scene, result)
        if selected is result.candidates
        else (scene, ScanResult(findings_of(scene, selected)))
    )


def _of_different_errors(steps: Iterable[ChainCandidate]) -> list[ChainCandidate]:
    """One of the steps of each error: those of one over several widths are sought together."""
    return list({error_of(each): each for each in steps}.values())
