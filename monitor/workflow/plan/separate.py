"""Poses that separate two effects which the plan alone may not separate."""

from __future__ import annotations

import numpy as np

from monitor.discovery import Fit
from monitor.discovery.machine.scene import MachineEffect
from monitor.discovery.machine.separation.distances import DECIDES
from monitor.discovery.machine.separation.separate import Separation, separating_poses
from monitor.effects import parse_effect
from monitor.records import Array, Campaign
from monitor.store import StoredModel
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.explain.explain_answer import DeviationsApart
from monitor.workflow.identify.fitting import machine_fit
from monitor.workflow.plan.answer import SeparationAnswer, SeparationVerdict
from monitor.workflow.plan.strokes import strokes_of

#: The size at the tip for which effects are separated.
SEPARATED_PEAK = MICROMETRE.to_internal(5.0)


def separation(campaign: Campaign, model: StoredModel, texts: tuple[str, str]) -> SeparationAnswer:
    """Poses to probe at besides the campaign's own, so that the first effect is not taken for the second.

    Raises EffectError for an effect that the machine does not have.
    """
    return separation_of(machine_fit(campaign, model), campaign, texts)


def separation_of(fitted: Fit, campaign: Campaign, texts: tuple[str, str]) -> SeparationAnswer:
    """The poses for a model that is ``fitted`` to its campaign. Raises EffectError."""
    context = fitted.problem.context
    effect, rival = (parse_effect(text, context.chain) for text in texts)
    basis = effect.basis(context)
    displacement = fitted.moved_by(basis) @ np.ones(basis.size)
    largest = float(np.linalg.norm(displacement, axis=1).max())
    size = SEPARATED_PEAK / largest if largest > 0.0 else 1.0
    poses = _separation(fitted, campaign, effect, rival, np.full(basis.size, size))
    return SeparationAnswer(
        effects=(effect.text, rival.text),
        peak_um=MICROMETRE.to_display(SEPARATED_PEAK),
        poses=tuple(
            {
                f"{name.lower()}_deg": round(context.chain.joint(name).sign * DEGREE.to_display(angle), 4)
                + 0.0
                for name, angle in pose.items()
            }
            for pose in poses.poses
        ),
        standard_deviations_apart=DeviationsApart(poses.before, poses.after),
        verdict=_verdict(poses),
    )


def deviations_apart(fitted: Fit, campaign: Campaign, texts: tuple[str, str], coefficients: Array) -> float:
    """How many standard deviations the present plan tells an effect of these coefficients from a rival."""
    effect, rival = (parse_effect(text, fitted.problem.context.chain) for text in texts)
    return _separation(fitted, campaign, effect, rival, coefficients).before


def _separation(
    fitted: Fit, campaign: Campaign, effect: MachineEffect, rival: MachineEffect, coefficients: Array
) -> Separation:
    context = fitted.problem.context
    rotary, linear = strokes_of(campaign, context.chain, context.positions)
    return separating_poses(fitted, effect, coefficients, [rival], {**rotary, **linear})


def _verdict(separation: Separation) -> SeparationVerdict:
    if separation.poses:
        return SeparationVerdict.WITH_POSES
    return SeparationVerdict.ALREADY if separation.before > DECIDES else SeparationVerdict.IMPOSSIBLE
