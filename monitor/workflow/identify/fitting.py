"""A campaign, a stored model, and the fit of the model to it: where identify, compare, explain and history start."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from monitor.discovery import Fit, fit
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.sufficiency import refuse_exact_fits
from monitor.methods.curve.fit import CurveFit
from monitor.methods.curve.problem import CurveProblem
from monitor.records import Campaign, CurveCampaign
from monitor.store import Database, StoredModel
from monitor.workflow.identify.mistaken_columns import refusal_of
from monitor.workflow.measured import load_measured
from monitor.workflow.models import as_model, resolve_for, subject_of


@dataclass(frozen=True)
class FittedModel:
    """A version of a model, fitted to a campaign."""

    campaign: Campaign | CurveCampaign
    model: StoredModel
    fit: Fit | CurveFit


def machine_problem(campaign: Campaign, model: StoredModel) -> ChainProblem:
    """The least-squares problem of a machine's campaign under a model."""
    return campaign_method(campaign).problem_of(campaign, as_model(model))


def curve_problem(curve: CurveCampaign, model: StoredModel) -> CurveProblem:
    """The least-squares problem of a curve under a model."""
    return campaign_method(curve).problem_of(curve, as_model(model))


@contextmanager
def explained_refusals(campaign: Campaign, model: StoredModel) -> Iterator[None]:
    """A fit of a machine's campaign within: what refuses it is said in the words of ``identify``, whoever asked.

    Raises DataError for a DataError, with what looks wrong in the file where that can be said.
    """
    try:
        yield
    except DataError as refusal:
        raise refusal_of(refusal, campaign, lambda changed: machine_problem(changed, model)) from refusal


def machine_fit(campaign: Campaign, model: StoredModel, problem: ChainProblem | None = None) -> Fit:
    """A model fitted to a machine's campaign, of which ``problem`` is made where it is not given.

    Raises DataError where the readings do not suffice, with what looks wrong in the file where that can be said.
    """
    with explained_refusals(campaign, model):
        fitted = fit(problem or machine_problem(campaign, model))
        refuse_exact_fits(fitted.problem, fitted.solution)
    return fitted


def fit_of(campaign: Campaign | CurveCampaign, model: StoredModel) -> Fit | CurveFit:
    """A version of a model fitted to a campaign.

    Raises DataError where the readings do not suffice, with what looks wrong in the file where that can be said.
    """
    if isinstance(campaign, CurveCampaign):
        return campaign_method(campaign).fit(curve_problem(campaign, model))
    return machine_fit(campaign, model)


def fitted(db: Database, campaign: str, model: str | None) -> FittedModel:
    """A model (the method's own with None) fitted to a campaign. Raises NotFoundError, DataError."""
    measured = load_measured(db, campaign)
    stored = resolve_for(db, model, measured.method, subject_of(measured))
    return FittedModel(measured, stored, fit_of(measured, stored))
