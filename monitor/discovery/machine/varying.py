"""What varies from run to run: effects with another size in every run, which a recorded column follows or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.discovery.machine.evidence import Evidence, weigh_in_each_run
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.missing import ChainMissing, Surroundings, tell
from monitor.discovery.machine.refine import refine_all
from monitor.discovery.machine.scan import scan
from monitor.discovery.machine.variants import each_run, with_drivers
from monitor.discovery.machine.visible import Variant, Visible, see
from monitor.effects import ArtefactEffect, ChainEffect

# With fewer runs, another size in every run is no pattern.
FEWEST_RUNS = 3
# One false alarm in a thousand campaigns, so that this search adds little to the scan's own one in a hundred.
FALSE_ALARM = 1e-3
# Others that may vary instead are compared in detail where their evidence comes this close, twice what rules out.
CLOSE = 24.0
MOST_RIVALS = 12


@dataclass(frozen=True)
class Varying:
    """An effect that varies, with what its sizes explain, less their price, in squared standard deviations of
    the residual."""

    effect: ChainEffect | ArtefactEffect
    gain: float


def _weigh(
    fit: Fit, variants: Sequence[Variant], visible: Visible | None = None
) -> tuple[list[Evidence], Visible]:
    seen = see(fit, variants) if visible is None else visible
    # By identity: equal variants are the same objects here, and comparing effects is slow.
    own = {id(one) for one in variants}
    found = weigh_in_each_run(
        [one for one in seen.candidates if id(one.variant) in own and one.detectable], seen
    )
    return sorted(found, key=lambda one: -one.score), seen


def most_varying(fit: Fit, variants: Sequence[Variant], visible: Visible | None = None) -> Varying | None:
    """The effect that, with another size in every run, explains most of what the model leaves; None if none does.

    ``visible`` is what the fit shows of all ``variants``, where that is known.
    """
    if len(fit.problem.runs) < FEWEST_RUNS:
        return None
    known = {effect.text for effect in fit.problem.added}
    bare = [
        one
        for one in variants
        if one.tries == 1 and (own := each_run(one.effect)) is not None and own.effect.text not in known
    ]
    found, seen = _weigh(fit, bare, visible)
    if not found or found[0].p_value * len(found) > FALSE_ALARM:
        return None
    best = found[0]
    left = float(seen.residual @ seen.residual) - best.explained
    freedom = max(seen.degrees_of_freedom - best.rank, 1)
    gain = best.explained * freedom / left - best.rank * np.log(seen.degrees_of_freedom)
    return Varying(best.candidate.variant.effect, float(gain))


def tell_varying(
    steady: Fit,
    effects: Sequence[ChainEffect | ArtefactEffect],
    others: Sequence[Variant],
    rate: float,
    known: Surroundings,
) -> tuple[ChainMissing, ...]:
    """Everything that is told of effects that vary; ``steady`` is the fit with all else that was found, ``others``
    the effects that may be their rivals.

    Where a recorded column follows the sizes, the effect with that driver explains as much with one coefficient,
    and is the finding.
    """
    found, _ = _weigh(steady, [one for one in others if one.tries == 1 and each_run(one.effect) is not None])
    close = [one for one in found if one.score > found[0].score - CLOSE][:MOST_RIVALS] if found else []
    names = {effect.text for effect in effects}
    near = [*effects, *(one.candidate.variant.effect for one in close if one.candidate.family not in names)]
    variants = [variant for effect in near if (variant := each_run(effect)) is not None]
    variants += [variant for effect in effects for variant in with_drivers(effect, known.drivers)]
    seen = see(steady, variants)
    result = scan(seen, rate=rate, most=len(effects))
    return tell(steady, seen, result, refine_all(steady, seen, result), known)
