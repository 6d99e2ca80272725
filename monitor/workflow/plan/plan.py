"""Plans before anyone measures: expected uncertainties, blind spots, the best balls and indexations, next poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from monitor.documents import to_document
from monitor.exceptions import InputError
from monitor.methods import AnglePlan, InstrumentPlan, campaign_method
from monitor.methods.planning.candidates import Choice
from monitor.methods.planning.search import best_plan, quickest_plan
from monitor.records import Campaign
from monitor.store import Database, StoredModel, save_analysis
from monitor.units import MICROMETRE
from monitor.workflow.measured import machine_campaign
from monitor.workflow.models import label, resolve_for
from monitor.workflow.plan.angles import plan_angles
from monitor.workflow.plan.answer import BallPlanAnswer, PlanAnswer, TimeAnswer
from monitor.workflow.plan.balls import ball_plan, best_subsets, blind_spots
from monitor.workflow.plan.candidates import PlannedCampaign, planned
from monitor.workflow.plan.instruments import plan_instruments
from monitor.workflow.plan.request import PlanRequest
from monitor.workflow.plan.separate import separation


def plan(db: Database, request: PlanRequest) -> PlanAnswer:
    """What a campaign's plan promises, and a better one where numbers or uncertainties are wanted; stored.

    Raises InputError, DataError, NotFoundError, EffectError.
    """
    campaign = machine_campaign(db, request.campaign, "plan", lambda method: method.plan)
    model = resolve_for(db, request.model, campaign.method, campaign.machine.id)
    method = campaign_method(campaign).plan
    if request.keep and isinstance(method, AnglePlan):
        raise InputError(f"{campaign.name} is planned by angles of a table; there are no indexations to keep")
    if request.parameters and not isinstance(method, InstrumentPlan):
        raise InputError(
            f"--for: {campaign.name} is no campaign of instruments; name a wanted uncertainty by --wanted, "
            "two effects to be told apart by --separate EFFECT,EFFECT, or leave it out"
        )
    answer: PlanAnswer
    if isinstance(method, AnglePlan):
        answer = plan_angles(method, campaign, model, request)
    elif isinstance(method, InstrumentPlan):
        answer = plan_instruments(method, campaign, model, request)
    else:
        answer = _plan_balls(campaign, model, request)
    save_analysis(
        db, "plan", to_document(answer), method=campaign.method, campaign=campaign.name,
        model=model.name, model_version=model.version,
    )  # fmt: skip
    if request.figures is None or not isinstance(answer, BallPlanAnswer):
        return answer
    # Loaded here: drawing costs a second that a plan without figures need not wait.
    from monitor.workflow.plan.figures import plan_figures

    return replace(answer, figures=plan_figures(answer, request.figures))


def _plan_balls(campaign: Campaign, model: StoredModel, request: PlanRequest) -> BallPlanAnswer:
    """Balls at indexations."""
    weighed = planned(campaign, model, request.balls or 1)
    time = weighed.candidates.time
    proposed = _proposed(weighed, request)
    return BallPlanAnswer(
        campaign=campaign.name,
        machine=campaign.machine.id,
        model=label(model),
        p=request.p,
        stated_uncertainty_um=MICROMETRE.to_display(weighed.candidates.touches.sigma),
        time_model=TimeAnswer(time.probing_s, time.indexation_s, time.source),
        present=ball_plan(weighed, weighed.present, request.p),
        by_balls=best_subsets(weighed),
        blind_spots=blind_spots(weighed, weighed.present),
        wanted=dict(request.wanted) or None,
        proposed=None
        if proposed is None
        else replace(ball_plan(weighed, proposed, request.p), blind_spots=blind_spots(weighed, proposed)),
        separate=None if request.separate is None else separation(campaign, model, request.separate),
    )


def _proposed(weighed: PlannedCampaign, request: PlanRequest) -> Choice | None:
    """The plan that is asked for: the quickest for wanted uncertainties, the best of so many balls and indexations."""
    candidates = weighed.candidates
    if request.keep:
        return _kept(weighed, request.keep)
    if request.wanted:
        units = weighed.problem.base_units
        wanted = {
            name: units[name].to_internal(u) if name in units else u for name, u in request.wanted.items()
        }
        return quickest_plan(candidates, wanted, request.balls or len(candidates.balls))
    if request.balls is None and request.poses is None:
        return None
    balls = len(candidates.balls) if request.balls is None else request.balls
    return best_plan(candidates, balls, request.poses, present=weighed.present.poses)


def _kept(weighed: PlannedCampaign, numbers: tuple[int, ...]) -> Choice:
    """The present plan with some of its indexations alone. Raises InputError for one that it does not have."""
    present = weighed.present
    if max(numbers) > len(present.poses):
        raise InputError(
            f"the plan has {len(present.poses)} indexations; there is no number {max(numbers)} to keep"
        )
    poses = tuple(present.poses[number - 1] for number in sorted(numbers))
    touched = np.zeros_like(present.touched)
    touched[list(poses)] = present.touched[list(poses)]
    return weighed.candidates.choice(poses, present.balls, touched)
