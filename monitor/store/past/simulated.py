"""Campaigns that nobody measured: their machine file says ``virtual = true``."""

from __future__ import annotations

from collections.abc import Collection

from monitor.store.connection import Database

# The text is looked through first: reading the JSON of every campaign of a fleet takes ten times as long.
_SIMULATED = """
SELECT machine, list(campaign ORDER BY campaign_id) FROM campaign
WHERE contains(CAST(machine_description AS VARCHAR), '"virtual"') AND (machine_description ->> 'virtual') = 'true'
{among} GROUP BY machine ORDER BY machine
"""


def simulated_campaigns(db: Database, campaigns: Collection[str] | None = None) -> dict[str, tuple[str, ...]]:
    """Return by machine the simulated campaigns that count, as imported: all or those among ``campaigns``."""
    if campaigns is None:
        rows = db.rows(_SIMULATED.format(among=""))
    else:
        rows = db.rows(_SIMULATED.format(among="AND campaign IN (SELECT unnest(?))"), [list(campaigns)])
    return {machine: tuple(names) for machine, names in rows}
