"""What is there: campaigns, runs and machines by name, and the words for a name that is not there."""

from __future__ import annotations

import pandas as pd

from monitor.exceptions import NotFoundError
from monitor.records import Machine
from monitor.store.connection import Database
from monitor.store.record_json import machine_record


def list_campaigns(db: Database) -> pd.DataFrame:
    """All campaigns, in the order of import: the view ``v_campaigns``."""
    return db.frame("SELECT * FROM v_campaigns ORDER BY campaign_id")


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
        raise NotFoundError(f"there is no campaign {name!r}; {_what_is_there(db, 'campaign')}")
    return int(found[0][0])


def check_machine(db: Database, machine: str) -> None:
    """Raise NotFoundError, listing what is there, for a machine that is not."""
    if not db.rows("SELECT machine FROM machine WHERE machine = ?", [machine]):
        raise NotFoundError(f"there is no machine {machine!r}; {_what_is_there(db, 'machine')}")


def _what_is_there(db: Database, table: str) -> str:
    names = [name for (name,) in db.rows(f"SELECT {table} FROM {table} ORDER BY {table} LIMIT 21")]
    if not names:
        return f"the database {db.path} is still empty"
    return "there are " + ", ".join(names[:20]) + (" and more" if len(names) > 20 else "")
