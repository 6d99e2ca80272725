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


def check_machine(db: Database, machine: str) -> None:
    """Raise NotFoundError, listing what is there, for a machine that is not."""
    # Not through the view `machine`, which looks at every campaign of the fleet.
    known = "SELECT 1 FROM campaign WHERE machine = $machine UNION ALL SELECT 1 FROM event WHERE machine = $machine"
    if not db.rows(f"{known} LIMIT 1", {"machine": machine}):
        raise NotFoundError(f"there is no machine {machine!r}; {_what_is_there(db, 'machine')}")


def _what_is_there(db: Database, table: str) -> str:
    names = [name for (name,) in db.rows(f"SELECT {table} FROM {table} ORDER BY {table} LIMIT 21")]
    if not names:
        return f"the database {db.path} is still empty"
    return "there are " + ", ".join(names[:20]) + (" and more" if len(names) > 20 else "")
