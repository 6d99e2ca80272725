"""Named selections of runs of a campaign: ``hot-cold-star`` is ``hot-cold`` without its first six hours.

Nothing is replaced: a later selection of the same name stands beside the earlier, and the latest counts. Which
runs meet a condition is decided by who stores it; here they are kept with the words of the condition.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime

from monitor import __version__
from monitor.documents import IN_UTC
from monitor.exceptions import InputError, NotFoundError, did_you_mean
from monitor.store import audit
from monitor.store.catalogue import campaign_number
from monitor.store.connection import Database, utc_now


@dataclass(frozen=True)
class StoredSelection:
    """A selection as it was stored; ``runs`` are the numbers of the chosen runs, rising."""

    number: int
    name: str
    campaign: str
    condition: str
    runs: tuple[int, ...]
    made_at: datetime


@dataclass(frozen=True)
class SelectionRow:
    """A selection as the view ``v_selections`` has it."""

    selection: str
    campaign: str
    machine: str
    condition: str
    runs: tuple[int, ...]
    run_count: int
    made_at: datetime = field(metadata=IN_UTC)
    selection_id: int


def save_selection(db: Database, campaign: str, name: str, condition: str, runs: Sequence[int]) -> int:
    """Keep the ``runs`` of a campaign that meet ``condition`` under a name; its number.

    Raises InputError for an empty name or no runs, NotFoundError for a campaign or run that is not there.
    """
    if not name.strip():
        raise InputError("a selection needs a name, for example hot-cold-star")
    selected = sorted({int(run) for run in runs})
    if not selected:
        raise InputError(f"selection {name} holds no run of campaign {campaign}; nothing was kept")
    with db.transaction():
        campaign_id = campaign_number(db, campaign)
        existing = {run for (run,) in db.rows("SELECT run FROM run WHERE campaign_id = ?", [campaign_id])}
        strange = [run for run in selected if run not in existing]
        if strange:
            raise NotFoundError(f"campaign {campaign!r} has no run {strange[0]}")
        number = db.next_number("selection", "selection_id")
        db.execute(
            "INSERT INTO selection VALUES (?, ?, ?, ?, ?::BIGINT[], ?, ?)",
            [number, campaign_id, name, condition, selected, __version__, utc_now()],
        )
        audit.record(db, "save", "selection", str(number), selection_content(db, number))
    return number


def find_selection(db: Database, name: str, campaign: str | None = None) -> StoredSelection:
    """The latest selection of a name; of ``campaign`` where several campaigns have one of that name.

    Raises NotFoundError listing what is there, InputError where the campaign must be named.
    """
    rows = db.rows(
        "SELECT selection_id, selection, campaign, condition, runs, made_at FROM v_selections "
        "WHERE selection = $name AND ($campaign IS NULL OR campaign = $campaign) ORDER BY campaign",
        {"name": name, "campaign": campaign},
    )
    if not rows:
        existing = [
            f"{other} (of {owner})"
            for other, owner in db.rows("SELECT selection, campaign FROM v_selections ORDER BY ALL LIMIT 21")
        ]
        others = [other for (other,) in db.rows("SELECT DISTINCT selection FROM v_selections")]
        of = "" if campaign is None else f" of campaign {campaign}"
        raise NotFoundError(
            f"there is no selection {name!r}{of}; {did_you_mean(name, others)}"
            + (
                f"there are {', '.join(existing[:20])}{' and more' if len(existing) > 20 else ''}"
                if existing
                else f'`monitor select CAMPAIGN --name {name} --where "hours >= 6"` makes one'
            )
        )
    if len(rows) > 1:
        owners = ", ".join(row[2] for row in rows)
        raise InputError(f"selection {name!r} exists for several campaigns ({owners}); name the campaign too")
    number, selection, owner, condition, runs, made_at = rows[0]
    return StoredSelection(number, selection, owner, condition, tuple(runs), made_at)


def list_selections(db: Database, campaign: str | None = None) -> tuple[SelectionRow, ...]:
    """The selections of all campaigns or of one."""
    return db.records(
        SelectionRow,
        "SELECT * FROM v_selections WHERE $campaign IS NULL OR campaign = $campaign ORDER BY campaign, selection",
        {"campaign": campaign},
    )


def selection_content(db: Database, number: int) -> str:
    """The hash of all that is stored of a selection."""
    return audit.digest(*db.rows("SELECT * FROM selection WHERE selection_id = ?", [number]))
