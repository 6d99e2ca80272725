"""The results that a health report rests on: what is stored is used, what is lacking is named, computed and stored.

A report is of the end of a week. Where a campaign goes on after it, its uncertainty and its explanation are those of
the runs up to then, so that a report made late says what one made on Monday would have said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, TypedDict, TypeVar, Unpack

from monitor.documents import from_document, to_document
from monitor.exceptions import NotFoundError
from monitor.records import Campaign
from monitor.store import (
    Database,
    RecordedRun,
    StoredModel,
    identified_runs,
    load_analysis,
    load_campaign,
    model_history,
    save_analysis,
    save_identification,
)
from monitor.workflow.campaign_parts import kind_of, method_of, runs_before
from monitor.workflow.explain.explain import save_explanation
from monitor.workflow.health.runs import Span
from monitor.workflow.health.stored import (
    StatedUncertainty,
    StoredExplanation,
    StoredMap,
    VersionError,
    VersionErrors,
)
from monitor.workflow.health.task import METHOD, Task, TaskResult, attempted
from monitor.workflow.uncertainty.documents import save_uncertainty
from monitor.workflow.uncertainty.evaluations import COVERAGE
from monitor.workflow.volumetric.volumetric import save_map

Record = TypeVar("Record")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Results:
    """What the pages of a machine say, of its last run and of its campaign; None where there is none."""

    uncertainty: StatedUncertainty | None
    explanation: StoredExplanation | None
    map: StoredMap | None
    versions: tuple[VersionError, ...] | None

    @property
    def complete(self) -> bool:
        """Whether nothing is to be computed."""
        return None not in (self.uncertainty, self.explanation, self.map, self.versions)


@dataclass(frozen=True)
class MeasuredWeek:
    """The last run of a machine in a week, the runs of its campaign up to then, and the model they are judged by."""

    last: RecordedRun
    span: Span
    model: StoredModel


class _Subject(TypedDict, total=False):
    """Of what a stored result is: the keywords of ``load_analysis``."""

    campaign: str
    run: int
    model: str
    model_version: int


def stored_results(db: Database, week: MeasuredWeek) -> Results:
    """What is stored of the last run of a week and of the runs of its campaign up to then."""
    last, model, before = week.last, week.model, week.span.before
    campaign = _Subject(campaign=last.campaign, model=model.name, model_version=model.version)
    run = _Subject(**campaign, run=last.run)
    uncertainty = _restored(StatedUncertainty, _stored(db, "uncertainty", before, METHOD, **run), needs="guf")
    # A user may have asked for another probability, or for the runs of another campaign.
    if uncertainty is not None and (uncertainty.p != COVERAGE or uncertainty.rests_on_a_selection):
        uncertainty = None
    versions: tuple[VersionError, ...] | None = ()
    # With one version only there is nothing to compare.
    if model.parent is not None:
        history = _restored(
            VersionErrors, _stored(db, "model history", before, METHOD, **campaign), needs="steps"
        )
        versions = None if history is None else history.steps
    return Results(
        uncertainty,
        # Versions before 0.1 stored no pictures with explanation and map.
        _restored(
            StoredExplanation, _stored(db, "explanation", before, last.method, **campaign), needs="residual_map"
        ),
        _restored(StoredMap, _stored(db, "volumetric map", before, METHOD, **run), needs="slices"),
        versions,
    )  # fmt: skip


def _stored(
    db: Database, kind: str, before: datetime | None, method: str, **subject: Unpack[_Subject]
) -> Mapping[str, Any] | None:
    try:
        stored = load_analysis(
            db, kind_of(kind, before), method=None if before is None else method_of(method, before), **subject
        )
    except NotFoundError:
        return None
    return stored.document


def _restored(kind: type[Record], document: Mapping[str, Any] | None, needs: str) -> Record | None:
    """The record of a document; None where the version that stored it did not have a key yet."""
    return None if document is None or needs not in document else from_document(kind, document)


def task_of(
    db: Database, machine: str, runs: Sequence[RecordedRun], week: MeasuredWeek, results: Results
) -> Task | None:
    """What is still to be computed for a machine, None where everything is stored.

    Every past run is identified under the model: what came in since the last report, and the history of a machine
    whose first report this is. Campaigns of another method have other parameters and are left alone.
    """
    last, model, span = week.last, week.model, week.span
    identified = identified_runs(db, machine, model.name, model.version)
    names = dict.fromkeys(
        run.campaign
        for run in runs
        if (run.campaign, run.run) not in identified and run.method == last.method
    )
    identify = {name: _bare(load_campaign(db, name)) for name in names}
    if not identify and results.complete:
        return None
    whole = identify.get(last.campaign) or _bare(load_campaign(db, last.campaign))
    return Task(
        model=model,
        identify=tuple(identify.values()),
        past=runs_before(whole, span.before),
        whole=span.before is None,
        run=last.run,
        uncertainty=results.uncertainty is None,
        explanation=results.explanation is None,
        map=results.map is None,
        versions=() if results.versions is not None else tuple(model_history(db, model.name, model.version)),
    )


def stored_with(
    db: Database, stored: Results, computed: TaskResult, week: MeasuredWeek, remarks: list[str]
) -> Results:
    """Store what was computed; everything that there is now, and in ``remarks`` what could not be stored."""
    model, before = week.model, week.span.before
    remarks += computed.remarks
    for identification in computed.identified:
        attempted(
            lambda identification=identification: save_identification(db, identification),  # type: ignore[misc]
            f"campaign {identification.campaign} could not be identified",
            remarks,
        )
    uncertainty = _saved(
        StatedUncertainty,
        computed.uncertainty,
        lambda document: save_uncertainty(db, document, model, METHOD, before),
        "the uncertainty of the last run could not be evaluated",
        remarks,
    )
    explanation = _saved(
        StoredExplanation,
        computed.explanation,
        lambda answer: save_explanation(db, answer, week.last.method, model, before),
        "model and measurement could not be compared",
        remarks,
    )
    mapped = _saved(
        StoredMap,
        computed.map,
        lambda document: save_map(db, document, model, before),
        "the volumetric error could not be mapped",
        remarks,
    )
    versions = stored.versions
    if computed.versions is not None:
        document = {"steps": [to_document(step) for step in computed.versions]}
        versions = from_document(VersionErrors, document).steps
        save_analysis(
            db, kind_of("model history", before), document, method=method_of(METHOD, before),
            campaign=week.last.campaign, model=model.name, model_version=model.version,
        )  # fmt: skip
    every = Results(
        stored.uncertainty or uncertainty, stored.explanation or explanation, stored.map or mapped, versions
    )
    return every if every.uncertainty is not None else replace(every, map=None)


def _saved(
    kind: type[Record],
    answer: Answer | None,
    save: Callable[[Answer], None],
    failure: str,
    remarks: list[str],
) -> Record | None:
    """What the page reads of a computed answer, once it is stored."""
    if answer is None:
        return None

    def saved() -> Record:
        save(answer)
        return from_document(kind, answer if isinstance(answer, dict) else to_document(answer))

    return attempted(saved, failure, remarks)


def _bare(campaign: Campaign) -> Campaign:
    """A campaign without the bytes of its files: nothing is computed from them, and a worker need not get them."""
    return replace(campaign, files=())
