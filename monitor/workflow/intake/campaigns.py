"""The campaigns in the database and the runs of each."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

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


def records(frame: Any) -> list[dict[str, Any]]:
    """Return the rows of a table as JSON has them; moments in ISO 8601, with Z where they are in UTC."""
    return [
        {str(key): _plain(value, str(key)) for key, value in row.items()} for row in frame.to_dict("records")
    ]


def _plain(value: Any, name: str = "") -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, datetime):
        # The store keeps UTC without its zone; local times are named so.
        zone = "Z" if value.tzinfo is None and not name.endswith("_local") else ""
        return None if str(value) == "NaT" else value.isoformat() + zone
    if hasattr(value, "isoformat"):
        return None if str(value) == "NaT" else value.isoformat()
    if hasattr(value, "tolist"):
        return value.tolist()
    return None if value != value else value
