"""What a plan of balls at indexations promises: expected uncertainties, what it costs, and what it cannot see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.discovery import Fit, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.effects.catalogue import catalogue
from monitor.machine import Chain
from monitor.methods.planning.candidates import Choice
from monitor.methods.planning.search import best_plan
from monitor.methods.planning.touches import planned_context
from monitor.records import Array
from monitor.uncertainty.coverage_regions.coverage import rectangle_factor
from monitor.units import DEGREE
from monitor.workflow.plan.answer import BallPlan, BallSubset, PlannedParameter, Pose
from monitor.workflow.plan.candidates import PlannedCampaign


def ball_plan(planned: PlannedCampaign, choice: Choice, p: float) -> BallPlan:
    """A plan with the uncertainties that it promises, against the present one."""
    touches, expected = planned.candidates.touches, choice.expected
    units, chain = planned.problem.base_units, planned.problem.context.chain
    k = rectangle_factor(max(int(expected.determined.sum()), 1), p)
    merit = _merit(planned.present, choice)
    return BallPlan(
        balls=tuple(touches.targets[ball] for ball in choice.balls),
        ball_places_mm={
            touches.targets[ball]: tuple(round(float(value), 3) for value in planned.places[ball])
            for ball in choice.balls
        },
        poses=tuple(_pose(chain, touches.poses[pose]) for pose in choice.poses),
        probings=int(choice.touched.sum()),
        seconds=choice.seconds,
        k_q=k,
        parameters={
            name: PlannedParameter(
                u=_finite(units[name].to_display(u)),
                expanded=_finite(units[name].to_display(k * u)),
                unit=units[name].name,
                figure_of_merit=_finite(figure_of_merit),
                separation=float(separation),
            )
            for name, u, separation, figure_of_merit in zip(
                expected.names, map(float, expected.u), expected.separation, merit, strict=True
            )
        },
        refused=tuple(
            name
            for name, determined in zip(expected.names, expected.determined, strict=True)
            if not determined
        ),
    )


def _merit(present: Choice, choice: Choice) -> list[float]:
    """What a plan says of every parameter in an hour, against the present plan."""
    rows = zip(map(float, present.expected.u), map(float, choice.expected.u), strict=True)
    return [
        (before / u) ** 2 * present.seconds / choice.seconds if u > 0.0 else float("nan")
        for before, u in rows
    ]


def _pose(chain: Chain, positions: Array) -> Pose:
    return {
        f"{joint.name.lower()}_deg": round(joint.sign * DEGREE.to_display(float(position)), 4) + 0.0
        for joint, position in zip(chain.joints, positions, strict=True)
        if joint.turns
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def best_subsets(planned: PlannedCampaign) -> tuple[BallSubset, ...]:
    """The best subset of each size of the campaign's own balls, at its own indexations."""
    targets, present = planned.candidates.touches.targets, planned.present
    units = planned.problem.base_units
    candidates = replace(planned.candidates, balls=present.balls)
    subsets = []
    for count in range(1, len(present.balls) + 1):
        choice = best_plan(candidates, count, present=present.poses)
        u = {
            name: _finite(units[name].to_display(float(u)))
            for name, u in zip(choice.expected.names, choice.expected.u, strict=True)
        }
        subsets.append(BallSubset(tuple(targets[ball] for ball in choice.balls), choice.seconds, u))
    return tuple(subsets)


def blind_spots(planned: PlannedCampaign, choice: Choice) -> tuple[str, ...]:
    """Undriven effects of the catalogue of which one run of the plan shows nothing."""
    chain = planned.problem.context.chain
    base = [effect.text for effect in planned.problem.base]
    pitches = {
        name: axis.scale_pitch
        for name, axis in planned.campaign.machine.axes.items()
        if axis.scale_pitch is not None
    }
    variants = [variant for effect in catalogue(chain, base, (), pitches) for variant in variants_of(effect)]
    visible = scene_of(_fit_of(planned, choice), variants)
    return tuple(
        dict.fromkeys(candidate.family for candidate in visible.candidates if not candidate.detectable)
    )


def _fit_of(planned: PlannedCampaign, choice: Choice) -> Fit:
    """The plan as a fit of perfect readings of one run."""
    touches, places = planned.candidates.touches, planned.places
    pose, target = np.nonzero(choice.touched)
    context = planned_context(
        planned.problem.context,
        touches.positions[pose, target],
        [touches.targets[index] for index in target],
        places[target],
        pose,
    )
    distances = tuple(
        replace(distance, length=np.array([np.linalg.norm(places[bar.first] - places[bar.second])]))
        for distance, bar in zip(planned.problem.distances, touches.bars, strict=True)
    )
    sigma = np.full((len(context), 3), touches.sigma)
    return fit(replace(planned.problem, context=context, sigma=sigma, distances=distances, added=()))
