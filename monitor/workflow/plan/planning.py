"""Plans before anyone measures: expected uncertainties, blind spots, the best balls and indexations, next poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from monitor.discovery import Fit, fit
from monitor.discovery.machine.separate import Separation, separating_poses
from monitor.discovery.machine.variants import variants_of
from monitor.discovery.machine.visible import see
from monitor.effects import parse_effect
from monitor.effects.catalogue import catalogue
from monitor.exceptions import InputError
from monitor.machine import Chain
from monitor.methods import AnglePlan, campaign_method
from monitor.methods.chain.expected import planned_context
from monitor.methods.chain.planning import (
    MOST_BALLS,
    Choice,
    best_plan,
    quickest_plan,
)
from monitor.records import Array, Campaign
from monitor.reporting.figures.style import save
from monitor.reporting.figures.volumetric import expected_uncertainties
from monitor.store import Database, StoredModel, load_campaign, save_analysis
from monitor.uncertainty.coverage import rectangle_factor
from monitor.units import DEGREE, MICROMETRE, Unit
from monitor.workflow.figure_files import ENDINGS, make_folder
from monitor.workflow.models import as_model, label, resolve
from monitor.workflow.plan.angles import plan_angles
from monitor.workflow.plan.candidates import Planned, planned, strokes_of

Document = dict[str, Any]
# The size for which effects are told apart, at the tip.
SEPARATED_PEAK = MICROMETRE.to_internal(5.0)


def plan(
    db: Database,
    campaign: str,
    *,
    model: str | None = None,
    balls: int | None = None,
    poses: int | None = None,
    wanted: Mapping[str, float] | None = None,
    separate: tuple[str, str] | None = None,
    p: float = 0.95,
) -> Document:
    """What a campaign's plan promises, and a better one where numbers or uncertainties are wanted; stored.

    ``balls`` and ``poses`` ask for the best plan of so many; ``wanted`` (parameter to display unit) for the quickest
    that reaches these standard uncertainties; ``separate`` for poses that tell two effects apart. Raises InputError,
    DataError, NotFoundError, EffectError.
    """
    if balls is not None and not 1 <= balls <= MOST_BALLS:
        raise InputError(f"--balls {balls}: choose 1 to {MOST_BALLS}")
    loaded = load_campaign(db, campaign)
    stored = resolve(db, model, loaded.method)
    angles = campaign_method(loaded).plan
    if isinstance(angles, AnglePlan):
        if balls is not None or wanted or separate is not None:
            raise InputError(
                f"a plan of the method {loaded.method} is its angles of the table: --poses N proposes the next N "
                "of them"
            )
        return _kept(db, plan_angles(angles, loaded, stored, poses, p), loaded, stored)
    found = planned(loaded, stored, balls or 1)
    units = {
        name: effect.unit
        for effect in found.problem.base
        for name in effect.parameters(found.problem.context)
    }
    there = found.candidates
    document: Document = {
        "campaign": campaign,
        "machine": loaded.machine.id,
        "model": label(stored),
        "p": p,
        "stated_uncertainty_um": MICROMETRE.to_display(there.touches.sigma),
        "time_model": {
            "seconds_a_probing": there.time.probing_s,
            "seconds_an_indexation": there.time.indexation_s,
            "from": there.time.source,
        },
        "present": _choice(found, found.present, units, p),
        "by_balls": _by_balls(found, units),
        "blind_spots": _blind(found, found.present),
    }
    proposed = None
    if wanted:
        internal = {name: units[name].to_internal(u) if name in units else u for name, u in wanted.items()}
        proposed = quickest_plan(there, internal, balls or len(there.balls))
        document["wanted"] = dict(wanted)
    elif balls is not None or poses is not None:
        count = balls if balls is not None else len(there.balls)
        proposed = best_plan(there, count, poses, present=found.present.poses)
    if proposed is not None:
        document["proposed"] = _choice(found, proposed, units, p)
        document["proposed"]["blind_spots"] = _blind(found, proposed)
    if separate is not None:
        document["separate"] = _separate(loaded, stored, separate)
    return _kept(db, document, loaded, stored)


def _kept(db: Database, document: Document, loaded: Campaign, stored: StoredModel) -> Document:
    save_analysis(
        db,
        "plan",
        document,
        method=loaded.method,
        campaign=loaded.name,
        model=stored.name,
        model_version=stored.version,
    )
    return document


def plan_figure(document: Document, folder: Path) -> list[str]:
    """The expected uncertainties of the present plan, and of the proposed one beside them."""
    make_folder(folder)
    present, proposed = document["present"], document.get("proposed")
    names = list(present["parameters"])

    def values(plan: Document) -> list[float]:
        return [np.nan if (u := plan["parameters"][name]["u"]) is None else u for name in names]

    said = f"{len(present['balls'])} balls at {len(present['poses'])} indexations, {present['seconds'] / 60.0:.0f} min"
    if proposed is not None:
        said += f"; proposed {len(proposed['balls'])} at {len(proposed['poses'])}, {proposed['seconds'] / 60.0:.0f} min"
    figure = expected_uncertainties(
        names,
        [present["parameters"][name]["unit"] for name in names],
        values(present),
        None if proposed is None else values(proposed),
        title=f"{document['campaign']}: {said}",
        note=f"Expected standard uncertainties of one run with {document['stated_uncertainty_um']:g} µm a coordinate.",
    )
    return [str(save(figure, folder / f"expected-uncertainties{ending}")) for ending in ENDINGS]


def _pose(chain: Chain, row: Array) -> Document:
    return {
        f"{joint.name.lower()}_deg": round(joint.sign * DEGREE.to_display(float(value)), 4) + 0.0
        for joint, value in zip(chain.joints, row, strict=True)
        if joint.turns
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _choice(found: Planned, choice: Choice, units: Mapping[str, Unit], p: float) -> Document:
    touches, present = found.candidates.touches, found.present
    result, before = choice.expected, present.expected
    k = rectangle_factor(max(int(result.determined.sum()), 1), p)
    parameters: Document = {}
    for place, name in enumerate(result.names):
        u = float(result.u[place])
        # What the plan learns of the parameter in an hour, against the present plan.
        merit = (
            (float(before.u[place]) / u) ** 2 * present.seconds / choice.seconds if u > 0.0 else float("nan")
        )
        parameters[name] = {
            "u": _finite(units[name].to_display(u)),
            "expanded": _finite(units[name].to_display(k * u)),
            "unit": units[name].name,
            "figure_of_merit": _finite(merit),
            "separation": float(result.separation[place]),
        }
    chain = found.problem.context.chain
    return {
        "balls": [touches.targets[place] for place in choice.balls],
        "ball_places_mm": {
            touches.targets[place]: [round(float(value), 3) for value in found.places[place]]
            for place in choice.balls
        },
        "poses": [_pose(chain, touches.poses[place]) for place in choice.poses],
        "probings": int(choice.touched.sum()),
        "seconds": choice.seconds,
        "k_q": k,
        "parameters": parameters,
        "refused": [name for name, seen in zip(result.names, result.determined, strict=True) if not seen],
    }


def _by_balls(found: Planned, units: Mapping[str, Unit]) -> list[Document]:
    """The best subset of each size of the campaign's own balls, at its own indexations."""
    there, present = found.candidates, found.present
    own = replace(there, balls=present.balls)
    table = []
    for count in range(1, len(present.balls) + 1):
        choice = best_plan(own, count, present=present.poses)
        table.append(
            {
                "balls": [there.touches.targets[place] for place in choice.balls],
                "seconds": choice.seconds,
                "u": {
                    name: _finite(units[name].to_display(float(u)))
                    for name, u in zip(choice.expected.names, choice.expected.u, strict=True)
                },
            }
        )
    return table


def _fit_of(found: Planned, choice: Choice) -> Fit:
    """The plan as a fit of perfect readings of one run."""
    touches = found.candidates.touches
    pose, target = np.nonzero(choice.touched)
    places = found.places
    context = planned_context(
        found.problem.context,
        touches.positions[pose, target],
        [touches.targets[t] for t in target],
        places[target],
        pose,
    )
    distances = tuple(
        replace(
            distance,
            length=np.array([np.linalg.norm(places[bar.first] - places[bar.second])]),
        )
        for distance, bar in zip(found.problem.distances, touches.bars, strict=True)
    )
    sigma = np.full((len(context), 3), touches.sigma)
    return fit(replace(found.problem, context=context, sigma=sigma, distances=distances, added=()))


def _blind(found: Planned, choice: Choice) -> list[str]:
    """Undriven effects of the catalogue of which one run of the plan shows nothing."""
    chain = found.problem.context.chain
    known = [effect.text for effect in found.problem.base]
    pitches = {
        name: axis.scale_pitch
        for name, axis in found.campaign.machine.axes.items()
        if axis.scale_pitch is not None
    }
    effects = catalogue(chain, known, (), pitches)
    seen = see(_fit_of(found, choice), [variant for effect in effects for variant in variants_of(effect)])
    return list(dict.fromkeys(one.family for one in seen.candidates if not one.detectable))


def _separate(loaded: Campaign, stored: StoredModel, texts: tuple[str, str]) -> Document:
    if texts[0] == texts[1]:
        raise InputError(f"--separate {texts[0]},{texts[1]}: name two different effects")
    fitted = fit(campaign_method(loaded).problem_of(loaded, as_model(stored)))
    chain = fitted.problem.context.chain
    effect, rival = (parse_effect(text, chain) for text in texts)
    basis = effect.basis(fitted.problem.context)
    moved = fitted.moved_by(basis) @ np.ones(basis.size)
    largest = float(np.linalg.norm(moved, axis=1).max())
    size = SEPARATED_PEAK / largest if largest > 0.0 else 1.0
    rotary, linear = strokes_of(loaded, chain, fitted.problem.context.positions)
    found = separating_poses(fitted, effect, np.full(basis.size, size), [rival], {**rotary, **linear})
    return {
        "effects": [effect.text, rival.text],
        "peak_um": MICROMETRE.to_display(SEPARATED_PEAK),
        "poses": [
            {
                f"{name.lower()}_deg": round(chain.joint(name).sign * DEGREE.to_display(value), 4) + 0.0
                for name, value in pose.items()
            }
            for pose in found.poses
        ],
        "standard_deviations_apart": {"now": found.now, "then": found.then},
        "verdict": _verdict(found),
    }


def _verdict(found: Separation) -> str:
    if found.together:
        return "no pose that this machine reaches tells them apart"
    return "probe at these poses too" if found.poses else "this plan tells them apart already"
