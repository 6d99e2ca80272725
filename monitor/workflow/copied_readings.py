"""What every answer about a campaign repeats: runs that equal others', and rows of a run that equal earlier ones.

The import says so once; who reads the numbers later never saw it. Copies in other campaigns are asked of the database
each time, since they come and are withdrawn while the campaign stays as it is.
"""

from __future__ import annotations

from monitor.documents import Said
from monitor.readers.doubts.repeated_rows import rows_repeated
from monitor.records import Campaign, CurveCampaign
from monitor.reporting.run_notes import RowsRepeated
from monitor.store import Database, copy_notes


def copied_readings(db: Database, measured: Campaign | CurveCampaign) -> tuple[Said, ...] | None:
    """The sentences on readings of a campaign that are copies; None where there are none, and of a curve."""
    if isinstance(measured, CurveCampaign):
        return None
    return (*copy_notes(db, measured.name), *_repeated(measured)) or None


def _repeated(campaign: Campaign) -> tuple[RowsRepeated, ...]:
    rows = rows_repeated(campaign)
    if rows is None:
        return ()
    return (RowsRepeated(rows.run, len(rows.sequences), rows.sequences[0], rows.of, rows.may_be_passes),)
