"""Curves in and out: a response over its inputs, the rows in file order, the files byte for byte."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from monitor import __version__
from monitor.exceptions import DataError
from monitor.records import CurveCampaign, Instrument
from monitor.store import audit
from monitor.store.archiving import source_files
from monitor.store.catalogue import campaign_number
from monitor.store.connection import Database, utc_now
from monitor.store.past.campaign_runs import insert_runs

METHOD = "curve"


def is_curve(db: Database, name: str) -> bool:
    """Whether a campaign is a curve. Raises NotFoundError listing what is there."""
    return is_curve_number(db, campaign_number(db, name))


def is_curve_number(db: Database, campaign_id: int) -> bool:
    """Whether the campaign of that number in the tables, withdrawn or not, is a curve."""
    return bool(db.rows("SELECT 1 FROM curve WHERE campaign_id = ?", [campaign_id]))


def curve_names(db: Database) -> tuple[str, ...]:
    """The campaigns that are curves, the latest first."""
    names = db.rows("SELECT campaign FROM campaign WHERE method = ? ORDER BY campaign_id DESC", [METHOD])
    return tuple(str(name) for (name,) in names)


def insert_curve(db: Database, campaign_id: int, curve: CurveCampaign, content: str) -> None:
    """Add a curve whose name is free; the caller holds the transaction."""
    db.execute(
        "INSERT INTO imported_campaign VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        [
            campaign_id, curve.name, curve.instrument.id, curve.method, json.dumps(asdict(curve.instrument)),
            "{}", "{}", content, __version__, utc_now(),
        ],
    )  # fmt: skip
    insert_runs(db, campaign_id)
    for file in curve.files:
        db.execute(
            "INSERT INTO source_file VALUES (?, ?, ?, ?)", [campaign_id, file.name, file.content, file.sha256]
        )
    db.execute(
        "INSERT INTO curve VALUES (?, ?, ?, ?, ?, map(?::VARCHAR[], ?::VARCHAR[]))",
        [
            campaign_id, curve.response, curve.base, curve.time, curve.standard_uncertainty,
            list(curve.units), list(curve.units.values()),
        ],
    )  # fmt: skip
    columns: dict[str, object] = {"position": np.arange(1, len(curve) + 1), "line": curve.lines}
    columns |= {f"n{k}": values for k, values in enumerate(curve.columns.values())}
    columns |= {f"w{k}": np.array(labels, dtype=object) for k, labels in enumerate(curve.groups.values())}
    numbers = ", ".join(f"n{k}" for k in range(len(curve.columns)))
    labels = ", ".join(f"w{k}" for k in range(len(curve.groups)))
    db.insert(
        "INSERT INTO curve_row SELECT $campaign_id, position, line, "
        f"map($names::VARCHAR[], [{numbers}]::DOUBLE[]), map($groups::VARCHAR[], [{labels}]::VARCHAR[]) "
        "FROM incoming ORDER BY position",
        columns,
        {"campaign_id": campaign_id, "names": list(curve.columns), "groups": list(curve.groups)},
    )


def load_curve(db: Database, name: str) -> CurveCampaign:
    """A curve as it was imported. Raises NotFoundError, DataError for a campaign of another method."""
    campaign_id = campaign_number(db, name)
    if not is_curve(db, name):
        raise DataError(f"campaign {name} is not a curve; `monitor campaigns` shows the method of each")
    return curve_by_number(db, campaign_id)


def curve_by_number(db: Database, campaign_id: int) -> CurveCampaign:
    """A curve by its number in the tables, withdrawn or not."""
    ((name, method, instrument, response, base, time, uncertainty, names, units),) = db.rows(
        "SELECT campaign, method, machine_description, response, base, time_column, standard_uncertainty, "
        "map_keys(units), map_values(units) "
        "FROM imported_campaign JOIN curve USING (campaign_id) WHERE campaign_id = ?",
        [campaign_id],
    )
    rows = db.rows(
        "SELECT line, map_keys(numbers), map_values(numbers), map_keys(labels), map_values(labels) "
        "FROM curve_row WHERE campaign_id = ? ORDER BY position",
        [campaign_id],
    )
    values = np.array([row[2] for row in rows], dtype=np.float64).reshape(len(rows), -1)
    labels = [row[4] for row in rows]
    return CurveCampaign(
        name=name,
        method=method,
        instrument=Instrument(**json.loads(instrument)),
        response=response,
        base=base,
        columns={column: values[:, k] for k, column in enumerate(rows[0][1])},
        groups={
            column: np.array([row[k] for row in labels], dtype=np.str_) for k, column in enumerate(rows[0][3])
        },
        units=dict(zip(names, units, strict=True)),
        time=time,
        lines=np.array([row[0] for row in rows], dtype=np.int64),
        standard_uncertainty=uncertainty,
        files=source_files(db, campaign_id),
    )


def curve_content(curve: CurveCampaign) -> str:
    """The content hash of everything that is stored of a curve. Raises DataError for numbers that are not finite."""
    return _content(curve, asdict(curve.instrument))


def stored_curve_content(db: Database, campaign_id: int, *, signed_zeros: bool = False) -> str:
    """The same computed anew from what is stored, "" where no import wrote it; ``signed_zeros`` as in ``audit.bits``.

    An earlier version described its instrument with the keys of then: those that are stored are hashed.
    """
    ((text,),) = db.rows(
        "SELECT machine_description FROM imported_campaign WHERE campaign_id = ?", [campaign_id]
    )
    instrument = json.loads(text)
    # A key that stands there twice, or other white space, is not in the hash.
    if json.dumps(instrument) != text:
        return ""
    return _content(curve_by_number(db, campaign_id), instrument, signed_zeros=signed_zeros)


def _content(curve: CurveCampaign, instrument: dict[str, Any], *, signed_zeros: bool = False) -> str:
    for name, values in curve.columns.items():
        if not np.all(np.isfinite(values)):
            raise DataError(f"column {name} of campaign {curve.name} must hold finite numbers")
    return audit.digest(
        curve.name,
        curve.method,
        instrument,
        [curve.response, curve.base, curve.time, curve.standard_uncertainty, dict(curve.units)],
        [[name, audit.bits(values, signed_zeros=signed_zeros)] for name, values in curve.columns.items()],
        [[name, [str(label) for label in labels]] for name, labels in curve.groups.items()],
        [int(line) for line in curve.lines],
        [[file.name, file.sha256] for file in sorted(curve.files, key=lambda file: file.name)],
    )
