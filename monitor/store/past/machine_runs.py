"""The runs of one machine as they were recorded, identified or not, and what a weekly report asks of its campaigns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone

from monitor.exceptions import NotFoundError, did_you_mean
from monitor.store.catalogue import campaigns_of_machine
from monitor.store.connection import Database
from monitor.store.past.campaign_runs import run_rows
from monitor.store.type_tolerances import type_in_use


@dataclass(frozen=True)
class RecordedRun:
    """A run: its start in the shop's offset from UTC, its conditions each in the unit that its name ends in."""

    campaign_id: int
    campaign: str
    method: str
    run: int
    started_at: datetime
    day: int
    warm_up: bool
    conditions: Mapping[str, float]

    @property
    def local_start(self) -> datetime:
        """The start by the shop's clock, without a zone."""
        return self.started_at.replace(tzinfo=None)


@dataclass(frozen=True)
class MachineDescription:
    """A machine as its latest campaign describes it; a text that is not stated is empty."""

    machine: str
    topology: str
    manufacturer: str
    model: str
    serial_number: str
    location: str


def machine_descriptions(db: Database) -> list[MachineDescription]:
    """Every machine that counts, by name."""
    rows = db.rows(
        "SELECT machine, topology, manufacturer, machine_model, serial_number, location "
        "FROM v_machines ORDER BY machine"
    )
    return [MachineDescription(*("" if text is None else str(text) for text in row)) for row in rows]


def machine_topology(db: Database, machine: str) -> str:
    """The chain of a machine as it was registered; empty for one that no campaign measured."""
    rows = db.rows(
        "SELECT arg_max(topology, registration) FROM registered_machine WHERE machine = ?", [machine]
    )
    return str(rows[0][0] or "")


def machine_runs(db: Database, machine: str) -> list[RecordedRun]:
    """Every run of the campaigns of a machine that count, in the order of time.

    Raises NotFoundError for a machine that is not there.
    """
    return runs_of_campaigns(db, campaigns_of_machine(db, machine))


def runs_of_campaigns(db: Database, campaigns: Mapping[int, tuple[str, str]]) -> list[RecordedRun]:
    """The runs of campaigns (number to name and method), in the order of time."""
    rows = [
        RecordedRun(
            number, *campaigns[number], run, _by_the_shops_clock(started_at, offset), day, warm_up, conditions
        )
        for number, run, started_at, offset, day, warm_up, conditions in run_rows(db, list(campaigns))
    ]
    return sorted(rows, key=lambda row: (row.started_at, row.campaign_id, row.run))


def _by_the_shops_clock(started_at: datetime, offset_s: float) -> datetime:
    return started_at.replace(tzinfo=UTC).astimezone(timezone(timedelta(seconds=offset_s)))


def identified_runs(db: Database, machine: str, model: str, version: int) -> set[tuple[str, int]]:
    """Campaign and run of everything that was identified of a machine under a version of a model."""
    rows = db.rows(
        "SELECT campaign, run FROM v_identified_runs WHERE machine = ? AND model = ? AND model_version = ?",
        [machine, model, version],
    )
    return {(str(campaign), int(run)) for campaign, run in rows}


def campaign_machines(db: Database) -> dict[str, str]:
    """The machine of every campaign, by the name of the campaign."""
    return {str(name): str(machine) for name, machine in db.rows("SELECT campaign, machine FROM campaign")}


def check_campaigns(db: Database, campaigns: tuple[str, ...]) -> None:
    """Raise NotFoundError, naming what is there, for a campaign that is not."""
    if not campaigns:
        return
    names = [str(name) for (name,) in db.rows("SELECT campaign FROM campaign ORDER BY campaign")]
    for name in campaigns:
        if name not in names:
            hint = did_you_mean(name, names)
            raise NotFoundError(f"there is no campaign '{name}'; {hint}there are {', '.join(names[:20])}")


def campaign_tolerances(db: Database, campaign: str) -> dict[str, float]:
    """Limits of the absolute value of a machine's parameters, in display units.

    Those that the campaign states; where it states none, those of the machine's type.
    """
    rows = db.rows(
        "SELECT parameter, tolerance FROM v_tolerances WHERE campaign = ? AND tolerance IS NOT NULL",
        [campaign],
    )
    stated = {str(parameter): float(tolerance) for parameter, tolerance in rows}
    of_type = type_in_use(db, campaign)
    return stated if of_type is None else dict(of_type.limits)


def probing_counts(db: Database, campaign: str) -> dict[int, int]:
    """The number of touches of every run of a campaign."""
    rows = db.rows("SELECT run, count(*) FROM v_probings WHERE campaign = ? GROUP BY run", [campaign])
    return {int(run): int(count) for run, count in rows}


def latest_frames(db: Database, machines: Sequence[str]) -> dict[tuple[str, str], str]:
    """What the parameters of machines refer to, by machine and parameter, as the latest identification of each says."""
    rows = db.rows(
        "SELECT machine, parameter, refers_to FROM parameter_frame JOIN (SELECT machine, max(identification_id) AS "
        "identification_id FROM identification JOIN campaign USING (campaign_id) "
        "WHERE machine IN (SELECT unnest(CAST(? AS VARCHAR[]))) GROUP BY machine) USING (identification_id)",
        [list(machines)],
    )
    return {(machine, parameter): refers_to for machine, parameter, refers_to in rows}


def earlier_frames(db: Database, machines: Sequence[str]) -> dict[tuple[str, str], str]:
    """What the parameters of machines refer to, each as the latest identification that has it says: a campaign of other
    instruments has other parameters. All identifications of the machines are looked at."""
    rows = db.rows(
        "SELECT machine, parameter, arg_max(refers_to, identification_id) FROM parameter_frame "
        "JOIN identification USING (identification_id) JOIN campaign USING (campaign_id) "
        "WHERE machine IN (SELECT unnest(CAST(? AS VARCHAR[]))) GROUP BY machine, parameter",
        [list(machines)],
    )
    return {(machine, parameter): refers_to for machine, parameter, refers_to in rows}


def parameter_frames(db: Database, machine: str, parameters: Sequence[str]) -> dict[str, str]:
    """What parameters of a machine refer to, in the words of ``parameter_frame``; "or" where models differ."""
    campaigns = list(campaigns_of_machine(db, machine))
    # By numbers: the names and texts of all campaigns of the fleet are not looked through for those of one machine.
    numbers = db.rows(
        "SELECT max(identification_id) FROM identification "
        "JOIN (SELECT unnest(CAST(? AS INTEGER[])) AS campaign_id) USING (campaign_id) "
        "GROUP BY campaign_id, model, model_version",
        [campaigns],
    )
    if not numbers:
        return {}
    marks = ", ".join("?" * len(numbers))
    # Put together here: DuckDB takes three times as long for its ordered aggregate of distinct texts.
    frames: dict[str, set[str]] = {}
    for parameter, refers_to in db.rows(
        f"SELECT DISTINCT parameter, refers_to FROM parameter_frame WHERE identification_id IN ({marks})",
        [number for (number,) in numbers],
    ):
        frames.setdefault(parameter, set()).add(refers_to)
    return {name: " or ".join(sorted(frames[name])) for name in parameters if name in frames}
