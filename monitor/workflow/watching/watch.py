"""One look at a watched folder: what came and is at rest is imported, identified, reported and told.

Where no report is asked for, what the next one rests on is computed: on Monday it only has to be written.

An arrival is marked as done after it was told, by its path and fingerprint. Whatever is killed before starts again at
the next look, where the import says "unchanged" and what is identified stays so: only telling may happen twice, and
only for a look that died while it told. Looks at one database take turns, so that a second watcher finds nothing left.
Nothing in the folder is moved, changed or removed.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path

from monitor.exceptions import DataError, EffectError, InputError, NotFoundError, StoreError
from monitor.reporting.messages import may_still_be_copied
from monitor.store import (
    Database,
    list_campaigns,
    load_analysis,
    not_identified,
    one_at_a_time,
    save_analysis,
    stored_analyses,
)
from monitor.workflow.health.ahead import compute_ahead
from monitor.workflow.health.report import report
from monitor.workflow.health.request import ReportAnswer, ReportRequest
from monitor.workflow.health.weeks import week_of
from monitor.workflow.identify.identify import identify
from monitor.workflow.identify.request import IdentifyRequest
from monitor.workflow.intake.importing import ImportedFolder, ImportRequest, RefusedFolder, import_folders
from monitor.workflow.watching.arrivals import Arrival, arrivals, campaign_folders
from monitor.workflow.watching.letter import mailed
from monitor.workflow.watching.request import ArrivedCampaign, WaitingArrival, WatchAnswer, WatchRequest

KIND = "watched arrival"
#: Marks that are read: of an arrival that was forgotten the import would say "unchanged".
MOST_MARKS = 100_000


def watch(
    db: Database,
    request: WatchRequest,
    *,
    progress: Callable[[str], None] = lambda name: None,
) -> WatchAnswer:
    """Look once at a folder, take in what came, and write to those who are to know before it is marked as done.

    Raises InputError where the folder cannot be listed, the report not be written or the mail not be sent, which leaves
    the arrivals of this look for the next one; StoreError where the database cannot be used.
    """
    with one_at_a_time(db, "watch"):
        fingerprints = _done(db)
        present = arrivals(request.folder)
        fresh = [arrival for arrival in present if fingerprints.get(_path(arrival)) != arrival.fingerprint]
        waiting = {arrival: why for arrival in fresh if (why := _why_to_wait(arrival, request.rest_s))}
        arrived: list[ArrivedCampaign] = []
        refused: list[RefusedFolder] = []
        finished = [arrival for arrival in fresh if arrival not in waiting]
        for arrival in finished:
            progress(arrival.path.name)
            campaigns, why = _taken_in(db, arrival)
            arrived += campaigns
            if why is not None:
                refused.append(RefusedFolder(str(arrival.path), why))
        answer = WatchAnswer(
            str(request.folder),
            tuple(arrived),
            tuple(refused),
            tuple(WaitingArrival(str(arrival.path), why) for arrival, why in waiting.items()),
            _reported(db, arrived, request.reports),
        )
        if request.mail is not None and answer.news:
            answer = replace(answer, mailed_to=mailed(request.mail, answer))
        for arrival in finished:
            save_analysis(
                db, KIND, {"arrival": _path(arrival), "fingerprint": arrival.fingerprint}, method="fingerprint"
            )  # fmt: skip
    return answer


def _path(arrival: Arrival) -> str:
    return str(arrival.path.absolute()).encode("utf-8", "backslashreplace").decode("utf-8")


def _done(db: Database) -> Mapping[str, str]:
    """The fingerprint by path under which an arrival was last done with."""
    marks = sorted(stored_analyses(db, KIND, most=MOST_MARKS), key=lambda mark: mark.number)
    return {str(mark.document["arrival"]): str(mark.document["fingerprint"]) for mark in marks}


def _why_to_wait(arrival: Arrival, rest_s: float) -> str | None:
    if arrival.lacks is not None:
        return arrival.lacks
    still = time.time() - arrival.changed_at
    # A clock that was put back, or that of a server in the future, must not keep an arrival waiting for ever.
    if 0.0 <= still < rest_s or -rest_s < still < 0.0:
        return may_still_be_copied(max(still, 0.0))
    return None


def _taken_in(db: Database, arrival: Arrival) -> tuple[list[ArrivedCampaign], str | None]:
    """Import and identify the campaigns of an arrival; those of it that went well, and why others were refused."""
    try:
        with campaign_folders(arrival.path) as folders:
            imported, faults = _imported(db, folders)
            if faults is not None and arrival.path not in folders:
                # The names of the folder that a zip was unpacked into say nothing to anybody.
                faults = re.sub(r"\S*monitor-watch-[^/\\\s]+", lambda room: str(arrival.path), faults)
            return [_identified(db, arrival, folder) for folder in imported], faults
    except StoreError:
        raise
    except (InputError, OSError) as error:
        return [], str(error)


def _imported(db: Database, folders: Sequence[Path]) -> tuple[list[ImportedFolder], str | None]:
    imported: list[ImportedFolder] = []
    faults: list[str] = []
    for folder in folders:
        try:
            imported += import_folders(db, ImportRequest([folder])).imported
        except StoreError:
            raise
        except InputError as error:
            faults.append(str(error))
    return imported, "\n".join(faults) or None


def _identified(db: Database, arrival: Arrival, imported: ImportedFolder) -> ArrivedCampaign:
    """Identify a campaign that is not identified yet; one that cannot be is in the database all the same."""
    why_not = None
    try:
        if _needs_identification(db, imported):
            identify(db, IdentifyRequest(imported.campaign))
    except StoreError:
        raise
    except (DataError, EffectError, InputError) as error:
        why_not = str(error)
    return ArrivedCampaign(
        campaign=imported.campaign,
        arrival=str(arrival.path),
        state=imported.state,
        runs=imported.runs,
        rows=imported.rows,
        identified=why_not is None,
        why_not=why_not,
        notes=imported.notes,
    )


def _needs_identification(db: Database, imported: ImportedFolder) -> bool:
    if imported.rows is None:
        return imported.campaign in not_identified(db)
    try:
        load_analysis(db, "identification", campaign=imported.campaign)
    except NotFoundError:
        return True
    return False


def _reported(db: Database, arrived: Sequence[ArrivedCampaign], reports: Path | None) -> ReportAnswer | None:
    """The report of the week of the last run that came; None where no machine was measured or none is asked for, when
    its results are computed ahead."""
    names = {campaign.campaign for campaign in arrived}
    last_runs = [
        row.last_run_at.date()
        for row in list_campaigns(db)
        if row.campaign in names and row.rows is None and row.last_run_at is not None
    ]
    if not last_runs:
        return None
    if reports is None:
        compute_ahead(db, names, date.today())
        return None
    week = week_of(min(max(last_runs), date.today()))
    return report(db, ReportRequest(week.name, out=reports, made_at=datetime.now().astimezone()))
