"""The weekly health report: the state of every machine is found and stored, then HTML and PDF are written from that.

A machine is held at a time: its record is stored as it is found, and read again when its page is written.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from monitor import __version__
from monitor.exceptions import InputError
from monitor.reporting.documents import from_document, to_document
from monitor.reporting.health import ALARMS, Fleet, FleetRow, MachineHealth, by_urgency, fleet_row
from monitor.reporting.health_render import MACHINES_A_PART, health_html, health_pdf
from monitor.store import Database, list_machines, save_analysis
from monitor.store.catalogue import check_machine
from monitor.workflow.campaigns import records
from monitor.workflow.health_history import check_campaigns, makers
from monitor.workflow.health_machine import Settings, machine_health
from monitor.workflow.health_refusals import refused_elsewhere
from monitor.workflow.weeks import Week, week_before, week_named

Document = dict[str, Any]
KIND = "health"


def report(
    db: Database,
    week: str | None = None,
    machine: str | None = None,
    out: Path | None = None,
    *,
    settings: Settings | None = None,
    made_at: datetime | None = None,
    progress: Callable[[str], None] = lambda name: None,
) -> Document:
    """Find, store and write the state of one machine or of all at the end of a week.

    ``week`` like ``2026-W10``, by default the last that has ended. Files go to ``out`` (made where there is
    none, by default the working directory). Raises InputError for a week that is none, NotFoundError for a
    machine or campaign that is not there.
    """
    chosen = week_named(week) if week else week_before(date.today())
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
    rows: list[tuple[FleetRow, int]] = []
    for known in records(list_machines(db)):
        name = str(known["machine"])
        if machine not in (None, name) or (measured_by is not None and name not in measured_by):
            continue
        progress(name)
        found = machine_health(db, name, _description(known), str(known["location"] or ""), chosen, own)
        number = save_analysis(
            db, KIND, to_document(found), method=f"{chosen.name}, alarm above {own.risk:g}", machine=name
        )
        rows.append((fleet_row(found), number))
    rows.sort(key=lambda row: by_urgency(row[0]))
    now = (made_at or datetime.now(UTC)).replace(tzinfo=None, microsecond=0)
    fleet = Fleet(
        chosen.name, chosen.first, chosen.last, now, f"machine-health-monitor {__version__}", own.risk,
        tuple(row for row, _ in rows),
        refused_elsewhere(db, {str(known["machine"]) for known in records(list_machines(db))}, chosen),
    )  # fmt: skip
    files = _write(db, fleet, [number for _, number in rows], out or Path(), machine)
    return _document(fleet, chosen, files)


def stored_health(db: Database, number: int) -> MachineHealth:
    """The record of a machine as it was stored."""
    ((text,),) = db.rows("SELECT document FROM v_analyses WHERE analysis_id = ?", [number])
    return from_document(MachineHealth, json.loads(text))


def _write(db: Database, fleet: Fleet, numbers: list[int], out: Path, machine: str | None) -> list[str]:
    stem = f"health-{fleet.week}" + (
        "" if machine is None else "-" + "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in machine)
    )  # fmt: skip
    page = out / f"{stem}.html"
    parts = max(1, -(-len(numbers) // MACHINES_A_PART))
    files = [page]
    try:
        out.mkdir(parents=True, exist_ok=True)
        part = page.with_name(page.name + ".part")
        with part.open("w", encoding="utf-8") as stream:
            for piece in health_html(fleet, _stored(db, numbers)):
                stream.write(piece)
        part.replace(page)
        for place in range(parts):
            some = numbers[place * MACHINES_A_PART : (place + 1) * MACHINES_A_PART]
            pdf = health_pdf(fleet, list(_stored(db, some)), place + 1, parts)
            path = out / (f"{stem}.pdf" if parts == 1 else f"{stem}-part-{place + 1}-of-{parts}.pdf")
            beside = path.with_name(path.name + ".part")
            beside.write_bytes(pdf)
            beside.replace(path)
            files.append(path)
    except OSError as error:
        raise InputError(f"the report cannot be written to {out}: {error.strerror or error}") from error
    return [str(path) for path in files]


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
        "alarms": [row.machine for row in fleet.rows if row.state in ALARMS],
        "refused_imports": [to_document(one) for one in fleet.refused_imports],
        "message": ""
        if measured
        else f"No machine was measured in week {week.name} ({week.first} to {week.last}).",
        "files": files,
    }
