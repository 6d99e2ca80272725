"""A run of the L-shaped piece identified step by step, beside the fit of all parameters at once."""

from __future__ import annotations

import numpy as np

from monitor.methods import Stepwise, campaign_method
from monitor.methods.chain.identification import StepwiseCoefficient
from monitor.methods.chain.problem import solve_problem
from monitor.methods.chain.sufficiency import refuse_exact_fits
from monitor.store import Database
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.identify.answer import StepwiseAnswer, StepwiseParameter
from monitor.workflow.identify.fitting import explained_refusals, machine_problem
from monitor.workflow.identify.request import StepwiseRequest
from monitor.workflow.measured import machine_campaign
from monitor.workflow.models import resolve_for


def identify_stepwise(db: Database, request: StepwiseRequest) -> StepwiseAnswer:
    """One run by both ways, with what tells them apart.

    Raises NotFoundError for an unknown campaign or run, DataError for a campaign of another method.
    """
    campaign = machine_campaign(db, request.campaign, "identify --stepwise", lambda method: method.stepwise)
    stepwise = campaign_method(campaign).stepwise
    assert isinstance(stepwise, Stepwise)  # required with the campaign
    number = max(run.run for run in campaign.runs) if request.run is None else request.run
    campaign = only_run(campaign, number)
    model = resolve_for(db, request.model, campaign.method, campaign.machine.id)
    with explained_refusals(campaign, model):
        problem = machine_problem(campaign, model)
        solution = solve_problem(problem)
        refuse_exact_fits(problem, solution)
    coefficients = stepwise.coefficients(problem, solution, number)
    return StepwiseAnswer(
        request.campaign,
        number,
        {coefficient.parameter: _parameter(coefficient) for coefficient in coefficients},
    )


def _parameter(coefficient: StepwiseCoefficient) -> StepwiseParameter:
    unit = coefficient.unit

    def displayed(value: float) -> float | None:
        return unit.to_display(value) if np.isfinite(value) else None

    return StepwiseParameter(
        unit=unit.name,
        stepwise=displayed(coefficient.stepwise),
        u_stepwise=displayed(coefficient.u_stepwise),
        at_once=displayed(coefficient.at_once),
        u_at_once=displayed(coefficient.u_at_once),
        difference_by_method=displayed(coefficient.by_method),
        u_difference_by_noise=displayed(coefficient.u_noise),
        agrees=coefficient.agrees,
        why=coefficient.why,
    )
