"""Model against measurement on a machine's page: what the stored explanation says, and of which runs."""

from __future__ import annotations

from typing import Any

from monitor.reporting.health import MissingEffect, ModelHealth
from monitor.workflow.health_history import Span, plain

Document = dict[str, Any]


def model_of(explained: Document | None, span: Span) -> ModelHealth | None:
    """The comparison, which is of the runs of ``span``: their number and days are said with it."""
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
    )


def _runs_in_words(campaign: str, span: Span) -> str:
    first, last = f"{span.first:%Y-%m-%d}", f"{span.last:%Y-%m-%d}"
    days = first if first == last else f"{first} to {last}"
    runs = "the one run" if span.count == 1 else f"all {span.count} runs"
    if not span.later:
        return f"{runs} of campaign {campaign}, {days}"
    return f"{runs} of campaign {campaign} until the end of the week, {days}; {span.later} later left out"
