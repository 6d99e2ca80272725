"""A run of the L-shaped piece identified step by step, beside the fit of all at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.exceptions import DataError
from monitor.methods import Unable, campaign_method, methods
from monitor.methods.chain.identification import StepwiseCoefficient
from monitor.methods.chain.problem import solve_problem
from monitor.store import Database, load_campaign
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.models import as_model, resolve

Document = dict[str, Any]


def steps(db: Database, campaign: str, model: str | None = None, run: int | None = None) -> Document:
    """One run (the last unless ``run`` says another) by both ways, with what tells them apart.

    Raises NotFoundError for an unknown campaign or run, DataError for a campaign of another method.
    """
    loaded = load_campaign(db, campaign)
    stepwise = campaign_method(loaded).stepwise
    if isinstance(stepwise, Unable):
        able = " and ".join(name for name, one in methods().items() if not isinstance(one.stepwise, Unable))
        raise DataError(
            f"campaign {campaign} was measured by {loaded.method}; only {able} has a stepwise way"
        )
    number = max(one.run for one in loaded.runs) if run is None else run
    loaded = only_run(loaded, number)
    stored = resolve(db, model, loaded.method)
    problem = campaign_method(loaded).problem_of(loaded, as_model(stored))
    found = stepwise.coefficients(problem, solve_problem(problem), number)
    return {
        "campaign": campaign,
        "run": number,
        "stepwise": {one.parameter: _document(one) for one in found},
    }


def _document(one: StepwiseCoefficient) -> Document:
    unit = one.unit

    def shown(value: float) -> float | None:
        return unit.to_display(value) if np.isfinite(value) else None

    return {
        "unit": unit.name,
        "stepwise": shown(one.stepwise),
        "u_stepwise": shown(one.u_stepwise),
        "at_once": shown(one.at_once),
        "u_at_once": shown(one.u_at_once),
        "difference_by_method": shown(one.by_method),
        "u_difference_by_noise": shown(one.u_noise),
        "agrees": one.agrees,
        "why": one.why,
    }
