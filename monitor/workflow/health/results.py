"""The results that a health report rests on: what is stored is used, what is lacking is named, computed and stored.

A report is of the end of a week. Where a campaign goes on after it, its uncertainty and its explanation are those of
the runs up to then, so that a report made late says what one made on Monday would have said.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, TypeVar

from monitor.documents import from_document, to_document
from monitor.exceptions import NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    StoredModel,
    load_analysis,
    load_campaign,
    model_history,
    save_analysis,
    save_identification,
)
from monitor.workflow.campaign_parts import kind_of, method_of, runs_before
from monitor.workflow.explain.explain import save_explanation
from monitor.workflow.explain.explain_answer import ExplainAnswer
from monitor.workflow.health.work import METHOD, Done, Work, kept
from monitor.workflow.history.health_history import PastRun, Span
from monitor.workflow.uncertainty.request import COVERAGE
from monitor.workflow.uncertainty.stored import covariance_source, save_uncertainty
from monitor.workflow.volumetric.volumetric import save_map

Document = dict[str, Any]
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Results:
    """What the pages of a machine say, of its last run and of its campaign; None where there is none."""

    uncertainty: Document | None
    explanation: Document | None
    map: Document | None
    history: tuple[Document, ...] | None


def found_in(db: Database, last: PastRun, method: str, model: StoredModel, span: Span) -> Results:
    """What is stored of the run ``last`` and of the runs of ``span`` of its campaign."""
    of_campaign = {"campaign": last.campaign, "model": model.name, "model_version": model.version}
    of_run = {**of_campaign, "run": last.run}
    uncertainty = _stored(db, "uncertainty", span.before, METHOD, **of_run)
    # A user may have asked for another probability, or for the runs of another campaign.
    if uncertainty is not None and (
        uncertainty["p"] != COVERAGE or covariance_source(uncertainty).selection is not None
    ):
        uncertainty = None
    explanation = _stored(db, "explanation", span.before, method, **of_campaign)
    # Versions before 0.1 stored no pictures with them.
    if explanation is not None and "residual_map" not in explanation:
        explanation = None
    mapped = _stored(db, "volumetric map", span.before, METHOD, **of_run)
    if mapped is not None and "slices" not in mapped:
        mapped = None
    history: tuple[Document, ...] | None = ()
    # With one version only there is no history.
    if model.parent is not None:
        steps = _stored(db, "model history", span.before, METHOD, **of_campaign)
        history = None if steps is None else tuple(steps["steps"])
    return Results(uncertainty, explanation, mapped, history)


def work_of(
    db: Database,
    machine: str,
    runs: list[PastRun],
    last: PastRun,
    method: str,
    model: StoredModel,
    span: Span,
    found: Results,
) -> Work | None:
    """What is still to be computed for a machine, None where everything is stored.

    Every past run is identified under the model: what came in since the last report, and the history of a machine
    whose first report this is. Campaigns of another method have other parameters and are left alone.
    """
    done = set(
        db.rows(
            "SELECT campaign, run FROM v_identified_runs WHERE machine = ? AND model = ? AND model_version = ?",
            [machine, model.name, model.version],
        )
    )
    same = {
        str(name)
        for (name,) in db.rows(
            "SELECT campaign FROM v_campaigns WHERE machine = ? AND method = ?", [machine, method]
        )
    }
    names = dict.fromkeys(one.campaign for one in runs if (one.campaign, one.run) not in done)
    identify = {name: _bare(load_campaign(db, name)) for name in names if name in same}
    versions = () if found.history is not None else model_history(db, model.name, model.version)
    lacks = None in (found.uncertainty, found.explanation, found.map, found.history)
    if not identify and not lacks:
        return None
    whole = identify.get(last.campaign) or _bare(load_campaign(db, last.campaign))
    return Work(
        model=model,
        identify=tuple(identify.values()),
        known=runs_before(whole, span.before),
        whole=span.before is None,
        run=last.run,
        uncertainty=found.uncertainty is None,
        explanation=found.explanation is None,
        map=found.map is None,
        versions=tuple(versions),
    )


def stored_with(
    db: Database, found: Results, done: Done, method: str, model: StoredModel, span: Span, remarks: list[str]
) -> Results:
    """Store what was computed; everything that there is now, and in ``remarks`` what could not be kept."""
    remarks += done.remarks
    for one in done.identified:
        kept(
            lambda one=one: save_identification(db, one),  # type: ignore[misc]
            f"campaign {one.campaign} could not be identified",
            remarks,
        )
    uncertainty = _saved(
        done.uncertainty,
        lambda new: save_uncertainty(db, new, model, METHOD, span.before),
        "the uncertainty of the last run could not be evaluated",
        remarks,
    )
    explanation = _saved(
        done.explanation,
        lambda new: save_explanation(db, from_document(ExplainAnswer, new), method, model, span.before),
        "model and measurement could not be compared",
        remarks,
    )
    mapped = _saved(
        done.map,
        lambda new: save_map(db, new, model, span.before),
        "the volumetric error could not be mapped",
        remarks,
    )
    if done.history is not None:
        save_analysis(
            db, kind_of("model history", span.before), {"steps": list(done.history)},
            method=method_of(METHOD, span.before), campaign=done.history[0]["campaign"], model=model.name,
            model_version=model.version,
        )  # fmt: skip
    every = Results(
        found.uncertainty or (None if uncertainty is None else to_document(uncertainty)),
        found.explanation or explanation,
        found.map or (None if mapped is None else to_document(mapped)),
        found.history if found.history is not None else done.history,
    )
    return every if every.uncertainty is not None else replace(every, map=None)


def _saved(
    new: Answer | None, save: Callable[[Answer], None], failure: str, remarks: list[str]
) -> Answer | None:
    if new is None:
        return None

    def saved() -> Answer:
        save(new)
        return new

    return kept(saved, failure, remarks)


def _bare(campaign: Campaign) -> Campaign:
    """A campaign without the bytes of its files: nothing is computed from them, and a worker need not get them."""
    return replace(campaign, files=())


def _stored(db: Database, kind: str, before: datetime | None, method: str, **which: Any) -> Document | None:
    try:
        found = load_analysis(
            db, kind_of(kind, before), method=None if before is None else method_of(method, before), **which
        )
    except NotFoundError:
        return None
    return dict(found.document)


def tolerances_of(db: Database, campaign: str) -> dict[str, float]:
    """Limits of the absolute value of the parameters that have one, in display units."""
    rows = db.rows(
        "SELECT parameter, tolerance FROM v_tolerances WHERE campaign = ? AND tolerance IS NOT NULL",
        [campaign],
    )
    return {str(parameter): float(tolerance) for parameter, tolerance in rows}
