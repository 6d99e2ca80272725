"""The volumetric error over the stroke: evaluated, stored, drawn, written as compensation tables."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

from monitor.documents import to_document
from monitor.store import Database, StoredModel, save_analysis
from monitor.workflow.campaign_parts import kind_of, method_of
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.measured import machine_campaign
from monitor.workflow.uncertainty.evaluation import evaluate_campaign
from monitor.workflow.uncertainty.stating import statement
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.error_map import VolumetricMap, map_of
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.stating import map_answer


def map_run(db: Database, request: VolumetricRequest) -> VolumetricMap:
    """Map the volumetric error of one run; nothing is stored. Raises InputError, DataError, NotFoundError."""
    campaign = machine_campaign(db, request.uncertainty.campaign, "map", lambda method: method.map)
    result = evaluate_campaign(db, campaign, request.uncertainty)
    evaluated = StatedUncertainty(result.campaign, result.model, statement(result))
    return map_of(evaluated, result.fit, request.points, request.absolute)


def volumetric_map(db: Database, request: VolumetricRequest) -> VolumetricAnswer:
    """Map the volumetric error of one run over the strokes and store the answer, without the names of its files.

    With ``request.before`` it is stored as ``partial volumetric map``. Raises what ``map_run`` raises.
    """
    mapped = map_run(db, request)
    answer = map_answer(mapped)
    save_map(db, answer, mapped.evaluated.model, request.before)
    answer = replace(answer, copied_readings=copied_readings(db, mapped.evaluated.campaign))
    if request.figures is not None:
        # The drawing library takes longer to load than most commands to run.
        from monitor.workflow.volumetric.figures import map_figures

        answer = replace(answer, figures=map_figures(answer, mapped, request.figures))
    if request.compensation is not None:
        from monitor.workflow.volumetric.compensation import write_tables

        answer = replace(answer, tables=write_tables(mapped, request.compensation, request.out))
    return answer


def save_map(db: Database, answer: VolumetricAnswer, model: StoredModel, before: datetime | None) -> None:
    """Store a map, ``partial`` where runs from ``before`` on took no part."""
    save_analysis(
        db, kind_of("volumetric map", before), to_document(answer), method=method_of("guf", before),
        campaign=answer.campaign, run=answer.run, model=model.name, model_version=model.version,
    )  # fmt: skip
