"""The results that a health report rests on: what is stored is used, what is lacking is named, computed and stored.

A report is of the end of a week. Where a campaign goes on after it, its uncertainty and its explanation are those of
the runs up to then, so that a report made late says what one made on Monday would have said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from typing import Any, TypedDict, TypeVar, Unpack

from monitor.documents import from_document, to_document
from monitor.exceptions import NotFoundError, StoreError
from monitor.records import Campaign
from monitor.reporting.health.sentences import Step, StepFailed
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
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.version_answer import HistoryAnswer
from monitor.workflow.health.runs import Span
from monitor.workflow.health.task import METHOD, Task, TaskResult, attempted
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.uncertainty.request import COVERAGE
from monitor.workflow.uncertainty.stored import restored, save_uncertainty
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.volumetric import save_map

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Results:
    """The answers about a machine's last run and its campaign; None where there is none.

    With one version of the model only there is nothing to compare: ``versions`` then has no steps.
    """

    uncertainty: UncertaintyAnswer | None
    explanation: MachineExplanation | None
    map: VolumetricAnswer | None
    versions: HistoryAnswer | None

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
    uncertainty = _restored(restored, _stored(db, "uncertainty", before, METHOD, **run))
    # A user may have asked for another probability, or for the runs of another campaign.
    if uncertainty is not None and (uncertainty.p != COVERAGE or _rests_on_a_selection(uncertainty)):
        uncertainty = None
    return Results(
        uncertainty,
        _restored(
            partial(from_document, MachineExplanation),
            _stored(db, "explanation", before, last.method, **campaign),
        ),
        _restored(
            partial(from_document, VolumetricAnswer), _stored(db, "volumetric map", before, METHOD, **run)
        ),
        HistoryAnswer(())
        if model.parent is None
        else _restored(
            partial(from_document, HistoryAnswer), _stored(db, "model history", before, METHOD, **campaign)
        ),
    )


def stored_explanation(db: Database, campaign: str, week: MeasuredWeek) -> MachineExplanation | None:
    """The stored comparison of a whole ``campaign`` with the model of a ``week``; None where there is none."""
    subject = _Subject(campaign=campaign, model=week.model.name, model_version=week.model.version)
    return _restored(
        partial(from_document, MachineExplanation),
        _stored(db, "explanation", None, week.last.method, **subject),
    )


def _rests_on_a_selection(answer: UncertaintyAnswer) -> bool:
    """Whether the scatter is that of runs that a user selected, and not of the campaign's own."""
    source = answer.input_covariance_source
    return source is not None and source.selection is not None


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


def _restored(
    restore: Callable[[Mapping[str, Any]], Answer], document: Mapping[str, Any] | None
) -> Answer | None:
    """The answer that a document holds; None, so that it is computed anew, where another version stored other keys."""
    try:
        return None if document is None else restore(document)
    except StoreError:
        return None


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
    db: Database, stored: Results, computed: TaskResult, week: MeasuredWeek
) -> tuple[Results, list[StepFailed]]:
    """Store what was computed; everything that there is now, and what could not be computed or stored."""
    model, before = week.model, week.span.before
    remarks = list(computed.remarks)
    for identification in computed.identified:
        attempted(
            lambda identification=identification: save_identification(db, identification),  # type: ignore[misc]
            Step.IDENTIFICATION,
            remarks,
            identification.campaign,
        )
    uncertainty = _saved(
        computed.uncertainty,
        lambda answer: save_uncertainty(db, answer, model, METHOD, before),
        Step.UNCERTAINTY,
        remarks,
    )
    explanation = _saved(
        computed.explanation,
        lambda answer: save_explanation(db, answer, week.last.method, model, before),
        Step.COMPARISON,
        remarks,
    )
    mapped = _saved(
        computed.map,
        lambda answer: save_map(db, answer, model, before),
        Step.MAP,
        remarks,
    )
    if computed.versions is not None:
        save_analysis(
            db, kind_of("model history", before), to_document(computed.versions), method=method_of(METHOD, before),
            campaign=week.last.campaign, model=model.name, model_version=model.version,
        )  # fmt: skip
    every = Results(
        stored.uncertainty or uncertainty,
        stored.explanation or explanation,
        stored.map or mapped,
        stored.versions or computed.versions,
    )
    return every if every.uncertainty is not None else replace(every, map=None), remarks


def _saved(
    answer: Answer | None, save: Callable[[Answer], None], part: Step, remarks: list[StepFailed]
) -> Answer | None:
    """A computed answer once it is stored; None, with a remark, where it could not be."""
    if answer is None:
        return None

    def saved() -> Answer:
        save(answer)
        return answer

    return attempted(saved, part, remarks)


def _bare(campaign: Campaign) -> Campaign:
    """A campaign without the bytes of its files: nothing is computed from them, and a worker need not get them."""
    return replace(campaign, files=())
