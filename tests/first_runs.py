"""A campaign of its first runs alone: what does not depend on how many there are is asked of few."""

from __future__ import annotations

from dataclasses import replace

from monitor.records import Campaign


def first_runs(campaign: Campaign, count: int) -> Campaign:
    """The campaign with its first ``count`` runs."""
    runs = campaign.runs[:count]
    kept = campaign.probings.run <= runs[-1].run
    return replace(campaign, runs=runs, probings=campaign.probings.rows(kept))
