"""The weekly health report: the state of every machine is found and stored, then HTML and PDF are written from that.

A few machines are held at a time: a record is stored as it is found, and read again when its page is written. What is
to be computed, and the PDF, may be spread over processes (``health_work``); this one alone has the database.
"""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from datetime import UTC, date, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

from monitor import __version__
from monitor.documents import from_document, to_document
from monitor.exceptions import InputError
from monitor.reporting.health.records import ALARMS, Fleet, FleetRow, MachineHealth, by_urgency, fleet_row
from monitor.reporting.health.render import MACHINES_A_PART, health_html, health_pdf
from monitor.store import Database, list_machines, save_analysis
from monitor.store.catalogue import check_machine
from monitor.uncertainty.engine import Engine, Here, in_order
from monitor.uncertainty.processes import processes
from monitor.workflow.certificate.files import why_not
from monitor.workflow.health.machine import Begun, Settings, begun, machine_health
from monitor.workflow.health.refusals import refused_elsewhere
from monitor.workflow.health.weeks import Week, week_before, week_named
from monitor.workflow.health.work import Work, computed
from monitor.workflow.history.health_history import check_campaigns, makers
from monitor.workflow.intake.campaigns import records

Document = dict[str, Any]
KIND = "health"
#: Processes by default: at most so many (each needs up to 0.7 GB while it writes a part of the PDF), and one for so
#: many machines, since a process starts in the time in which a machine or two are computed.
MOST_WORKERS = 4
MACHINES_A_WORKER = 4


def report(
    db: Database,
    week: str | None = None,
    machine: str | None = None,
    out: Path | None = None,
    *,
    settings: Settings | None = None,
    made_at: datetime | None = None,
    progress: Callable[[str], None] = lambda name: None,
    workers: int | None = None,
) -> Document:
    """Find, store and write the state of one machine or of all at the end of a week.

    ``week`` like ``2026-W10``, by default the last that has ended. Files go to ``out`` (made where there is
    none, by default the working directory). ``workers`` processes compute, by default as many as there are cores and
    the fleet occupies; the results do not depend on it. Raises InputError for a week that is none, NotFoundError for a
    machine or campaign that is not there.
    """
    today = date.today() if made_at is None else made_at.date()
    chosen = week_named(week) if week else week_before(today)
    if chosen.first > today:
        raise InputError(
            f"--week {chosen.name} begins on {chosen.first}, and today is {today}: nothing can be said of it"
        )
    own = settings or Settings()
    if not 0.0 < own.risk < 1.0:
        raise InputError(f"the probability that alarms must lie between 0 and 1, not {own.risk}")
    if machine is not None:
        check_machine(db, machine)
    check_campaigns(db, own.campaigns)
    measured_by = makers(db, own.campaigns)
    if machine is not None and measured_by is not None and machine not in measured_by:
        raise InputError(
            f"machine {machine} has none of the campaigns chosen ({', '.join(own.campaigns)}); "
            f"they are of {', '.join(sorted(measured_by))}"
        )
    chosen_machines = [
        known
        for known in records(list_machines(db))
        if machine in (None, str(known["machine"]))
        and (measured_by is None or str(known["machine"]) in measured_by)
    ]
    try:
        (out or Path()).mkdir(parents=True, exist_ok=True)  # before minutes of computing
    except OSError as error:
        raise InputError(f"the report cannot be written to {out}: {why_not(out or Path(), error)}") from error
    now = (made_at or datetime.now(UTC)).replace(tzinfo=None, microsecond=0)
    with _engine(workers, len(chosen_machines)) as engine:
        rows = _found(db, chosen_machines, chosen, own, engine, progress)
        fleet = Fleet(
            chosen.name, chosen.first, chosen.last, now, f"machine-health-monitor {__version__}", own.risk,
            tuple(row for row, _ in rows),
            refused_elsewhere(db, {str(known["machine"]) for known in records(list_machines(db))}, chosen),
            ended=today > chosen.last,
        )  # fmt: skip
        files = _write(db, fleet, [number for _, number in rows], out or Path(), machine, engine)
    return _document(fleet, chosen, files)


def _engine(workers: int | None, machines: int) -> AbstractContextManager[Engine]:
    """Where to compute: no more processes than machines, and none beside this one where it would be the only one."""
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: at least one worker is needed")
    if workers is None:
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        workers = min(cores, MOST_WORKERS, machines // MACHINES_A_WORKER)
    wanted = min(workers, machines)
    return nullcontext(Here()) if wanted <= 1 else processes(wanted)


def _found(
    db: Database,
    machines: list[Document],
    week: Week,
    settings: Settings,
    engine: Engine,
    progress: Callable[[str], None],
) -> list[tuple[FleetRow, int]]:
    """The machines' lines by urgency, each with the number of its stored record."""
    in_hand: deque[Begun] = deque()

    def works() -> Iterator[tuple[Work | None]]:
        for known in machines:
            one = begun(
                db, str(known["machine"]), _description(known), str(known["location"] or ""), week, settings
            )
            in_hand.append(one)
            yield (one.work,)

    rows = []
    for done in in_order(engine, computed, works()):
        past = in_hand.popleft()
        progress(past.machine)
        found = machine_health(db, past, done)
        number = save_analysis(
            db, KIND, to_document(found), method=f"{week.name}, alarm above {settings.risk:g}",
            machine=past.machine,
        )  # fmt: skip
        rows.append((fleet_row(found), number))
    return sorted(rows, key=lambda row: by_urgency(row[0]))


def stored_health(db: Database, number: int) -> MachineHealth:
    """The record of a machine as it was stored."""
    return _record(_text(db, number))


def _text(db: Database, number: int) -> str:
    ((text,),) = db.rows("SELECT document FROM v_analyses WHERE analysis_id = ?", [number])
    return str(text)


def _record(text: str) -> MachineHealth:
    return from_document(MachineHealth, json.loads(text))


def _pdf(fleet: Fleet, texts: list[str], part: int, parts: int) -> bytes:
    """A part of the PDF from stored records, in whatever process."""
    return health_pdf(fleet, [_record(text) for text in texts], part, parts)


def _write(
    db: Database, fleet: Fleet, numbers: list[int], out: Path, machine: str | None, engine: Engine
) -> list[str]:
    stem = f"health-{fleet.week}" + (
        "" if machine is None else "-" + "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in machine)
    )  # fmt: skip
    page = out / f"{stem}.html"
    parts = max(1, -(-len(numbers) // MACHINES_A_PART))
    files = [page]
    try:
        with _becoming(page) as stream:
            for piece in health_html(fleet, _stored(db, numbers)):
                stream.write(piece.encode("utf-8"))
        # Of nearly the same length, so that no worker waits for another.
        ends = [len(numbers) * place // parts for place in range(parts + 1)]
        tasks = (
            (fleet, [_text(db, number) for number in numbers[first:end]], place, parts)
            for place, (first, end) in enumerate(pairwise(ends), start=1)
        )
        for place, pdf in enumerate(in_order(engine, _pdf, tasks), start=1):
            path = out / (f"{stem}.pdf" if parts == 1 else f"{stem}-part-{place}-of-{parts}.pdf")
            with _becoming(path) as stream:
                stream.write(pdf)
            files.append(path)
    except OSError as error:
        raise InputError(f"the report cannot be written to {out}: {why_not(out, error)}") from error
    return [str(path) for path in files]


@contextmanager
def _becoming(path: Path) -> Iterator[BinaryIO]:
    """A file that gets its name when it is whole; of one that could not be written nothing stays."""
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as stream:
            yield stream
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def _stored(db: Database, numbers: list[int]) -> Iterator[MachineHealth]:
    for number in numbers:
        yield stored_health(db, number)


def _description(known: Document) -> str:
    maker = " ".join(str(known[key]) for key in ("manufacturer", "machine_model") if known[key])
    serial = f"serial number {known['serial_number']}" if known["serial_number"] else ""
    return ", ".join(part for part in (maker, serial, f"chain {known['topology']}") if part)


def _document(fleet: Fleet, week: Week, files: list[str]) -> Document:
    measured = sum(row.state != "not measured" for row in fleet.rows)
    return {
        "week": week.name,
        "from": week.first.isoformat(),
        "to": week.last.isoformat(),
        "machines": [to_document(row) for row in fleet.rows],
        "measured": measured,
        "ended": fleet.ended,
        "alarms": [row.machine for row in fleet.rows if row.state in ALARMS],
        "refused_imports": [to_document(one) for one in fleet.refused_imports],
        "message": ""
        if measured
        else f"No machine was measured in week {week.name} ({week.first} to {week.last}).",
        "files": files,
    }
