"""Readings that no machine of the file fits, with the exchanged column, sign or unit that explains it."""

from __future__ import annotations

from monitor.exceptions import DataError
from monitor.records import Campaign
from monitor.store import StoredModel
from monitor.workflow.identify.fitting import machine_problem


def with_mistake(refusal: DataError, campaign: Campaign, model: StoredModel) -> DataError:
    """The refusal of a fit, and in a second sentence the mistake of the file that explains it, where one does."""
    # Loaded here: only readings that contradict the file need the search.
    from monitor.discovery import find_mistakes
    from monitor.reporting.machine_finding import mistake_sentence
    from monitor.workflow.explain.machine_answer import mistakes_found

    mistakes = find_mistakes(campaign, lambda changed: machine_problem(changed, model), None)
    return DataError(f"{refusal}. {mistake_sentence(mistakes_found(mistakes))}") if mistakes else refusal
