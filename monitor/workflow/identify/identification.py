"""Geometric errors of every run of a campaign, stored."""

from __future__ import annotations

from typing import Any

import numpy as np

from monitor.methods import campaign_method
from monitor.methods.chain.identification import Identification, RunIdentification
from monitor.methods.chain.problem import Solver, solve_problem
from monitor.records import Array, Campaign, Machine
from monitor.store import (
    Database,
    StoredIdentification,
    StoredModel,
    StoredRun,
    load_campaign,
    save_identification,
)
from monitor.units import MICROMETRE, Unit
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.identify.notes import note
from monitor.workflow.models import as_model, resolve

Document = dict[str, Any]


def parameter_document(estimate: float, u: float, unit: Unit) -> Document:
    """A parameter as people see it."""
    return {"value": unit.to_display(estimate), "u": unit.to_display(u), "unit": unit.name}


def _parameters(
    names: tuple[str, ...], units: tuple[Unit, ...], estimate: Array, covariance: Array
) -> Document:
    return {
        name: parameter_document(float(value), float(np.sqrt(variance)), unit)
        for name, unit, value, variance in zip(names, units, estimate, np.diag(covariance), strict=True)
        if np.isfinite(value)
    }


def _run_document(machine: Machine, found: Identification, run: RunIdentification) -> Document:
    return {
        "run": run.run,
        "parameters": _parameters(found.parameters, found.units, run.estimate, run.covariance),
        "refused": [{"parameters": list(refusal.parameters), "why": refusal.why} for refusal in run.refused],
        "rms_um": MICROMETRE.to_display(run.rms),
        "largest_um": MICROMETRE.to_display(float(np.abs(run.residuals).max())),
        "chi_square": run.chi_square,
        "degrees_of_freedom": run.degrees_of_freedom,
        "iterations": found.iterations,
        "note": note(machine, found, run),
    }


def _stored(campaign: Campaign, found: Identification, model: str, version: int) -> StoredIdentification:
    sequence = {run.run: campaign.probings.sequence[campaign.probings.run == run.run] for run in found.runs}
    return StoredIdentification(
        campaign=found.campaign,
        model=model,
        model_version=version,
        method=found.method,
        parameters=found.parameters,
        units=found.units,
        runs=tuple(
            StoredRun(
                run=run.run,
                estimate=run.estimate,
                covariance=run.covariance,
                refused=tuple((refusal.parameters, refusal.why) for refusal in run.refused),
                rms_mm=run.rms,
                iterations=found.iterations,
                degrees_of_freedom=run.degrees_of_freedom,
                chi_square=run.chi_square,
                sequence=sequence[run.run],
                residuals=run.residuals,
            )
            for run in found.runs
        ),
    )


def identified(
    campaign: Campaign, model: StoredModel, solve: Solver = solve_problem
) -> tuple[Identification, StoredIdentification]:
    """Identify a campaign under a model, and the same as it is stored.

    ``solve`` gives the solution of the method's problem. Raises as ``identify``.
    """
    found = campaign_method(campaign).identify(campaign, as_model(model), solve)
    return found, _stored(campaign, found, model.name, model.version)


def identify(db: Database, campaign: str, model: str | None = None, run: int | None = None) -> Document:
    """Identify a campaign, or one of its runs, under a model, and store the result.

    Raises NotFoundError, DataError where the readings do not suffice, EffectError for a model that the machine
    does not have.
    """
    loaded = load_campaign(db, campaign)
    if run is not None:
        loaded = only_run(loaded, run)
    stored_model = resolve(db, model, loaded.method)
    found, kept = identified(loaded, stored_model)
    save_identification(db, kept)
    return {
        "campaign": campaign,
        "model": found.model,
        "machine": loaded.machine.id,
        "method": found.method,
        "runs": [_run_document(loaded.machine, found, one) for one in found.runs],
        "added": _parameters(found.added, found.added_units, found.added_estimate, found.added_covariance),
        "added_refused": [
            {"parameters": list(refusal.parameters), "why": refusal.why} for refusal in found.added_refused
        ],
    }
