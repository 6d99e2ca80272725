"""Probings to rows and back, in the digits that the controller printed.

A record holds radians; the file held degrees. What is stored is the shortest decimal number of degrees that
gives exactly the record's radians: the printed number, for anything printed with up to 15 digits. A reading
that no number of degrees gives (a simulated one, never one from a file) is kept to within one unit of the
last place, 1e-16 of its value.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array, Machine, Probings
from monitor.store.audit import bits, digest
from monitor.store.connection import Database
from monitor.units import DEGREE

#: Most decimals of a degree that are tried: beyond, the shortest number has no meaning for a controller.
_MOST_DECIMALS = 15
#: Rows of one statement, whole groups of rows of DuckDB (122 880 each).
_ROWS_AT_ONCE = 122_880


@dataclass(frozen=True)
class PrintedProbings:
    """The columns of the table ``probing``: readings in mm or degree, channels as recorded, (n,) each."""

    run: npt.NDArray[np.int64]
    sequence: npt.NDArray[np.int64]
    time: Array
    target: list[str]
    readings: Mapping[str, Array]
    channels: Mapping[str, Array]

    def sha256(self, *, signed_zeros: bool = False) -> str:
        """Return the hash of all rows; ``signed_zeros`` as in ``audit.bits``."""
        columns: list[object] = [self.target]
        for counted in (self.run, self.sequence):
            columns.append(np.asarray(counted, dtype="<i8").tobytes())
        columns.append(bits(self.time, signed_zeros=signed_zeros))
        for group in (self.readings, self.channels):
            for name in sorted(group):
                columns += [name, bits(group[name], signed_zeros=signed_zeros)]
        return digest(columns)


def printed(probings: Probings, machine: Machine) -> PrintedProbings:
    """A record in the controller's units; the machine says which axes turn.

    Raises DataError for no rows, and for a reading that is not finite.
    """
    if len(probings) == 0:
        raise DataError("a campaign needs at least one probing")
    for name, values in {"time": probings.time, **probings.readings}.items():
        if not np.all(np.isfinite(values)):
            row = int(np.flatnonzero(~np.isfinite(values))[0]) + 1
            raise DataError(
                f"{name} must be a finite number; row {row} of the probings has {values[row - 1]}"
            )
    for name, values in probings.channels.items():
        if np.any(np.isinf(values)):
            row = int(np.flatnonzero(np.isinf(values))[0]) + 1
            raise DataError(f"channel {name} must be finite or empty; row {row} has {values[row - 1]}")
    return PrintedProbings(
        probings.run,
        probings.sequence,
        probings.time,
        [sys.intern(str(target)) for target in probings.target],
        {
            axis: _printed_reading(values, linear=machine.is_linear(axis))
            for axis, values in probings.readings.items()
        },
        dict(probings.channels),
    )


def as_record(rows: PrintedProbings, machine: Machine) -> Probings:
    """The rows in internal units; the machine says which axes turn."""
    return Probings(
        rows.run,
        rows.sequence,
        rows.time,
        np.array(rows.target, dtype=np.str_),
        {
            axis: values if machine.is_linear(axis) else values * DEGREE.factor
            for axis, values in rows.readings.items()
        },
        dict(rows.channels),
    )


def insert(db: Database, campaign_id: int, rows: PrintedProbings) -> None:
    """Add the rows of a campaign, many at once: a million in one statement take 300 MB more."""
    columns: dict[str, npt.NDArray[Any]] = {
        "position": np.arange(1, len(rows.run) + 1),
        "run": rows.run,
        "sequence": rows.sequence,
        "time_s": rows.time,
        "target": np.array(rows.target, dtype=object),
    }
    columns |= {f"r{k}": values for k, values in enumerate(rows.readings.values())}
    columns |= {f"c{k}": values for k, values in enumerate(rows.channels.values())}
    readings = ", ".join(f"r{k}" for k in range(len(rows.readings)))
    channels = ", ".join(f"c{k}" for k in range(len(rows.channels)))
    for start in range(0, len(rows.run), _ROWS_AT_ONCE):
        db.insert(
            "INSERT INTO probing SELECT $campaign_id, position, run, sequence, time_s, target, "
            f"map($axes::VARCHAR[], [{readings}]::DOUBLE[]), map($names::VARCHAR[], [{channels}]::DOUBLE[]) "
            "FROM incoming ORDER BY position",
            {name: values[start : start + _ROWS_AT_ONCE] for name, values in columns.items()},
            {"campaign_id": campaign_id, "axes": list(rows.readings), "names": list(rows.channels)},
        )


def select(db: Database, campaign_id: int) -> PrintedProbings:
    """The rows of a campaign as they were inserted."""
    ((axes, names),) = db.rows(
        "SELECT map_keys(readings), map_keys(channels) FROM probing WHERE campaign_id = ? AND position = 1",
        [campaign_id],
    )
    selected = [f"readings[$a{k}] AS r{k}" for k in range(len(axes))]
    selected += [f"channels[$n{k}] AS c{k}" for k in range(len(names))]
    parameters: dict[str, object] = {"campaign_id": campaign_id}
    parameters |= {f"a{k}": axis for k, axis in enumerate(axes)}
    parameters |= {f"n{k}": name for k, name in enumerate(names)}
    columns = db.arrays(
        f"SELECT run, sequence, time_s, target, {', '.join(selected)} "
        "FROM probing WHERE campaign_id = $campaign_id ORDER BY position",
        parameters,
    )
    return PrintedProbings(
        np.asarray(columns["run"], dtype=np.int64),
        np.asarray(columns["sequence"], dtype=np.int64),
        np.asarray(columns["time_s"], dtype=np.float64),
        [sys.intern(str(target)) for target in columns["target"]],
        {axis: _numbers(columns[f"r{k}"]) for k, axis in enumerate(axes)},
        {name: _numbers(columns[f"c{k}"]) for k, name in enumerate(names)},
    )


def _printed_reading(internal: Array, *, linear: bool) -> Array:
    if linear:
        return np.asarray(internal, dtype=np.float64)
    degrees = np.asarray(internal, dtype=np.float64) / DEGREE.factor
    # The quotient may be off by one unit of the last place: its neighbours stand in line after the decimals.
    near = [np.nextafter(degrees, -np.inf), np.nextafter(degrees, np.inf), degrees]
    rounded = (np.round(degrees, decimals) for decimals in range(_MOST_DECIMALS, -1, -1))
    printed = degrees
    for candidate in chain(near, rounded):
        printed = np.where(candidate * DEGREE.factor == internal, candidate, printed)
    return printed


def _numbers(column: npt.NDArray[np.float64]) -> Array:
    filled: Array = np.ma.filled(np.ma.asarray(column, dtype=np.float64), np.nan)
    return filled
