"""A step within a run in place of what a search named, or where it named nothing: looked for when the search has ended,
and searched beside once more."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from monitor.discovery.machine.compare import compare
from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.missing import name_of
from monitor.discovery.machine.nearest import in_independent_noise, leading
from monitor.discovery.machine.rounds import ChainRound
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.suspects.stepped_within import SteppedWithin, stepped_within
from monitor.effects.driver import HeatDriver
from monitor.records import Verdict


def step_within_run(latest: ChainRound, rate: float) -> SteppedWithin | None:
    """The step that says far more than the drifts that a round named, or than all of what it named; where it named
    nothing although something is missing, than any effect."""
    if poses_of_rows(latest.scene.fit) is not None:
        return None
    named = [finding.candidate for finding in latest.refined]
    if not named:
        unexplained = compare(latest.under, "", "").verdict is Verdict.SOMETHING_IS_MISSING
        leads = leading(latest.scene, rate) if unexplained else None
        return stepped_within(leads[0], (), [leads[1]], rate) if leads is not None else None
    white, named = _with_named(in_independent_noise(latest.scene), named)
    for rest, drifts in _in_place_of(named):
        stepped = stepped_within(white, rest, drifts, rate)
        if stepped is not None:
            return replace(stepped, instead_of=tuple(name_of(drift) for drift in drifts))
    return None


def _with_named(
    scene: ChainScene, named: Sequence[ChainCandidate]
) -> tuple[ChainScene, list[ChainCandidate]]:
    """A scene with what was named among its candidates, at the values that were searched."""
    more = scene_of(scene.fit, [candidate.variant for candidate in named]).candidates
    texts = {candidate.effect.text for candidate in more}
    rest = [candidate for candidate in scene.candidates if candidate.effect.text not in texts]
    return replace(scene, candidates=(*rest, *more)), [*more]


def _in_place_of(
    named: Sequence[ChainCandidate],
) -> Iterator[tuple[list[ChainCandidate], list[ChainCandidate]]]:
    """What may stay beside a step, and what it would take the place of: the drifts, or all that was named."""
    drifts = [each for each in named if isinstance(each.effect.driver, HeatDriver)]
    rest = [each for each in named if all(each is not drift for drift in drifts)]
    if drifts:
        yield rest, drifts
    if rest:
        yield [], [*named]
