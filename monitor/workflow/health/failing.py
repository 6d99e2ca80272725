"""Since when a model fails: the comparisons of earlier campaigns that are stored say whether they showed it already."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from itertools import takewhile

from monitor.records import Verdict
from monitor.store import Database, RecordedRun
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.health.results import MeasuredWeek, stored_explanation


def failing_since(
    db: Database, runs: Sequence[RecordedRun], week: MeasuredWeek, explanation: MachineExplanation | None
) -> datetime:
    """The local start of the first of the compared ``runs``, in the order of time, from which on the model fails
    without a break as it does by the ``explanation`` of the ``week``.

    Campaigns that were never compared with this version of the model say nothing, and break nothing.
    """
    last, first = week.last, week.span.first
    if explanation is None or explanation.comparison.verdict is not Verdict.SOMETHING_IS_MISSING:
        return first
    started: dict[str, datetime] = {}
    for run in runs:
        if run.method == last.method and run.campaign != last.campaign:
            started.setdefault(run.campaign, run.local_start)
    latest_first = sorted(((at, name) for name, at in started.items() if at < first), reverse=True)
    compared = ((at, stored_explanation(db, name, week)) for at, name in latest_first)
    with_answer = ((at, earlier) for at, earlier in compared if earlier is not None)
    failing = takewhile(lambda pair: _fails_alike(pair[1], explanation), with_answer)
    return min((at for at, _ in failing), default=first)


def _fails_alike(earlier: MachineExplanation, explanation: MachineExplanation) -> bool:
    """Whether the model failed ``earlier``, too, and of another error only where one of the two names none.

    By the errors, not by their shapes: that of a free one is named by its parts, which differ from week to week.
    """
    if earlier.comparison.verdict is not Verdict.SOMETHING_IS_MISSING:
        return False
    errors, errors_before = _errors(explanation), _errors(earlier)
    return not errors_before or not errors or bool(errors_before & errors)


def _errors(explanation: MachineExplanation) -> set[str]:
    """The errors of the effects that are missing, and of those that do the same."""
    effects = (
        name for missing in explanation.missing for name in (missing.effect, *missing.indistinguishable_from)
    )
    return {name.partition(":")[0] for name in effects}
