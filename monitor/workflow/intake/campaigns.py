"""The campaigns in the database and the runs of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED
from monitor.exceptions import InputError
from monitor.store import (
    CampaignRow,
    CopiedCampaign,
    Database,
    RunRow,
    WithdrawnCampaign,
    campaign_notes,
    copied_campaigns,
    list_campaigns,
    list_runs,
    list_withdrawn,
    load_campaign,
    noted_campaigns,
)

#: Words that campaigns are searched by.
MOST_WORDS = 20


@dataclass(frozen=True)
class CampaignsRequest:
    """All campaigns, or those of a ``machine`` or a ``method``, or the one of a name, or only the ``latest`` so many of
    import.

    ``containing``, words parted by spaces: only campaigns that hold all of them in their name, machine or method,
    capital letters like small ones.
    """

    machine: str | None = None
    campaign: str | None = None
    latest: int | None = None
    containing: str = ""
    method: str | None = None

    def __post_init__(self) -> None:
        if len(self.containing.split()) > MOST_WORDS:
            raise InputError(f"containing: at most {MOST_WORDS} words")
        if self.latest is not None and not 1 <= self.latest <= 1_000_000:
            raise InputError(f"latest {self.latest}: the number of campaigns, from 1 to 1000000")


@dataclass(frozen=True)
class CampaignsAnswer:
    """The campaigns that count, in the order of import, and those that were withdrawn.

    ``copied`` are those among them that hold runs of earlier ones, or whose runs later ones hold; ``noted`` says of how
    many the import noticed something, and how many sentences.
    """

    campaigns: tuple[CampaignRow, ...]
    withdrawn: tuple[WithdrawnCampaign, ...]
    copied: tuple[CopiedCampaign, ...] | None = field(default=None, metadata=OMITTED)
    noted: Mapping[str, int] | None = field(default=None, metadata=OMITTED)


_ALL = CampaignsRequest()


@dataclass(frozen=True)
class RunsRequest:
    """The campaign whose runs are listed."""

    campaign: str


@dataclass(frozen=True)
class RunsAnswer:
    """The runs of a campaign with their conditions, and what was noticed at its import.

    ``topology`` is the chain of its machine, by which plain names say to what an orientation is an angle.
    """

    campaign: str
    topology: str
    runs: tuple[RunRow, ...]
    notes: tuple[str, ...]


def campaigns(db: Database, request: CampaignsRequest = _ALL) -> CampaignsAnswer:
    """List the campaigns in the database, and those that were withdrawn."""
    sought = request.containing.lower().split()
    rows = list_campaigns(db, request.machine, request.campaign, request.latest, sought, request.method)
    withdrawn = [
        row
        for row in list_withdrawn(db)
        if request.machine in (None, row.machine)
        and request.campaign in (None, row.campaign)
        and request.method in (None, row.method)
        and all(word in f"{row.campaign} {row.machine} {row.method}".lower() for word in sought)
    ]
    numbers = [row.campaign_id for row in rows]
    asks_for_all = request == _ALL
    return CampaignsAnswer(
        rows,
        tuple(withdrawn),
        copied_campaigns(db, None if asks_for_all else numbers) or None,
        noted_campaigns(db, numbers) or None,
    )


def runs(db: Database, request: RunsRequest) -> RunsAnswer:
    """List the runs of a campaign. Raises NotFoundError, DataError for a curve, which has none."""
    topology = load_campaign(db, request.campaign).machine.topology
    return RunsAnswer(
        request.campaign, topology, list_runs(db, request.campaign), campaign_notes(db, request.campaign)
    )
