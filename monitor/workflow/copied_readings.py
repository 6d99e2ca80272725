"""What every answer about a campaign repeats: runs that equal others', and rows of a run that equal earlier ones.

The import says so once; who reads the numbers later never saw it. Copies in other campaigns are asked of the database
each time, since they come and are withdrawn while the campaign stays as it is. Of a history, whose readings nobody
loads, it is said by the hashes of runs alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from monitor.documents import Said
from monitor.readers.doubts.repeated_rows import rows_repeated
from monitor.records import Campaign, CurveCampaign
from monitor.reporting.messages import more_copies
from monitor.store import Database, campaign_numbers, copied_campaigns, copy_notes

if TYPE_CHECKING:
    from monitor.reporting.run_notes import RowsRepeated

#: So many campaigns of a history are named beside those that they equal.
MOST_NAMED = 5


def copied_readings(db: Database, measured: Campaign | CurveCampaign) -> tuple[Said, ...] | None:
    """The sentences on readings of a campaign that are copies; None where there are none, and of a curve."""
    if isinstance(measured, CurveCampaign):
        return None
    return (*copy_notes(db, measured.name), *_repeated(measured)) or None


def copies_in_history(db: Database, campaigns: Iterable[str]) -> tuple[Said, ...] | None:
    """The sentences on campaigns that hold runs of others, where either is one of some; None without any."""
    copied = copied_campaigns(db, campaign_numbers(db, tuple(campaigns)))
    more = (more_copies(len(copied) - MOST_NAMED),) if len(copied) > MOST_NAMED else ()
    return (*map(str, copied[:MOST_NAMED]), *more) or None


def _repeated(campaign: Campaign) -> tuple[RowsRepeated, ...]:
    rows = rows_repeated(campaign)
    if rows is None:
        return ()
    # Most campaigns have none, and the kinds of notes are many.
    from monitor.reporting.run_notes import RowsRepeated

    return (RowsRepeated(rows.run, len(rows.sequences), rows.sequences[0], rows.of, rows.may_be_passes),)
