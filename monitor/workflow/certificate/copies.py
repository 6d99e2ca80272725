"""The grounds against a certificate that other campaigns, or other rows of the same run, give: its readings are copies.

They are asked of the database at each issue and stored with no evaluation: copies come and are withdrawn later.
"""

from __future__ import annotations

from collections.abc import Iterator

from monitor.readers.doubts.repeated_rows import rows_repeated
from monitor.records import Campaign
from monitor.reporting.certificate.grounds import AT_ANOTHER_TIME, Ground, GroundKind
from monitor.store import CopiedRun, Database, copied_runs

#: A folder that was imported again and again: so many other campaigns are named.
MOST_NAMED = 5


def copied_grounds(db: Database, campaign: Campaign) -> tuple[Ground, ...]:
    """Runs that equal those of another machine, or of this one at another time, and rows that equal earlier ones.

    A campaign of the same machine whose runs began at the same moments says the same: that is one measurement under two
    names, and no ground.
    """
    return (*_of_runs(copied_runs(db, campaign.name)), *_of_rows(campaign))


def _of_runs(copied: tuple[CopiedRun, ...]) -> Iterator[Ground]:
    by_campaign: dict[str, list[CopiedRun]] = {}
    for run in copied:
        if run.is_of_another or not run.at_the_same_moment:
            by_campaign.setdefault(run.campaign, []).append(run)
    for name, runs in list(by_campaign.items())[:MOST_NAMED]:
        first, count = runs[0], len({run.run for run in runs})
        if first.is_of_another:
            yield Ground(GroundKind.COPIED_RUNS, first.run, f"{name} ({first.machine})", count)
        else:
            yield Ground(GroundKind.COPIED_RUNS, first.run, name, count, None, AT_ANOTHER_TIME)


def _of_rows(campaign: Campaign) -> Iterator[Ground]:
    """Rows that are copies beyond doubt: where a display hides the scatter they may be passes that agree."""
    rows = rows_repeated(campaign)
    if rows is not None and not rows.may_be_passes:
        subject = f"{rows.sequences[0]} = {rows.of}"
        yield Ground(GroundKind.COPIED_ROWS, rows.run, subject, len(rows.sequences))
