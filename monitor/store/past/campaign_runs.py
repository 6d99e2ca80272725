"""The runs of a campaign in one row, beside a hash of its machine: what the history of one machine is read from.

``run`` holds the same runs a row each, for people and for the fleet; there the runs of one machine lie scattered over
the weeks, and the campaigns of one machine are only found by its name among those of all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from monitor.store.connection import Database
from monitor.store.past.gathering import CAMPAIGN_RUNS, PORTION, RUN_LISTS, gather

# A key is looked up only where it stands alone in the condition.
_CAMPAIGNS = """
SELECT campaign_id FROM campaign_runs WHERE machine_hash = CAST(md5_number_lower(?) % 16777216 AS INTEGER)
"""
_HEADS = """
SELECT campaign_id, campaign, method, machine FROM imported_campaign WHERE campaign_id IN ({marks})
"""
_RUNS = """
SELECT campaign_id, unnest(run), unnest(started_at), unnest(utc_offset_s), unnest(day), unnest(warm_up),
       unnest(conditions)
FROM campaign_runs WHERE campaign_id IN ({marks})
"""
_COLUMNS = ("machine_hash", "run", "started_at", "utc_offset_s", "day", "warm_up", "conditions")
_ALTERED = f"""
SELECT campaign FROM ({RUN_LISTS}) AS expected LEFT JOIN campaign_runs AS stored USING (campaign_id)
JOIN imported_campaign USING (campaign_id)
WHERE {" OR ".join(f"expected.{column} IS DISTINCT FROM stored.{column}" for column in _COLUMNS)}
ORDER BY campaign_id
"""


def insert_runs(db: Database, campaign_id: int) -> None:
    """Write the row of a campaign, inside the transaction that has written the campaign and its runs."""
    db.execute(CAMPAIGN_RUNS.sql, {"first": campaign_id, "end": campaign_id + 1})


def imported_campaigns(db: Database, machine: str) -> list[tuple[int, str, str]]:
    """Return number, name and method of the campaigns of a machine in the order of import, withdrawn ones included."""
    # Three questions of one page ask this.
    rows = db.recall(("campaigns of machine", machine), lambda: tuple(_imported_campaigns(db, machine)))
    return list(rows)


def _imported_campaigns(db: Database, machine: str) -> list[tuple[int, str, str]]:
    numbers = [number for (number,) in db.rows(_CAMPAIGNS, [machine])]
    if not numbers:
        return []
    heads = db.rows(_HEADS.format(marks=_marks(numbers)), numbers)
    # Few machines share a hash: the name decides.
    return sorted((number, name, method) for number, name, method, owner in heads if owner == machine)


def run_rows(db: Database, numbers: Sequence[int]) -> list[tuple[Any, ...]]:
    """Return campaign, run, start (UTC), offset in s, day, warm-up and conditions of every run of campaigns."""
    return db.rows(_RUNS.format(marks=_marks(numbers)), list(numbers)) if numbers else []


def run_list_faults(db: Database, portion: int = PORTION) -> Iterator[str]:
    """Yield a sentence for each row that is altered, missing or added, compared with campaigns and runs."""
    ((last,),) = db.rows("SELECT coalesce(max(campaign_id), 0) FROM imported_campaign")
    for first in range(1, last + 1, portion):
        for (campaign,) in db.rows(_ALTERED, {"first": first, "end": first + portion}):
            yield f"the row of campaign {campaign} in campaign_runs was altered: it differs from its runs or machine"
    for (number,) in db.rows(
        "SELECT campaign_id FROM campaign_runs ANTI JOIN imported_campaign USING (campaign_id) ORDER BY ALL"
    ):
        yield f"the row {number} of campaign_runs was added: there is no campaign of that number"


def gather_runs(db: Database, portion: int = PORTION) -> None:
    """Write the rows that are missing after ``run`` was filled by SQL, as large test data are."""
    with db.connected() as connection:
        gather(connection, CAMPAIGN_RUNS, portion)


def _marks(numbers: Sequence[int]) -> str:
    """Return the marks of constants, for which a key is looked up."""
    return ", ".join("?" * len(numbers))
