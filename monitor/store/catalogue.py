"""What is there: campaigns, runs and machines by name, and the words for a name that is not there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from monitor.exceptions import NotFoundError
from monitor.records import Machine
from monitor.store.connection import Database
from monitor.store.record_json import machine_record

if TYPE_CHECKING:
    import pandas as pd


def list_campaigns(db: Database) -> pd.DataFrame:
    """All campaigns, in the order of import: the view ``v_campaigns``."""
    return db.frame("SELECT * FROM v_campaigns ORDER BY campaign_id")


def list_withdrawn(db: Database) -> pd.DataFrame:
    """The campaigns that no longer count, by the time of withdrawal: the view ``v_withdrawn_campaigns``."""
    return db.frame("SELECT * FROM v_withdrawn_campaigns ORDER BY withdrawn_at, campaign_id")


def list_runs(db: Database, campaign: str) -> pd.DataFrame:
    """The runs of a campaign in file order: the view ``v_runs``. Raises NotFoundError."""
    campaign_number(db, campaign)
    return db.frame("SELECT * FROM v_runs WHERE campaign = ?", [campaign])


def list_machines(db: Database) -> pd.DataFrame:
    """All machines by name: the view ``v_machines``."""
    return db.frame("SELECT * FROM v_machines ORDER BY machine")


def described_machines(db: Database) -> tuple[Machine, ...]:
    """Every machine by name, as its latest campaign describes it."""
    return tuple(
        machine_record(text)
        for (text,) in db.rows(
            "SELECT arg_max(machine_description, campaign_id) FROM campaign WHERE method <> 'curve' "
            "GROUP BY machine ORDER BY machine"
        )
    )


def campaign_number(db: Database, name: str) -> int:
    """The number of a campaign in the tables. Raises NotFoundError listing what is there."""
    found = db.rows("SELECT campaign_id FROM campaign WHERE campaign = ?", [name])
    if not found:
        raise NotFoundError(
            f"there is no campaign {name!r}; {_withdrawn(db, name)}{_what_is_there(db, 'campaign')}"
        )
    return int(found[0][0])


def _withdrawn(db: Database, name: str) -> str:
    """Whether a campaign of that name was withdrawn, in words before others; empty where none was."""
    found = db.rows(
        "SELECT withdrawn_at, reason FROM v_withdrawn_campaigns WHERE campaign = ? ORDER BY withdrawn_at DESC LIMIT 1",
        [name],
    )
    return f"it was withdrawn on {found[0][0]:%Y-%m-%d} ({found[0][1]}); " if found else ""


def campaigns_of_machine(db: Database, machine: str) -> dict[int, tuple[str, str]]:
    """Name and method of every campaign of a machine that counts, by its number, in the order of import.

    Raises NotFoundError, listing what is there, for a machine that has neither a campaign that counts nor an event.
    """
    found = db.rows(
        "SELECT campaign_id, campaign, method FROM imported_campaign WHERE machine = ? ORDER BY campaign_id",
        [machine],
    )
    counting = _counting(db, [number for number, _, _ in found])
    if not counting and not _has_event(db, machine):
        raise _no_machine(db, machine)
    return {number: (name, method) for number, name, method in found if number in counting}


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

    Through the view DuckDB looks at every campaign of the fleet for those of one machine (30 ms of 2.6 million): it
    takes the index only where a table is asked by itself, and the campaigns of one machine are few.
    """
    if not numbers:
        return set()
    withdrawn = {number for (number,) in db.rows("SELECT campaign_id FROM withdrawn_campaign")}
    return set(numbers) - withdrawn


def _has_event(db: Database, machine: str) -> bool:
    return bool(db.rows("SELECT 1 FROM event WHERE machine = ? LIMIT 1", [machine]))


def _no_machine(db: Database, machine: str) -> NotFoundError:
    return NotFoundError(f"there is no machine {machine!r}; {_what_is_there(db, 'machine')}")


def _what_is_there(db: Database, table: str) -> str:
    names = [name for (name,) in db.rows(f"SELECT {table} FROM {table} ORDER BY {table} LIMIT 21")]
    if not names:
        return f"the database {db.path} is still empty"
    return "there are " + ", ".join(names[:20]) + (" and more" if len(names) > 20 else "")
