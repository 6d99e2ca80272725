"""The geometric errors of every run of a campaign, or the coefficients of a curve, stored."""

from __future__ import annotations

from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from monitor.documents import to_document
from monitor.exceptions import DataError
from monitor.methods import InstrumentPlan, campaign_method
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem, solve_problem
from monitor.readers.doubts.doubts import result_doubts
from monitor.records import Campaign, CurveCampaign
from monitor.reporting.refused import refused_parameters
from monitor.store import (
    Database,
    StoredIdentification,
    StoredModel,
    save_analysis,
    save_identification,
)
from monitor.workflow.campaign_parts import only_run
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.identify.answer import IdentifyAnswer
from monitor.workflow.identify.curve import curve_answer
from monitor.workflow.identify.fitting import curve_problem, machine_problem
from monitor.workflow.identify.machine import identified, machine_answer
from monitor.workflow.identify.mistaken_columns import with_mistake
from monitor.workflow.identify.mistaken_setups import mistaken_setups
from monitor.workflow.identify.not_seen import not_seen, seen_by
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.measured import load_measured
from monitor.workflow.models import label, resolve, resolve_for
from monitor.workflow.tool_frames import tool_frames


@dataclass(frozen=True)
class Identified:
    """What was identified: the answer, and of a machine what is stored of it."""

    answer: IdentifyAnswer
    stored: StoredIdentification | None


def identify(db: Database, request: IdentifyRequest) -> IdentifyAnswer:
    """Identify a campaign, or one of its runs, under a model, and store the result.

    Raises NotFoundError, DataError where the readings do not suffice, EffectError for a model that the machine
    does not have.
    """
    measured, model = read(db, request)
    return store(db, measured, model, compute(measured, model))


def read(db: Database, request: IdentifyRequest) -> tuple[Campaign | CurveCampaign, StoredModel]:
    """What is to be identified, and the model. Raises NotFoundError, and DataError for a run that there is not."""
    measured = load_measured(db, request.campaign)
    if isinstance(measured, CurveCampaign):
        if request.run not in (None, 1):
            raise DataError(f"campaign {measured.name} is a curve with one run, number 1, not {request.run}")
        return measured, resolve(db, request.model, measured.method)
    campaign = measured if request.run is None else only_run(measured, request.run)
    return campaign, resolve_for(db, request.model, campaign.method, campaign.machine.id)


def compute(measured: Campaign | CurveCampaign, model: StoredModel) -> Identified:
    """Identify without the database, so that any process can. Raises DataError and EffectError as ``identify``."""
    # One thread wherever it is computed: with several the linear algebra may round otherwise.
    with threadpool_limits(1, "blas"):
        if isinstance(measured, CurveCampaign):
            fit = campaign_method(measured).fit(curve_problem(measured, model))
            return Identified(curve_answer(fit, label(model)), None)
        solved: list[tuple[ChainProblem, Solution]] = []

        def remembered(problem: ChainProblem) -> Solution:
            solved.append((problem, solve_problem(problem)))
            return solved[-1][1]

        try:
            identification, stored = identified(measured, model, remembered)
        except DataError as refusal:
            raise with_mistake(
                refusal, measured, lambda changed: machine_problem(changed, model)
            ) from refusal
        judged = None if stored.lack_of_fit is None else stored.lack_of_fit.p_value
        answer = machine_answer(measured, identification, judged)
        mistakes = mistaken_setups(measured, model, *solved[-1])
        doubted = () if mistakes else result_doubts(measured, tool_frames(measured))
        answer = replace(answer, likely_mistakes=mistakes or None, file_doubts=doubted or None)
        if not isinstance(campaign_method(measured).plan, InstrumentPlan):
            return Identified(answer, stored)
        outside = not_seen(*solved[-1], identification)
        tests = seen_by(measured, model, identification, outside)
        refused = tuple(refused_parameters(each.refusal) for each in outside)
        return Identified(replace(answer, not_seen=refused or None, seen_by=tests or None), stored)


def store(
    db: Database, measured: Campaign | CurveCampaign, model: StoredModel, result: Identified
) -> IdentifyAnswer:
    """Store what was identified; the answer."""
    if result.stored is not None:
        save_identification(db, result.stored)
    else:
        save_analysis(
            db, "identification", to_document(result.answer), method=measured.method, campaign=measured.name,
            model=model.name, model_version=model.version,
        )  # fmt: skip
    return replace(result.answer, copied_readings=copied_readings(db, measured))
