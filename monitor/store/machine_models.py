"""Which model a machine is followed by: stored with its reason, audited, the latest choice of a machine and method."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from monitor import __version__
from monitor.exceptions import InputError
from monitor.store import audit
from monitor.store.catalogue import check_machine
from monitor.store.connection import Database, utc_now


@dataclass(frozen=True)
class MachineModel:
    """The model that campaigns of a ``method`` on a machine are identified by, and why."""

    machine: str
    method: str
    model: str
    version: int
    reason: str
    made_at: datetime


def save_machine_model(
    db: Database, machine: str, method: str, model: tuple[str, int], reason: str
) -> MachineModel:
    """Store a choice; the same as the present one is stored once. Raises NotFoundError, InputError without a reason."""
    if not reason.strip():
        raise InputError("say why the machine gets another model: --reason TEXT")
    name, version = model
    with db.transaction():
        check_machine(db, machine)
        present = machine_model(db, machine, method)
        if present is not None and (present.model, present.version) == model and present.reason == reason:
            return present
        number = db.next_number("machine_model", "choice_id")
        choice = MachineModel(machine, method, name, version, reason.strip(), utc_now())
        db.execute(
            "INSERT INTO machine_model VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            [number, machine, method, name, version, choice.reason, __version__, choice.made_at],
        )
        audit.record(db, "save", "machine model", str(number), machine_model_content(db, number))
    return choice


def machine_model(db: Database, machine: str, method: str) -> MachineModel | None:
    """The present choice of a machine and method; None where it is the method's own model."""
    rows = db.rows(
        "SELECT machine, method, model, model_version, reason, made_at FROM v_machine_models "
        "WHERE machine = ? AND method = ?",
        [machine, method],
    )
    return MachineModel(*rows[0]) if rows else None


def machine_models(db: Database, machine: str | None = None) -> list[MachineModel]:
    """The present choices of all machines, or of one."""
    rows = db.rows(
        "SELECT machine, method, model, model_version, reason, made_at FROM v_machine_models "
        "WHERE $machine IS NULL OR machine = $machine ORDER BY machine, method",
        {"machine": machine},
    )
    return [MachineModel(*row) for row in rows]


def followed_by(db: Database, machine: str) -> dict[str, tuple[str, int]]:
    """Name and version of the model of each method by which a machine is followed: the chosen one, else the latest of
    the method's own, which has its name and no parent at first. The values of two versions are never mixed."""
    rows = db.rows(
        "SELECT model, max(version) FROM model WHERE model IN "
        "(SELECT model FROM model WHERE version = 1 AND parent IS NULL) GROUP BY model"
    )
    every = {str(model): (str(model), int(version)) for model, version in rows}
    return every | {choice.method: (choice.model, choice.version) for choice in machine_models(db, machine)}


# Machines whose numbers are of an older version of a method's own model: the newest by which all their campaigns are
# identified that any version has, else the newest that somebody identified one by. A version that has a part of them
# would drop the others from every history. None while each method has one version. Of ``which`` machines stands where
# the identifications are looked through.
_OLDER = """
SELECT of.machine, of.method, of.method AS model,
       coalesce(max(of.model_version) FILTER (of.campaigns = every.campaigns), max(of.model_version)) AS model_version,
       newest.version AS newest
FROM (
    SELECT model AS method, max(version) AS version FROM model
    WHERE model IN (SELECT model FROM model WHERE version = 1 AND parent IS NULL)
    GROUP BY model HAVING max(version) > 1
) AS newest
JOIN (
    SELECT c.machine, i.method, i.model_version, count(DISTINCT campaign_id) AS campaigns
    FROM identification AS i JOIN campaign AS c USING (campaign_id) WHERE i.model = i.method {which} GROUP BY ALL
) AS of USING (method)
JOIN (
    SELECT c.machine, i.method, count(DISTINCT campaign_id) AS campaigns
    FROM identification AS i JOIN campaign AS c USING (campaign_id) WHERE i.model = i.method GROUP BY ALL
) AS every ON every.machine = of.machine AND every.method = of.method
ANTI JOIN v_machine_models AS chosen ON chosen.machine = of.machine AND chosen.method = of.method
GROUP BY of.machine, of.method, newest.version HAVING model_version < newest.version
"""

_CHOSEN = "SELECT machine, method, model, model_version FROM v_machine_models"

#: The model that the numbers of a machine and method come from, where that is not the latest of the method's own.
NUMBERED = f"""
{_CHOSEN}
UNION ALL SELECT machine, method, model, model_version FROM ({_OLDER.format(which="")})
"""


@dataclass(frozen=True)
class OlderNumbers:
    """A machine whose numbers are of an older ``version`` of a method's own ``model``, as not all of its campaigns that
    have numbers were identified by the ``newest``."""

    machine: str
    model: str
    version: int
    newest: int


def older_numbers(db: Database, machine: str | None = None) -> tuple[OlderNumbers, ...]:
    """Return the machines whose numbers are of an older version, by name and method; all, or one."""
    older = _OLDER.format(which="" if machine is None else "AND c.machine = ?")
    rows = db.rows(
        f"SELECT machine, model, model_version, newest FROM ({older}) ORDER BY machine, method",
        [] if machine is None else [machine],
    )
    return tuple(OlderNumbers(*row) for row in rows)


def numbered_by(db: Database, machine: str) -> dict[str, tuple[str, int]]:
    """Name and version of the model of each method that the numbers of a machine come from.

    That which it is followed by; where its campaigns were not all identified by the latest version of a method's own
    model, the newest version by which all were that any version has. One version a method: the values of two are never
    mixed.
    """
    older = {row.model: (row.model, row.version) for row in older_numbers(db, machine)}
    return followed_by(db, machine) | older


# By the model of the machine, else by the latest version of the method's own; a curve has no runs.
_NOT_IDENTIFIED = """
WITH own AS (
    SELECT model AS method, max(version) AS version FROM model
    WHERE model IN (SELECT model FROM model WHERE version = 1 AND parent IS NULL) GROUP BY model
), of_machine AS (
    {models}
), followed AS (
    SELECT c.campaign_id, c.campaign, m.model, m.model_version
    FROM campaign AS c JOIN of_machine AS m USING (machine, method)
    UNION ALL
    SELECT c.campaign_id, c.campaign, c.method, coalesce(own.version, 1)
    FROM campaign AS c LEFT JOIN own USING (method) ANTI JOIN of_machine USING (machine, method)
)
SELECT campaign FROM followed SEMI JOIN run USING (campaign_id)
ANTI JOIN identification USING (campaign_id, model, model_version) ORDER BY campaign
"""


def not_identified(db: Database, machine: str | None = None) -> tuple[str, ...]:
    """The campaigns of machines, or of one, that were not identified by the model which their machine is followed
    by."""
    beside = _campaigns_beside(db, _CHOSEN)
    if machine is None:
        return beside
    of_machine = {name for (name,) in db.rows("SELECT campaign FROM campaign WHERE machine = ?", [machine])}
    return tuple(name for name in beside if name in of_machine)


def without_part(db: Database) -> tuple[str, ...]:
    """The campaigns of machines that were not identified by the model which the numbers of their machine come from."""
    return _campaigns_beside(db, NUMBERED)


def _campaigns_beside(db: Database, models: str) -> tuple[str, ...]:
    """The campaigns that were not identified by the ``models`` (a query) of their machines."""
    return tuple(str(campaign) for (campaign,) in db.rows(_NOT_IDENTIFIED.format(models=models)))


def machines_with_runs(db: Database) -> tuple[str, ...]:
    """The machines of which a run was imported, by name; a curve has none."""
    rows = db.rows("SELECT DISTINCT machine FROM campaign SEMI JOIN run USING (campaign_id) ORDER BY machine")
    return tuple(str(machine) for (machine,) in rows)


def machines_of_method(db: Database, method: str) -> tuple[str, ...]:
    """The machines that a campaign of a method measured, by name."""
    rows = db.rows("SELECT DISTINCT machine FROM campaign WHERE method = ? ORDER BY machine", [method])
    return tuple(str(machine) for (machine,) in rows)


def machine_model_content(db: Database, number: int) -> str:
    """The hash of all that is stored of a choice."""
    ((machine, method, model, version, reason, software, made_at),) = db.rows(
        "SELECT machine, method, model, model_version, reason, software_version, made_at FROM machine_model "
        "WHERE choice_id = ?",
        [number],
    )
    return audit.digest(number, machine, method, model, version, reason, software, made_at)
