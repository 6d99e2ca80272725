"""What is there: campaigns, runs and machines by name, and the words for a name that is not there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING

from monitor.documents import IN_UTC, OMITTED
from monitor.exceptions import DataError, NotFoundError, did_you_mean
from monitor.records import Machine, Setup
from monitor.store.connection import Database
from monitor.store.past.campaign_runs import imported_campaigns
from monitor.store.record_json import as_imported, machine_record, setups_record

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class CampaignRow:
    """A campaign as the view ``v_campaigns`` has it. A curve has ``rows`` and no runs; others have no ``rows``."""

    campaign_id: int
    campaign: str
    machine: str
    method: str
    runs: int
    probings: int
    first_run_at: datetime | None = field(metadata=IN_UTC)
    last_run_at: datetime | None = field(metadata=IN_UTC)
    days: int | None
    probe: str | None
    probe_u_um: float | None
    artefact: str | None
    scale_bar_mm: float | None
    scale_bar_certificate: str | None
    imported_at: datetime = field(metadata=IN_UTC)
    simulated: bool
    rows: int | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class WithdrawnCampaign:
    """A campaign that no longer counts."""

    campaign: str
    machine: str
    method: str
    imported_at: datetime = field(metadata=IN_UTC)
    withdrawn_at: datetime = field(metadata=IN_UTC)
    reason: str


@dataclass(frozen=True)
class RunRow:
    """A run as the view ``v_runs`` has it; ``started_at_local`` is by the shop's clock."""

    campaign: str
    machine: str
    run: int
    started_at: datetime = field(metadata=IN_UTC)
    started_at_local: datetime
    day: int
    warm_up: bool
    ambient_degc: float | None
    conditions: Mapping[str, float]


_CAMPAIGNS = """
SELECT v.*, c."rows" FROM v_campaigns AS v LEFT JOIN (
    SELECT campaign_id, count(*) AS "rows" FROM curve_row GROUP BY campaign_id
) AS c USING (campaign_id) ORDER BY campaign_id
"""
#: The same for a few by their numbers, which stand in each part: the view counts the runs of every campaign first,
#: 1.5 s of processor time where there are 1.7 million.
_NUMBERED = """
SELECT c.campaign_id, c.campaign, c.machine, c.method, coalesce(len(r.run), 0) AS runs,
       coalesce(p.probings, 0) AS probings, list_min(r.started_at) AS first_run_at,
       list_max(r.started_at) AS last_run_at,
       nullif(len(list_distinct(r.day)), 0) AS days, c.probe ->> 'id' AS probe,
       CAST(c.probe ->> 'standard_uncertainty' AS DOUBLE) / 0.001 AS probe_u_um, c.artefact ->> 'id' AS artefact,
       CAST(c.artefact -> 'scale_bar' ->> 'length' AS DOUBLE) AS scale_bar_mm,
       c.artefact -> 'scale_bar' ->> 'certificate' AS scale_bar_certificate, c.imported_at,
       coalesce((c.machine_description ->> 'virtual') = 'true', false) AS simulated, q."rows"
FROM (SELECT * FROM imported_campaign WHERE campaign_id IN ({numbers})) AS c
ANTI JOIN withdrawn_campaign USING (campaign_id)
LEFT JOIN (SELECT campaign_id, run, started_at, day FROM campaign_runs WHERE campaign_id IN ({numbers})) AS r
    USING (campaign_id)
LEFT JOIN (
    SELECT campaign_id, count(*) AS probings FROM probing WHERE campaign_id IN ({numbers}) GROUP BY campaign_id
) AS p USING (campaign_id)
LEFT JOIN (
    SELECT campaign_id, count(*) AS "rows" FROM curve_row WHERE campaign_id IN ({numbers}) GROUP BY campaign_id
) AS q USING (campaign_id)
ORDER BY campaign_id
"""


def list_campaigns(
    db: Database, machine: str | None = None, campaign: str | None = None, latest: int | None = None,
    sought: Sequence[str] = (), method: str | None = None,
) -> tuple[CampaignRow, ...]:  # fmt: skip
    """Return the campaigns that count, in the order of import: all, of a machine or method, of a name, with all
    ``sought`` words (small letters) in name, machine or method, the ``latest`` so many of them."""
    numbers: list[int] | None = None
    if machine is not None:
        numbers = [number for number, _, _ in imported_campaigns(db, machine)]
    if campaign is not None:
        named = {
            number for (number,) in db.rows("SELECT campaign_id FROM campaign WHERE campaign = ?", [campaign])
        }
        numbers = sorted(named if numbers is None else named.intersection(numbers))
    if sought or method is not None:
        searched = set(_searched(db, sought, method))
        numbers = sorted(searched if numbers is None else searched.intersection(numbers))
    if latest is not None:
        if numbers is None:
            last = "SELECT campaign_id FROM campaign ORDER BY campaign_id DESC LIMIT ?"
            numbers = sorted(number for (number,) in db.rows(last, [latest]))
        numbers = numbers[-latest:]
    if numbers is None:
        return db.records(CampaignRow, _CAMPAIGNS)
    if not numbers:
        return ()
    listed = ", ".join(str(int(number)) for number in numbers)
    return db.records(CampaignRow, _NUMBERED.format(numbers=listed))


def _searched(db: Database, sought: Sequence[str], method: str | None) -> list[int]:
    """The numbers of the campaigns of a method whose name, machine or method hold every word."""
    conditions = ["contains(lower(concat_ws(' ', campaign, machine, method)), ?)"] * len(sought)
    conditions += ["method = ?"] if method is not None else []
    query = f"SELECT campaign_id FROM campaign WHERE {' AND '.join(conditions)}"
    return [number for (number,) in db.rows(query, [*sought, *([method] if method is not None else [])])]


def list_withdrawn(db: Database) -> tuple[WithdrawnCampaign, ...]:
    """Return the campaigns that no longer count, by the time of withdrawal."""
    return db.records(
        WithdrawnCampaign,
        "SELECT campaign, machine, method, imported_at, withdrawn_at, reason FROM v_withdrawn_campaigns "
        "ORDER BY withdrawn_at, campaign_id",
    )


def list_runs(db: Database, campaign: str) -> tuple[RunRow, ...]:
    """Return the runs of a campaign in file order. Raises NotFoundError."""
    campaign_number(db, campaign)
    return db.records(RunRow, "SELECT * FROM v_runs WHERE campaign = ?", [campaign])


def described_machines(db: Database) -> tuple[Machine, ...]:
    """Every machine by name, as its latest campaign describes it. Raises StoreError for one that is not described."""
    machines = []
    for campaign, text in db.rows(
        "SELECT arg_max(campaign, campaign_id), arg_max(machine_description, campaign_id) FROM campaign "
        "WHERE method <> 'curve' GROUP BY machine ORDER BY machine"
    ):
        with as_imported(campaign):
            machines.append(machine_record(text))
    return tuple(machines)


def described_setups(db: Database, campaign: str | None) -> tuple[Setup, ...]:
    """The setups of instruments of a ``campaign``, else of all that count, each as every campaign states it.

    Raises NotFoundError listing what is there, StoreError for a campaign that is not described.
    """
    of_campaign = "" if campaign is None else f" AND campaign_id = {campaign_number(db, campaign)}"
    setups: dict[Setup, None] = {}
    for name, text in db.rows(
        "SELECT arg_min(campaign, campaign_id), artefact FROM campaign WHERE (artefact -> 'setups') IS NOT NULL"
        f"{of_campaign} GROUP BY artefact ORDER BY min(campaign_id)"
    ):
        with as_imported(name):
            setups.update(dict.fromkeys(setups_record(text)))
    return tuple(setups)


def campaign_number(db: Database, name: str) -> int:
    """The number of a campaign in the tables. Raises NotFoundError listing what is there."""
    numbers = db.rows("SELECT campaign_id FROM campaign WHERE campaign = ?", [name])
    if not numbers:
        raise NotFoundError(
            f"there is no campaign {name!r}; {_withdrawn(db, name)}{_what_is_there(db, 'campaign', name)}"
        )
    number = int(numbers[0][0])
    if not db.is_same_campaign(name, number):
        raise DataError(
            f"campaign {name!r} was withdrawn and imported again by somebody else meanwhile; what was computed of the "
            "campaign of before is not stored: type the command again"
        )
    return number


def _withdrawn(db: Database, name: str) -> str:
    """Whether a campaign of that name was withdrawn, in words before others; empty where none was."""
    withdrawals = db.rows(
        "SELECT withdrawn_at, reason FROM v_withdrawn_campaigns WHERE campaign = ? ORDER BY withdrawn_at DESC LIMIT 1",
        [name],
    )
    return f"it was withdrawn on {withdrawals[0][0]:%Y-%m-%d} ({withdrawals[0][1]}); " if withdrawals else ""


def campaigns_of_machine(db: Database, machine: str) -> dict[int, tuple[str, str]]:
    """Name and method of every campaign of a machine that counts, by its number, in the order of import.

    Raises NotFoundError, listing what is there, for a machine that has neither a campaign that counts nor an event.
    """
    imported = imported_campaigns(db, machine)
    counting = _counting(db, [number for number, _, _ in imported])
    if not counting and not _has_event(db, machine):
        raise _no_machine(db, machine)
    return {number: (name, method) for number, name, method in imported if number in counting}


def check_machine(db: Database, machine: str) -> None:
    """Raise NotFoundError, listing what is there, for a machine that is not."""
    # The first campaign that counts suffices: looking for all of them reads the machine of every campaign of the fleet.
    counts = db.rows(
        "SELECT 1 FROM imported_campaign "
        "WHERE machine = ? AND campaign_id NOT IN (SELECT campaign_id FROM withdrawn_campaign) LIMIT 1",
        [machine],
    )
    if not counts and not _has_event(db, machine):
        raise _no_machine(db, machine)


def _counting(db: Database, numbers: list[int]) -> set[int]:
    """Which of these campaigns the view ``campaign`` has: what it leaves out is left out here.

    Through the view DuckDB looks at every campaign of the fleet for those of one machine (30 ms of 2.6 million); the
    campaigns of one machine are few.
    """
    if not numbers:
        return set()
    withdrawn = {number for (number,) in db.rows("SELECT campaign_id FROM withdrawn_campaign")}
    return set(numbers) - withdrawn


def _has_event(db: Database, machine: str) -> bool:
    return bool(db.rows("SELECT 1 FROM event WHERE machine = ? LIMIT 1", [machine]))


def _no_machine(db: Database, machine: str) -> NotFoundError:
    return NotFoundError(f"there is no machine {machine!r}; {_what_is_there(db, 'machine', machine)}")


def _what_is_there(db: Database, table: str, name: str) -> str:
    """What a table has instead of ``name``: the nearest, and the first twenty."""
    names = [name for (name,) in db.rows(f"SELECT {table} FROM {table} ORDER BY {table}")]
    if not names:
        return f"the database {db.path} is still empty"
    return (
        f"{did_you_mean(name, names)}there are "
        + ", ".join(names[:20])
        + (" and more" if len(names) > 20 else "")
    )
