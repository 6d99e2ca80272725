"""The campaigns in the database and the runs of each."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.store import (
    CampaignRow,
    Database,
    RunRow,
    WithdrawnCampaign,
    campaign_notes,
    list_campaigns,
    list_runs,
    list_withdrawn,
    load_campaign,
)


@dataclass(frozen=True)
class CampaignsAnswer:
    """The campaigns that count, in the order of import, and those that were withdrawn."""

    campaigns: tuple[CampaignRow, ...]
    withdrawn: tuple[WithdrawnCampaign, ...]


@dataclass(frozen=True)
class RunsRequest:
    """The campaign whose runs are listed."""

    campaign: str


@dataclass(frozen=True)
class RunsAnswer:
    """The runs of a campaign with their conditions, and what was noticed at its import."""

    campaign: str
    runs: tuple[RunRow, ...]
    notes: tuple[str, ...]


def campaigns(db: Database) -> CampaignsAnswer:
    """List the campaigns in the database, and those that were withdrawn."""
    return CampaignsAnswer(list_campaigns(db), list_withdrawn(db))


def runs(db: Database, request: RunsRequest) -> RunsAnswer:
    """List the runs of a campaign. Raises NotFoundError, DataError for a curve, which has none."""
    load_campaign(db, request.campaign)
    return RunsAnswer(request.campaign, list_runs(db, request.campaign), campaign_notes(db, request.campaign))
