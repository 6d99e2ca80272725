"""Model against measurement on a machine's page: what the stored explanation says, and of which runs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from monitor.documents import from_document
from monitor.reporting.health.comparison import (
    ErrorStep,
    MissingEffect,
    ModelHealth,
    ResidualAgainst,
    ResidualMap,
)
from monitor.workflow.history.health_history import Span, plain

Document = dict[str, Any]


def model_of(explained: Document | None, history: list[Document], span: Span) -> ModelHealth | None:
    """The comparison, which is of the runs of ``span``: their number and days are said with it.

    ``history`` has the versions of the model (empty where there is one only).
    """
    if explained is None:
        return None
    return ModelHealth(
        campaign=explained["campaign"],
        runs=_runs_in_words(explained["campaign"], span),
        model=explained["model"],
        verdict=explained["verdict"],
        answer=explained["answer"],
        rms_um=explained["rms_um"],
        repeatability_um=plain(explained["repeatability_um"]),
        lack_of_fit_f=plain(explained["lack_of_fit"]["f"]),
        lack_of_fit_p=plain(explained["lack_of_fit"]["p"]),
        missing=tuple(
            MissingEffect(
                one["effect"],
                one["meaning"],
                one["cause"],
                one["remedy"],
                plain(one["peak_um"]),
                plain(one["rms_before_um"]),
                plain(one["rms_after_um"]),
                tuple(one["indistinguishable_from"]),
            )
            for one in explained["missing"]
        ),
        stated_um=explained["stated_uncertainty_um"],
        where=None
        if explained["residual_map"] is None
        else from_document(ResidualMap, explained["residual_map"]),
        against=_against(explained["residual_against"]),
        steps=tuple(_steps(explained, history)),
    )


def _against(found: Document | None) -> ResidualAgainst | None:
    return None if found is None else from_document(ResidualAgainst, found)


def _steps(explained: Document, history: list[Document]) -> Iterator[ErrorStep]:
    """The error from the method's own model on: what was added, and what adding the missing effects would give."""
    for one in history:
        changed = [f"+ {text}" for text in (one["added"] or "").split(" + ") if text]
        changed += [f"\N{MINUS SIGN} {text}" for text in (one["removed"] or "").split(" + ") if text]
        yield ErrorStep(
            f"{one['model']}: {' '.join(changed) or 'as it is'}", one["rms_um"], one["heldout_rms_um"], False
        )
    missing = explained["missing"]
    if missing and not history:
        first = missing[0]
        yield ErrorStep(
            f"{explained['model']}: as it is", first["rms_before_um"], first["heldout_before_um"], False
        )
    for one in missing:
        yield ErrorStep(f"+ {one['effect']}", one["rms_after_um"], one["heldout_after_um"], True)


def _runs_in_words(campaign: str, span: Span) -> str:
    first, last = f"{span.first:%Y-%m-%d}", f"{span.last:%Y-%m-%d}"
    days = first if first == last else f"{first} to {last}"
    if span.later:
        return f"{span.count} of {span.count + span.later} runs of {campaign}, {days}; the others began after the week"
    return f"{'the one run' if span.count == 1 else f'all {span.count} runs'} of {campaign}, {days}"
