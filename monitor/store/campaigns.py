"""Campaigns in and out: one import is one transaction, and what comes back equals what went in."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta, timezone
from typing import Literal

import numpy as np

from monitor import __version__
from monitor.exceptions import CampaignError, DataError, Fault
from monitor.records import Campaign, CurveCampaign, Run
from monitor.row_files import is_of_mapping
from monitor.store import audit, probings, record_json
from monitor.store.archiving import source_files, source_hashes
from monitor.store.bookkeeping import with_bookkeeping
from monitor.store.catalogue import campaign_number
from monitor.store.connection import Database, utc_now
from monitor.store.curves import (
    METHOD as CURVE,
    curve_by_number,
    curve_content,
    insert_curve,
    is_curve,
    is_curve_number,
    stored_curve_content,
)
from monitor.store.import_notes import keep_fingerprints, keep_notes
from monitor.store.past import campaign_runs


@dataclass(frozen=True)
class Imported:
    """What an import did: "imported", or "unchanged" where the same content was there already.

    ``rows`` is the number of rows of a curve, None for the campaign of a machine.
    """

    campaign: str
    state: Literal["imported", "unchanged"]
    runs: int
    probings: int

    rows: int | None = None

    def __str__(self) -> str:
        runs = f"{self.runs} run{'' if self.runs == 1 else 's'}"
        size = f"{runs}, {self.probings} probings" if self.rows is None else f"{self.rows} rows"
        if self.state == "imported":
            return f"{self.campaign}: imported, {size}"
        return f"{self.campaign}: was imported before with the same content, nothing changed ({size})"


def import_campaign(db: Database, campaign: Campaign, notes: Sequence[str] = ()) -> Imported:
    """Store a campaign and the bytes of its files, or say that the same is there already.

    ``notes`` are sentences on what looked like a mistake; they are stored with it.

    Raises CampaignError, with nothing stored, where a campaign of that name has other content, or its machine
    has another topology in the database; DataError where a number is not finite.
    """
    rows = probings.printed(campaign.probings, campaign.machine)
    for run in campaign.runs:
        _check_run(run)
    described = record_json.Described.of(campaign)
    content = _content(campaign, rows, described)
    imported = Imported(campaign.name, "imported", len(campaign.runs), len(campaign.probings))
    with db.transaction():
        same_name = db.rows(
            "SELECT campaign_id, content_sha256, imported_at FROM campaign WHERE campaign = ?",
            [campaign.name],
        )
        if same_name:
            faults = _differences(db, campaign, content, *same_name[0])
            if faults:
                raise CampaignError(campaign.name, faults)
            return Imported(imported.campaign, "unchanged", imported.runs, imported.probings)
        _keep_machine(db, campaign)
        campaign_id = db.next_number("imported_campaign", "campaign_id")
        db.execute(
            "INSERT INTO imported_campaign VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                campaign_id,
                campaign.name,
                campaign.machine.id,
                campaign.method,
                described.machine,
                described.probe,
                described.artefact,
                content,
                __version__,
                utc_now(),
            ],
        )
        for file in campaign.files:
            db.execute(
                "INSERT INTO source_file VALUES (?, ?, ?, ?)",
                [campaign_id, file.name, file.content, file.sha256],
            )
        _insert_runs(db, campaign_id, campaign.runs)
        campaign_runs.insert_runs(db, campaign_id)
        probings.insert(db, campaign_id, rows)
        keep_fingerprints(db, campaign_id, campaign.probings)
        _record(db, campaign.name, campaign_id, content)
        keep_notes(db, campaign_id, notes)
    return imported


def import_curve(db: Database, curve: CurveCampaign) -> Imported:
    """Store a curve and the bytes of its files, or report that it is stored already. Raises as ``import_campaign``."""
    content = curve_content(curve)
    with db.transaction():
        same_name = db.rows(
            "SELECT campaign_id, content_sha256, imported_at FROM campaign WHERE campaign = ?", [curve.name]
        )
        if same_name:
            faults = _differences(db, curve, content, *same_name[0])
            if faults:
                raise CampaignError(curve.name, faults)
            return Imported(curve.name, "unchanged", 0, 0, len(curve))
        campaign_id = db.next_number("imported_campaign", "campaign_id")
        insert_curve(db, campaign_id, curve, content)
        _record(db, curve.name, campaign_id, content)
    return Imported(curve.name, "imported", 0, 0, len(curve))


def _record(db: Database, name: str, campaign_id: int, content: str) -> None:
    audit.record(db, "import", "campaign", name, with_bookkeeping(db, "campaign", campaign_id, content))


def load_campaign(db: Database, name: str, *, with_files: bool = True) -> Campaign:
    """The campaign as it was imported, with its files or, of a campaign folder, their names and hashes alone.

    Raises NotFoundError listing what is there, DataError for a curve.
    """
    if is_curve(db, name):
        raise DataError(
            f"campaign {name} is a curve, not a machine: it can be identified, compared and explained "
            "(monitor identify, compare, explain, model)"
        )
    campaign, _, _ = _load(db, campaign_number(db, name), with_files=with_files)
    return campaign


def stored_content(db: Database, campaign_id: int, *, signed_zeros: bool = False) -> str:
    """The content hash of a campaign, withdrawn or not, computed anew from everything that is stored of it.

    ``signed_zeros`` as in ``audit.bits``.
    """
    if is_curve_number(db, campaign_id):
        return stored_curve_content(db, campaign_id, signed_zeros=signed_zeros)
    return _content(*_load(db, campaign_id), signed_zeros=signed_zeros)


def _content_by_this_version(db: Database, campaign_id: int) -> str:
    """The content hash that this version gives to what is stored, which earlier ones described with fewer keys."""
    if is_curve_number(db, campaign_id):
        return curve_content(curve_by_number(db, campaign_id))
    campaign, rows, _ = _load(db, campaign_id)
    return _content(campaign, rows, record_json.Described.of(campaign))


def _check_run(run: Run) -> None:
    if run.started_at.utcoffset() is None:
        raise DataError(f"run {run.run} starts at {run.started_at}, without its offset from UTC")
    for name, value in run.conditions.items():
        if not np.isfinite(value):
            raise DataError(f"condition {name} of run {run.run} must be a finite number, not {value}")


def _content(
    campaign: Campaign,
    rows: probings.PrintedProbings,
    described: record_json.Described,
    *,
    signed_zeros: bool = False,
) -> str:
    zero = -0.0 if signed_zeros else 0.0  # the one of the two that leaves the sign of a zero when it is added
    return audit.digest(
        campaign.name,
        campaign.method,
        described.machine,
        described.probe,
        described.artefact,
        [
            [
                r.run,
                r.started_at.isoformat(),
                r.day,
                r.warm_up,
                {k: float(v) + zero for k, v in r.conditions.items()},
            ]
            for r in campaign.runs
        ],
        rows.sha256(signed_zeros=signed_zeros),
        [[file.name, file.sha256] for file in sorted(campaign.files, key=lambda file: file.name)],
    )


def _differences(
    db: Database,
    campaign: Campaign | CurveCampaign,
    content: str,
    campaign_id: int,
    stored: str,
    imported_at: datetime,
) -> list[Fault]:
    """What differs from the campaign of the same name; empty where the content is the same.

    The files decide where there are any: a later version of the reader may read more out of the same bytes.
    """
    when = f"{imported_at:%Y-%m-%d %H:%M} UTC"
    before = dict(db.rows("SELECT file, sha256 FROM source_file WHERE campaign_id = ?", [campaign_id]))
    after = {file.name: file.sha256 for file in campaign.files}
    has_files = bool(before or after)
    if not has_files and content != stored and content != _content_by_this_version(db, campaign_id):
        return [Fault("campaign", None, None, f"its content differs from that imported on {when}")]
    advice = (
        "give the new content another campaign name, or withdraw what was imported: "
        f'`monitor withdraw {shlex.quote(campaign.name)} --reason "..."`'
    )
    faults = []
    for name in sorted(before.keys() | after.keys()):
        if name not in after:
            faults.append(Fault(name, None, None, f"is missing; it was imported on {when}; {advice}"))
        elif name not in before:
            faults.append(Fault(name, None, None, f"was not there when imported on {when}; {advice}"))
        elif before[name] != after[name]:
            faults.append(Fault(name, None, None, f"differs from the file imported on {when}; {advice}"))
    return faults


def _keep_machine(db: Database, campaign: Campaign) -> None:
    machine = campaign.machine
    # Only campaigns that count hold a machine to its axes: with the last of them a wrong topology is withdrawn, too.
    topologies = db.rows(
        "SELECT DISTINCT machine_description ->> 'topology' FROM campaign WHERE machine = ? AND method <> ?",
        [machine.id, CURVE],
    )
    registered = db.rows(
        "SELECT arg_max(topology, registration) FROM registered_machine WHERE machine = ?", [machine.id]
    )
    if not topologies and registered != [(machine.topology,)]:
        number = db.next_number("registered_machine", "registration")
        db.execute(
            "INSERT INTO registered_machine VALUES (?, ?, ?, ?)",
            [number, machine.id, machine.topology, utc_now()],
        )
    elif topologies and topologies[0][0] != machine.topology:
        raise CampaignError(
            campaign.name,
            [
                Fault(
                    "campaign.toml",
                    None,
                    "topology",
                    f"machine {machine.id} is known as {topologies[0][0]!r}, here it is {machine.topology!r}; the axes "
                    "of a machine do not change: correct the topology, or give the machine another id",
                )
            ],
        )


def _insert_runs(db: Database, campaign_id: int, added: tuple[Run, ...]) -> None:
    for position, run in enumerate(added, start=1):
        offset = run.started_at.utcoffset() or timedelta()
        db.execute(
            "INSERT INTO run VALUES (?, ?, ?, ?, ?, ?, ?, map(?::VARCHAR[], ?::DOUBLE[]))",
            [
                campaign_id,
                position,
                run.run,
                run.started_at.astimezone(UTC).replace(tzinfo=None),
                offset.total_seconds(),
                run.day,
                run.warm_up,
                list(run.conditions),
                [float(value) for value in run.conditions.values()],
            ],
        )


def _load(
    db: Database, campaign_id: int, *, with_files: bool = True
) -> tuple[Campaign, probings.PrintedProbings, record_json.Described]:
    ((name, method, machine, probe, artefact),) = db.rows(
        "SELECT campaign, method, machine_description, probe, artefact FROM imported_campaign WHERE campaign_id = ?",
        [campaign_id],
    )
    with record_json.as_imported(name):
        described = record_json.machine_record(machine)
        probed, measured = record_json.probe_record(probe), record_json.artefact_record(artefact)
        sources = record_json.sources_record(artefact)
    rows = probings.select(db, campaign_id)
    stored_runs = db.rows(
        "SELECT run, started_at, utc_offset_s, day, warm_up, map_keys(conditions), map_values(conditions) "
        "FROM run WHERE campaign_id = ? ORDER BY position",
        [campaign_id],
    )
    campaign = Campaign(
        name=name,
        method=method,
        machine=described,
        probe=probed,
        artefact=measured,
        runs=tuple(
            Run(run, _moment(at, offset), day, warm_up, dict(zip(names, values, strict=True)))
            for run, at, offset, day, warm_up, names, values in stored_runs
        ),
        probings=probings.as_record(rows, described),
        files=source_files(db, campaign_id) if with_files else source_hashes(db, campaign_id),
        sources=sources,
    )
    if not with_files and is_of_mapping(campaign):
        # What is said of a row says where it stands in the files of its owner.
        campaign = replace(campaign, files=source_files(db, campaign_id))
    return campaign, rows, record_json.Described(machine, probe, artefact)


def _moment(at: datetime, offset_s: float) -> datetime:
    return at.replace(tzinfo=UTC).astimezone(timezone(timedelta(seconds=offset_s)))
