"""A run of the L-shaped piece identified step by step, beside the fit of all at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.exceptions import DataError
from monitor.methods import method_named
from monitor.methods.chain.problem import solve_problem
from monitor.methods.l_shape.method import LShapeProblem
from monitor.methods.l_shape.stepwise import Step, stepwise
from monitor.store import Database, load_campaign
from monitor.units import Unit
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.models import as_model, resolve

Document = dict[str, Any]


def steps(db: Database, campaign: str, model: str | None = None, run: int | None = None) -> Document:
    """One run (the last unless ``run`` says another) by both ways, with what tells them apart.

    Raises NotFoundError for an unknown campaign or run, DataError for a campaign of another method.
    """
    loaded = load_campaign(db, campaign)
    if loaded.method != "l-shape":
        raise DataError(
            f"campaign {campaign} was measured by {loaded.method}; only l-shape has a stepwise way"
        )
    number = max(one.run for one in loaded.runs) if run is None else run
    loaded = only_run(loaded, number)
    stored = resolve(db, model, loaded.method)
    problem = method_named(loaded.method).problem_of(loaded, as_model(stored))
    assert isinstance(problem, LShapeProblem)
    found = stepwise(problem, solve_problem(problem), number)
    units = {effect.text: effect.unit for effect in problem.all_orders()}
    return {
        "campaign": campaign,
        "run": number,
        "stepwise": {one.parameter: _document(one, units[one.parameter]) for one in found},
    }


def _document(one: Step, unit: Unit) -> Document:
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
