"""A run of the L-shaped piece identified step by step, beside the fit of all parameters at once."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import DataError
from monitor.methods.chain.problem import solve_problem
from monitor.methods.l_shape.method import NAME, LShapeProblem
from monitor.methods.l_shape.stepwise import Step, stepwise
from monitor.store import Database, load_campaign
from monitor.units import Unit
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.identify.answer import StepwiseAnswer, StepwiseParameter
from monitor.workflow.identify.fitting import machine_problem
from monitor.workflow.identify.request import StepwiseRequest
from monitor.workflow.models import resolve


def identify_stepwise(db: Database, request: StepwiseRequest) -> StepwiseAnswer:
    """One run by both ways, with what tells them apart.

    Raises NotFoundError for an unknown campaign or run, DataError for a campaign of another method.
    """
    campaign = load_campaign(db, request.campaign)
    if campaign.method != NAME:
        raise DataError(
            f"campaign {request.campaign} was measured by {campaign.method}; only {NAME} has a stepwise way"
        )
    number = max(run.run for run in campaign.runs) if request.run is None else request.run
    campaign = only_run(campaign, number)
    problem = machine_problem(campaign, resolve(db, request.model, campaign.method))
    assert isinstance(problem, LShapeProblem)
    steps = stepwise(problem, solve_problem(problem), number)
    units = {effect.text: effect.unit for effect in problem.all_orders()}
    return StepwiseAnswer(
        request.campaign, number, {step.parameter: _parameter(step, units[step.parameter]) for step in steps}
    )


def _parameter(step: Step, unit: Unit) -> StepwiseParameter:
    def displayed(value: float) -> float | None:
        return unit.to_display(value) if np.isfinite(value) else None

    return StepwiseParameter(
        unit=unit.name,
        stepwise=displayed(step.stepwise),
        u_stepwise=displayed(step.u_stepwise),
        at_once=displayed(step.at_once),
        u_at_once=displayed(step.u_at_once),
        difference_by_method=displayed(step.by_method),
        u_difference_by_noise=displayed(step.u_noise),
        agrees=step.agrees,
        why=step.why,
    )
