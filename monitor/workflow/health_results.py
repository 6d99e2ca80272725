"""The results that a health report rests on: what is stored is used, what is lacking is computed and stored.

A report is of the end of a week. Where a campaign goes on after it, its uncertainty and its explanation are those of
the runs up to then, so that a report made late says what one made on Monday would have said.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from typing import Any

from monitor.exceptions import MonitorError, NotFoundError
from monitor.store import Database, StoredModel, load_analysis, save_analysis
from monitor.workflow.campaign_parts import kind_of, method_of
from monitor.workflow.comparison import explain_campaign, history
from monitor.workflow.health_history import PastRun, Span
from monitor.workflow.identification import identify
from monitor.workflow.models import label
from monitor.workflow.uncertainty import uncertainty
from monitor.workflow.volumetric import volumetric_map

Document = dict[str, Any]
#: The probability that every expanded uncertainty of the report is stated with.
COVERAGE = 0.95
METHOD = "guf"


def kept(step: Callable[[], Document], failure: str, remarks: list[str]) -> Document | None:
    """The result of a step, or a remark that says why there is none: one machine does not stop the fleet's report."""
    try:
        return step()
    except MonitorError as error:
        remarks.append(f"{failure}: {error}")
        return None


def identified(
    db: Database, machine: str, method: str, runs: list[PastRun], model: StoredModel, remarks: list[str]
) -> None:
    """Every past run of a machine identified under the model: what came in since the last report, and the history of a
    machine whose first report this is. Campaigns of another method have other parameters and are left alone."""
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
    for campaign in dict.fromkeys(one.campaign for one in runs if (one.campaign, one.run) not in done):
        if campaign in same:
            kept(
                lambda name=campaign: identify(db, name, label(model)),  # type: ignore[misc]
                f"campaign {campaign} could not be identified",
                remarks,
            )


def uncertainty_of(
    db: Database, last: PastRun, model: StoredModel, span: Span, remarks: list[str]
) -> Document | None:
    """The uncertainty of a run from the runs of ``span``; None, with a remark, where there is none."""
    before = span.before
    known = _stored(
        db, "uncertainty", before, METHOD, campaign=last.campaign, run=last.run, model=model.name,
        model_version=model.version,
    )  # fmt: skip
    # A user may have asked for another probability, or for the runs of another campaign.
    if known is not None and known["p"] == COVERAGE and not known["input_covariance"].startswith("selection"):
        return known
    return kept(
        lambda: uncertainty(
            db, last.campaign, last.run, model=label(model), method=METHOD, p=COVERAGE, before=before
        ),
        "the uncertainty of the last run could not be evaluated",
        remarks,
    )


def explanation_of(
    db: Database, campaign: str, method: str, model: StoredModel, span: Span, remarks: list[str]
) -> Document | None:
    """What the model leaves of the runs of ``span``, and what it lacks; None, with a remark, where it is unknown."""
    known = _stored(
        db,
        "explanation",
        span.before,
        method,
        campaign=campaign,
        model=model.name,
        model_version=model.version,
    )
    # A version before 0.1 stored no pictures with it.
    if known is not None and "residual_map" in known:
        return known
    return kept(
        lambda: explain_campaign(db, campaign, label(model), before=span.before)[0],
        "model and measurement could not be compared",
        remarks,
    )


def map_of(
    db: Database, last: PastRun, model: StoredModel, span: Span, remarks: list[str]
) -> Document | None:
    """The volumetric error of a run over the strokes, from the runs of ``span``; None, with a remark, without one."""
    known = _stored(
        db, "volumetric map", span.before, METHOD, campaign=last.campaign, run=last.run, model=model.name,
        model_version=model.version,
    )  # fmt: skip
    if known is not None:
        return known
    return kept(
        lambda: volumetric_map(
            db, last.campaign, last.run, model=label(model), p=COVERAGE, before=span.before
        )[0],
        "the volumetric error could not be mapped",
        remarks,
    )


def history_of(
    db: Database, campaign: str, model: StoredModel, span: Span, remarks: list[str]
) -> list[Document]:
    """The error of every version of the model on the runs of ``span``; empty where there is one version only."""
    if model.parent is None:
        return []
    which: dict[str, Any] = {"campaign": campaign, "model": model.name, "model_version": model.version}
    known = _stored(db, "model history", span.before, METHOD, **which)
    if known is None:
        known = kept(
            lambda: {"steps": history(db, label(model), campaign, before=span.before)},
            "the versions of the model could not be compared",
            remarks,
        )
        if known is None:
            return []
        method = method_of(METHOD, span.before)
        save_analysis(db, kind_of("model history", span.before), known, method=method, **which)
    return list(known["steps"])


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
