"""Identifications in and out, and the parameters of runs as people read them.

Nothing is replaced: a later identification stands beside an earlier one, and the views show the latest.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from monitor import __version__
from monitor.exceptions import NotFoundError
from monitor.store import audit
from monitor.store.bookkeeping import with_bookkeeping
from monitor.store.catalogue import campaign_number
from monitor.store.connection import Database, utc_now
from monitor.store.past import common_parts, identified_values
from monitor.store.results import (
    LackOfFit,
    StoredIdentification,
    StoredRun,
    check_identification,
    identification_content,
)
from monitor.units import Unit

if TYPE_CHECKING:
    pass


def save_identification(db: Database, identification: StoredIdentification) -> int:
    """Store an identification; its number. Raises DataError for arrays that do not fit, NotFoundError."""
    check_identification(identification)
    with db.storing_answer():
        campaign_id = campaign_number(db, identification.campaign)
        recorded = {run for (run,) in db.rows("SELECT run FROM run WHERE campaign_id = ?", [campaign_id])}
        strange = sorted({run.run for run in identification.runs} - recorded)
        if strange:
            raise NotFoundError(f"campaign {identification.campaign!r} has no run {strange[0]}")
        number = db.next_number("identification", "identification_id")
        db.execute(
            "INSERT INTO identification VALUES (?, ?, ?, ?, ?, ?::VARCHAR[], ?::VARCHAR[], ?::DOUBLE[], ?, ?, ?)",
            [
                number,
                campaign_id,
                identification.model,
                identification.model_version,
                identification.method,
                list(identification.parameters),
                [unit.name for unit in identification.units],
                [unit.factor for unit in identification.units],
                len(identification.runs),
                __version__,
                utc_now(),
            ],
        )
        for run in identification.runs:
            _insert_run(db, number, run)
            common_parts.insert_parts(db, number, run)
        _insert_values(db, number, identification)
        _insert_frames(db, number, identification)
        _insert_lack_of_fit(db, number, identification.lack_of_fit)
        identified_values.insert_values(db, number, identification)
        _insert_residuals(db, number, identification.runs)
        content = with_bookkeeping(
            db, "identification", number, identification_content(number, identification)
        )
        audit.record(db, "save", "identification", str(number), content)
    return number


def load_identification(
    db: Database,
    campaign: str,
    model: str | None = None,
    version: int | None = None,
    *,
    run: int | None = None,
) -> StoredIdentification:
    """The latest identification with the most runs, or the latest that holds ``run`` where one is named.

    ``model`` and ``version`` narrow the choice. Raises NotFoundError saying what to type.
    """
    campaign_id = campaign_number(db, campaign)
    numbers = db.rows(
        """
        SELECT identification_id FROM identification AS i
        WHERE campaign_id = $campaign_id
          AND ($model IS NULL OR model = $model) AND ($version IS NULL OR model_version = $version)
          AND ($run IS NULL OR EXISTS (
              SELECT 1 FROM identified_run AS f WHERE f.identification_id = i.identification_id AND f.run = $run))
        ORDER BY CASE WHEN $run IS NULL THEN run_count ELSE 0 END DESC, identification_id DESC LIMIT 1
        """,
        {"campaign_id": campaign_id, "model": model, "version": version, "run": run},
    )
    if not numbers:
        wanted = "".join(
            f" {word} {value}"
            for word, value in (("model", model), ("version", version), ("run", run))
            if value is not None
        )
        raise NotFoundError(
            f"campaign {campaign!r} has not been identified yet{' for' + wanted if wanted else ''}; "
            f"type `monitor identify {campaign}`"
        )
    return identification_by_number(db, numbers[0][0])


def identification_by_number(db: Database, number: int) -> StoredIdentification:
    """The identification of a number that ``save_identification`` returned. Raises NotFoundError."""
    head = db.rows(
        "SELECT campaign, model, model_version, i.method, parameters, units, display_factors "
        "FROM identification AS i JOIN imported_campaign USING (campaign_id) WHERE identification_id = ?",
        [number],
    )
    if not head:
        raise NotFoundError(f"there is no identification number {number}")
    campaign, model, version, method, parameters, units, factors = head[0]
    return StoredIdentification(
        campaign,
        model,
        version,
        method,
        tuple(parameters),
        tuple(Unit(name, factor) for name, factor in zip(units, factors, strict=True)),
        _runs(db, number, len(parameters)),
        dict(
            db.rows("SELECT parameter, refers_to FROM parameter_frame WHERE identification_id = ?", [number])
        ),
        next(
            (
                LackOfFit(p_value)
                for (p_value,) in db.rows(
                    "SELECT p_value FROM lack_of_fit WHERE identification_id = ?", [number]
                )
            ),
            None,
        ),
    )


def last_identification(db: Database) -> int:
    """Return the number of the last identification, 0 where there is none: a larger one says that values came."""
    ((number,),) = db.rows("SELECT coalesce(max(identification_id), 0) FROM identification")
    return int(number)


@dataclass(frozen=True)
class MadeBy:
    """Which version computed the identification of a number, and when (UTC); ``is_this`` software, or another."""

    number: int
    software_version: str
    computed_at: datetime
    is_this: bool


def identifications_made(db: Database) -> tuple[MadeBy, ...]:
    """Return who made the identifications of campaigns that count, by number.

    Whatever computed one before the last migration was applied was another software, even under the same version.
    """
    return db.records(
        MadeBy,
        "SELECT identification_id AS number, i.software_version, computed_at, "
        "i.software_version = ? AND computed_at >= (SELECT max(applied_at) FROM schema_migration) AS is_this "
        "FROM identification AS i JOIN campaign USING (campaign_id) ORDER BY 1",
        [__version__],
    )


def stored_identification_content(db: Database, number: int, *, signed_zeros: bool = False) -> str:
    """The content hash computed anew from what is stored; "" where the parameters stored beside it contradict it."""
    identification = identification_by_number(db, number)
    rows = db.rows(
        "SELECT run, parameter, value, u, unit, display_factor FROM parameter_value "
        "WHERE identification_id = ? ORDER BY rowid",
        [number],
    )
    columns = [np.asarray(column).tolist() for column in _values(identification).values()]
    expected = [
        tuple(None if isinstance(cell, float) and np.isnan(cell) else cell for cell in row)
        for row in zip(*columns, strict=True)
    ]
    alike = rows == expected and identified_values.agrees(db, number, identification)
    return identification_content(number, identification, signed_zeros=signed_zeros) if alike else ""


def _insert_run(db: Database, number: int, run: StoredRun) -> None:
    db.execute(
        "INSERT INTO identified_run VALUES (?, ?, ?, ?, ?, ?, ?::DOUBLE[], ?)",
        [
            number,
            run.run,
            float(run.rms_mm),
            int(run.iterations),
            int(run.degrees_of_freedom),
            float(run.chi_square),
            [float(value) for value in run.covariance.ravel()],
            json.dumps(
                [{"parameters": list(group), "why": why} for group, why in run.refused], ensure_ascii=False
            ),
        ],
    )


def _insert_values(db: Database, number: int, identification: StoredIdentification) -> None:
    incoming = _values(identification)
    db.insert("INSERT INTO parameter_value SELECT ?, * FROM incoming", incoming, [number])


def _insert_frames(db: Database, number: int, identification: StoredIdentification) -> None:
    if identification.refers_to:
        names = np.array(list(identification.refers_to), dtype=object)
        references = np.array(list(identification.refers_to.values()), dtype=object)
        incoming = {"parameter": names, "refers_to": references}
        db.insert("INSERT INTO parameter_frame SELECT ?, * FROM incoming", incoming, [number])


def _insert_lack_of_fit(db: Database, number: int, lack_of_fit: LackOfFit | None) -> None:
    if lack_of_fit is not None:
        db.execute("INSERT INTO lack_of_fit VALUES (?, ?)", [number, lack_of_fit.p_value])


def _values(identification: StoredIdentification) -> dict[str, Any]:
    """The columns of ``parameter_value``."""
    count = len(identification.parameters)
    repeats = len(identification.runs)
    return {
        "run": np.repeat([run.run for run in identification.runs], count),
        "parameter": np.tile(np.array(identification.parameters, dtype=object), repeats),
        "value": np.concatenate([run.estimate for run in identification.runs]),
        "u": np.concatenate([np.sqrt(np.diag(run.covariance)) for run in identification.runs]),
        "unit": np.tile(np.array([unit.name for unit in identification.units], dtype=object), repeats),
        "factor": np.tile([unit.factor for unit in identification.units], repeats),
    }


def _insert_residuals(db: Database, number: int, runs: tuple[StoredRun, ...]) -> None:
    vectors = np.concatenate([run.residuals for run in runs])
    incoming = {
        "run": np.repeat([run.run for run in runs], [len(run.sequence) for run in runs]),
        "sequence": np.concatenate([run.sequence for run in runs]),
        "dx": vectors[:, 0],
        "dy": vectors[:, 1],
        "dz": vectors[:, 2],
    }
    db.insert("INSERT INTO residual SELECT ?, * FROM incoming", incoming, [number])


def _runs(db: Database, number: int, count: int) -> tuple[StoredRun, ...]:
    values = db.arrays(
        "SELECT run, value FROM parameter_value WHERE identification_id = ? ORDER BY rowid", [number]
    )
    residuals = db.arrays(
        "SELECT run, sequence, dx_mm, dy_mm, dz_mm FROM residual WHERE identification_id = ? ORDER BY rowid",
        [number],
    )
    vectors = np.column_stack([residuals["dx_mm"], residuals["dy_mm"], residuals["dz_mm"]])
    estimates = np.ma.filled(np.ma.asarray(values["value"]), np.nan)
    parts = common_parts.parts_of(db, [number])
    stored_runs = []
    for run, rms, iterations, freedom, chi_square, covariance, refused in db.rows(
        "SELECT run, rms_mm, iterations, degrees_of_freedom, chi_square, covariance, refused "
        "FROM identified_run WHERE identification_id = ? ORDER BY rowid",
        [number],
    ):
        of_run = np.asarray(residuals["run"] == run)
        stored_runs.append(
            StoredRun(
                run,
                estimates[np.asarray(values["run"] == run)],
                np.array(covariance, dtype=np.float64).reshape(count, count),
                tuple((tuple(group["parameters"]), group["why"]) for group in json.loads(refused)),
                rms,
                iterations,
                freedom,
                chi_square,
                np.asarray(residuals["sequence"][of_run], dtype=np.int64),
                vectors[of_run],
                parts.get((number, run), {}),
            )
        )
    return tuple(stored_runs)
