"""The effect that comes nearest where none is named, and why it is not: whoever reads that nothing explains more would
look no further, although an effect leaves half of the error.

It is the one that says most of all in independent noise, in which it stands out; where none does, chance explains all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.evidence.refusal import Refusal
from monitor.discovery.machine.missing import name_of
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.machine.shapes.gears import gear_variants
from monitor.discovery.machine.suspects.stepped_within import SteppedWithin
from monitor.discovery.search.evidence import Evidence, pool_of, weigh_beside
from monitor.discovery.search.scene import family_count


@dataclass(frozen=True)
class Nearest:
    """An effect that is not named because of a ``refusal``, and the root mean square in mm that would be left of
    ``rms_before`` with it in the model."""

    effect: str
    rms_before: float
    rms_after: float
    refusal: Refusal


def in_independent_noise(scene: ChainScene) -> ChainScene:
    """The scene as if neighbours shared no noise."""
    if scene.fit.whitening is None:
        return scene
    return scene_of(scene.fit.with_correlation(None), [candidate.variant for candidate in scene.candidates])


def leading(scene: ChainScene, rate: float) -> tuple[ChainScene, ChainCandidate] | None:
    """The effect that says most in the independent noise of a scene, with what is searched only where it stands out;
    None where it does not stand out at a ``rate``."""
    white = in_independent_noise(scene)
    # What is searched only where it stands out was searched in the noise of the scene.
    later = [*gear_variants(white, (), rate), *drifts_of_runs(white, (), rate)]
    searched = {candidate.effect.text for candidate in scene.candidates}
    more = scene_of(white.fit, [each for each in later if each.effect.text not in searched]).candidates
    white = replace(white, candidates=(*white.candidates, *more))
    weighed = weigh_beside(white, pool_of(white), ())
    if not weighed or weighed[0].p_value * family_count(white) > rate:
        return None
    return white, weighed[0].candidate


def nearest_effect(scene: ChainScene, drivers: Sequence[str], rate: float) -> Nearest | None:
    """The effect of a scene in which none was found that says most in independent noise; None where it does not stand
    out at a ``rate`` there."""
    leads = leading(scene, rate)
    if leads is None:
        return None
    white, first = leads
    return Nearest(
        effect=name_of(first),
        rms_before=white.fit.rms_of(white.remainders.beside(()).residual),
        rms_after=white.fit.rms_of(white.remainders.beside([first]).residual),
        refusal=_why(scene, first, drivers, rate),
    )


def outdone_by(stepped: SteppedWithin, scene: ChainScene, named: Sequence[ChainCandidate]) -> Nearest:
    """The first of the effects that were named in a scene, in the place of which a step within a run says far more."""
    white = scene_of(scene.fit.with_correlation(None), [named[0].variant])
    return Nearest(
        effect=name_of(named[0]),
        rms_before=stepped.rms_before,
        rms_after=white.fit.rms_of(white.remainders.beside(white.candidates).residual),
        refusal=Refusal.STEPPED,
    )


def _why(scene: ChainScene, nearest: ChainCandidate, drivers: Sequence[str], rate: float) -> Refusal:
    """The rule that refuses an effect in the noise of a scene."""
    pool = pool_of(scene)
    evidence: Evidence[ChainCandidate] | None = next(
        (each for each in weigh_beside(scene, pool, ()) if each.candidate.effect.text == nearest.effect.text),
        None,
    )
    if evidence is None or evidence.p_value * family_count(scene) > rate:
        return Refusal.NOISE
    rules = ChainAcceptance(scene, drivers, rate)
    refused = rules.refusal((), evidence.candidate)
    if refused is not None:
        return refused
    # What stands by itself was taken back when what else was found was judged anew.
    return Refusal.UNSETTLED if rules.stands_among(pool, (), evidence) else Refusal.FLIPS
