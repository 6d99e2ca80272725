"""The geometric errors of every run of a campaign, or the coefficients of a curve, stored."""

from __future__ import annotations

from monitor.documents import to_document
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.records import CurveCampaign
from monitor.store import Database, save_analysis, save_identification
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.identify.answer import IdentifyAnswer
from monitor.workflow.identify.curve import curve_answer
from monitor.workflow.identify.fitting import curve_problem
from monitor.workflow.identify.machine import identified, machine_answer
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.measured import load_measured
from monitor.workflow.models import label, resolve, resolve_for


def identify(db: Database, request: IdentifyRequest) -> IdentifyAnswer:
    """Identify a campaign, or one of its runs, under a model, and store the result.

    Raises NotFoundError, DataError where the readings do not suffice, EffectError for a model that the machine
    does not have.
    """
    measured = load_measured(db, request.campaign)
    if isinstance(measured, CurveCampaign):
        return _identify_curve(db, measured, request)
    campaign = measured if request.run is None else only_run(measured, request.run)
    identification, stored = identified(
        campaign, resolve_for(db, request.model, campaign.method, campaign.machine.id)
    )
    save_identification(db, stored)
    return machine_answer(campaign.machine, identification)


def _identify_curve(db: Database, curve: CurveCampaign, request: IdentifyRequest) -> IdentifyAnswer:
    if request.run not in (None, 1):
        raise DataError(f"campaign {curve.name} is a curve with one run, number 1, not {request.run}")
    model = resolve(db, request.model, curve.method)
    answer = curve_answer(campaign_method(curve).fit(curve_problem(curve, model)), label(model))
    save_analysis(
        db, "identification", to_document(answer), method=curve.method, campaign=curve.name,
        model=model.name, model_version=model.version,
    )  # fmt: skip
    return answer
