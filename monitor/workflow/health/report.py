"""The weekly health report: the state of every machine is found and stored, then HTML and PDF are written from that.

A few machines are held at a time: a record is stored as it is found, and read again when its page is written. What is
to be computed, and the PDF, may be spread over processes (``task``); this one alone has the database.
"""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from datetime import UTC, date, datetime
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

from monitor import __version__
from monitor.documents import from_document, to_document
from monitor.exceptions import InputError
from monitor.reporting.health.answers import answers
from monitor.reporting.health.attention import Looked, attention, look_at
from monitor.reporting.health.records import (
    ALARMS,
    Fleet,
    FleetRow,
    MachineHealth,
    State,
    by_urgency,
    fleet_row,
)
from monitor.reporting.health.render import MACHINES_A_PART, health_html, health_pdf
from monitor.reporting.health.sentences import NothingMeasured
from monitor.reporting.weekly_notice import WeeklyNotices, weekly_sentence
from monitor.store import (
    Database,
    analysis_text,
    campaign_machines,
    check_campaigns,
    last_anchor,
    save_analysis,
)
from monitor.store.catalogue import check_machine
from monitor.uncertainty.workers.engine import Engine, in_order
from monitor.workflow.certificate.files import why_not
from monitor.workflow.engines import engine_of
from monitor.workflow.health.machine import (
    MachineName,
    MachineWeek,
    machine_health,
    named_machines,
    read_week,
)
from monitor.workflow.health.refusals import refused_elsewhere
from monitor.workflow.health.request import ReportAnswer, ReportRequest
from monitor.workflow.health.task import Task, computed
from monitor.workflow.health.weeks import Week, week_before, week_named
from monitor.workflow.history.weekly_looks import weekly_notices

KIND = "health"
#: Processes by default: at most so many (each needs up to 0.7 GB while it writes a part of the PDF), and one for so
#: many machines, since a process starts in the time in which a machine or two are computed.
MOST_WORKERS = 4
MACHINES_A_WORKER = 4


def report(
    db: Database, request: ReportRequest, *, progress: Callable[[str], None] = lambda name: None
) -> ReportAnswer:
    """Find, store and write the state of one machine or of all at the end of a week.

    ``progress`` is told the name of every machine that is done. Raises InputError for a week that is none,
    NotFoundError for a machine or campaign that is not there.
    """
    made_at, options = request.made_at, request.options
    today = date.today() if made_at is None else made_at.date()
    week = week_named(request.week) if request.week else week_before(today)
    if week.first > today:
        raise InputError(
            f"--week {week.name} begins on {week.first}, and today is {today}: nothing can be said of it"
        )
    every = named_machines(db)
    machines = _selected(db, every, request)
    try:
        request.out.mkdir(parents=True, exist_ok=True)  # before minutes of computing
    except OSError as error:
        raise InputError(
            f"the report cannot be written to {request.out}: {why_not(request.out, error)}"
        ) from error
    moment = (made_at or datetime.now(UTC)).replace(tzinfo=None, microsecond=0)
    with _engine(request, len(machines)) as engine:
        rows = _reported(db, machines, week, request, engine, progress)
        # Once all runs of the week are identified.
        looks = weekly_notices(db, week).of_machines({row.machine for row, _, _ in rows}, week.name)
        drawn, alike = attention([looked for _, _, looked in rows])
        fleet = Fleet(
            week.name, week.first, week.last, moment, f"machine-health-monitor {__version__}", options.risk,
            tuple(row for row, _, _ in rows),
            refused_elsewhere(db, {name.machine for name in every}, week),
            ended=today > week.last,
            noticed=tuple((notice.machine, weekly_sentence(notice)) for notice in looks.notices),
            attention=tuple(stored_health(db, number) for row, number, _ in rows if row.machine in drawn),
            alike=alike,
            anchor=last_anchor(db),
        )  # fmt: skip
        files = _write(db, fleet, [number for _, number, _ in rows], request, engine)
    return _answer(fleet, week, files, looks)


def _selected(db: Database, every: list[MachineName], request: ReportRequest) -> list[MachineName]:
    """The machines of the report. Raises NotFoundError and InputError for names that do not go together."""
    machine, campaigns = request.machine, request.options.campaigns
    if machine is not None:
        check_machine(db, machine)
    check_campaigns(db, campaigns)
    if not campaigns:
        return [name for name in every if machine in (None, name.machine)]
    machine_of = campaign_machines(db)
    measured = {machine_of[campaign] for campaign in campaigns}
    if machine is not None and machine not in measured:
        raise InputError(
            f"machine {machine} has none of the campaigns chosen ({', '.join(campaigns)}); "
            f"they are of {', '.join(sorted(measured))}"
        )
    return [name for name in every if machine in (None, name.machine) and name.machine in measured]


def _engine(request: ReportRequest, machines: int) -> AbstractContextManager[Engine]:
    """Where to compute: no more processes than machines, and none beside this one where it would be the only one."""
    if request.cluster is not None:
        return engine_of(None, request.cluster)
    workers = request.workers
    if workers is None:
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        workers = min(cores, MOST_WORKERS, machines // MACHINES_A_WORKER)
    return engine_of(max(1, min(workers, machines)), None)


def _reported(
    db: Database,
    machines: list[MachineName],
    week: Week,
    request: ReportRequest,
    engine: Engine,
    progress: Callable[[str], None],
) -> list[tuple[FleetRow, int, Looked]]:
    """The machines' lines by urgency, each with the number of its stored record and what is found of it."""
    in_hand: deque[MachineWeek] = deque()

    def tasks() -> Iterator[tuple[Task | None]]:
        for name in machines:
            past = read_week(db, name, week, request.options)
            in_hand.append(past)
            yield (past.task,)

    rows = []
    for result in in_order(engine, computed, tasks()):
        past = in_hand.popleft()
        progress(past.name.machine)
        health = machine_health(db, past, result)
        number = save_analysis(
            db, KIND, to_document(health), method=f"{week.name}, alarm above {request.options.risk:g}",
            machine=past.name.machine,
        )  # fmt: skip
        rows.append((fleet_row(health), number, look_at(health)))
    return sorted(rows, key=lambda row: by_urgency(row[0]))


def stored_health(db: Database, number: int) -> MachineHealth:
    """The record of a machine as it was stored."""
    return _record(analysis_text(db, number))


def _record(text: str) -> MachineHealth:
    return from_document(MachineHealth, json.loads(text))


def _pdf(fleet: Fleet, texts: list[str], part: int, parts: int) -> bytes:
    """A part of the PDF from stored records, in whatever process."""
    return health_pdf(fleet, [_record(text) for text in texts], part, parts)


def _write(
    db: Database, fleet: Fleet, numbers: list[int], request: ReportRequest, engine: Engine
) -> list[str]:
    """Write HTML and PDF, the latter in parts; the files."""
    stem = f"health-{fleet.week}"
    if request.machine is not None:
        stem += "-" + "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in request.machine)
    page = request.out / f"{stem}.html"
    try:
        with _becoming(page) as stream:
            for piece in health_html(fleet, (stored_health(db, number) for number in numbers)):
                stream.write(piece.encode("utf-8"))
        return [str(page), *map(str, _write_pdf(db, fleet, numbers, request.out / stem, engine))]
    except OSError as error:
        raise InputError(
            f"the report cannot be written to {request.out}: {why_not(request.out, error)}"
        ) from error


def _write_pdf(db: Database, fleet: Fleet, numbers: list[int], stem: Path, engine: Engine) -> Iterator[Path]:
    """Write the parts of the PDF, of nearly the same length, so that no worker waits for another."""
    parts = max(1, -(-len(numbers) // MACHINES_A_PART))
    ends = [len(numbers) * part // parts for part in range(parts + 1)]
    tasks = (
        (fleet, [analysis_text(db, number) for number in numbers[first:end]], part, parts)
        for part, (first, end) in enumerate(pairwise(ends), start=1)
    )
    for part, pdf in enumerate(in_order(engine, _pdf, tasks), start=1):
        path = stem.with_name(f"{stem.name}.pdf" if parts == 1 else f"{stem.name}-part-{part}-of-{parts}.pdf")
        with _becoming(path) as stream:
            stream.write(pdf)
        yield path


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


def _answer(fleet: Fleet, week: Week, files: list[str], looks: WeeklyNotices) -> ReportAnswer:
    measured = sum(row.state is not State.NOT_MEASURED for row in fleet.rows)
    return ReportAnswer(
        week=week.name,
        from_=week.first.isoformat(),
        to=week.last.isoformat(),
        machines=fleet.rows,
        measured=measured,
        ended=fleet.ended,
        alarms=tuple(row.machine for row in fleet.rows if row.state in ALARMS),
        refused_imports=fleet.refused_imports,
        message="" if measured else NothingMeasured(week.name, week.first, week.last),
        answers=answers(fleet),
        files=tuple(files),
        weekly_looks=looks,
    )
