"""A step within a run in place of what a search named, or where it named nothing: looked for when the search has ended,
and searched beside once more."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from monitor.discovery.machine.compare import compare
from monitor.discovery.machine.evidence.poses import poses_of_rows
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.missing import name_of
from monitor.discovery.machine.nearest import in_independent_noise, leading
from monitor.discovery.machine.rounds import ChainRound, ChainSearch
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, MachineEffect, scene_of
from monitor.discovery.machine.suspects.stepped_within import SteppedWithin, stepped_within
from monitor.discovery.machine.suspects.suspects import with_effects
from monitor.effects.driver import HeatDriver
from monitor.exceptions import DataError
from monitor.records import Verdict


class BesideStep(NamedTuple):
    """A search with the step within a run in its problem, if there is one, the fit that it begins with, and its last
    round."""

    first: Fit
    search: ChainSearch
    latest: ChainRound
    stepped: SteppedWithin | None


def searched_beside_step(first: Fit, search: ChainSearch, latest: ChainRound) -> BesideStep:
    """Search once more beside the step within a run that a search shows; that search where it shows none.

    Where neighbours share noise that walks, a drift beside the step may be what is left of both: it has to be one that
    was named without the step.
    """
    as_it_was = BesideStep(first, search, latest, None)
    stepped = step_within_run(latest, search.rate)
    if stepped is None:
        return as_it_was
    problem = with_effects(search.problem, [stepped.effect])
    try:
        beside = fit(problem, search.gross.left_out(problem), first)
    except (DataError, np.linalg.LinAlgError):
        return as_it_was
    search = replace(search, problem=problem)
    again = search.under(beside)
    named = [finding.candidate for finding in again.refined]
    if any(_is_drift(each.effect) and each.family not in latest.families for each in named):
        variants = [
            each for each in search.variants if not _is_drift(each.effect) or each.family in latest.families
        ]
        again = replace(search, variants=variants).under(beside)
    return BesideStep(beside, search, again, stepped)


def _is_drift(effect: MachineEffect) -> bool:
    """Whether an effect follows the time or a temperature."""
    return isinstance(effect.driver, HeatDriver)


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
    drifts = [each for each in named if _is_drift(each.effect)]
    rest = [each for each in named if all(each is not drift for drift in drifts)]
    if drifts:
        yield rest, drifts
    if rest:
        yield [], [*named]
