"""The values of an identification in one row, a list a parameter: what histories and the fleet's sums are read from.

``parameter_value`` holds the same numbers a row each, for people; there the rows of one machine lie scattered over the
weeks, and DuckDB looks through whole blocks of 122 880 rows for a few of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.store.connection import Database
from monitor.store.past.gathering import BY_PARAMETER, PORTION, gather

if TYPE_CHECKING:
    from monitor.store.results import StoredIdentification


@dataclass(frozen=True)
class IdentifiedValues:
    """Of identification ``number``: ``runs`` (r,), ``value`` and ``u`` (r, p) in mm, rad or 1, NaN where refused."""

    number: int
    runs: npt.NDArray[np.int64]
    value: Array
    u: Array


def insert_values(db: Database, number: int, identification: StoredIdentification) -> None:
    """Write the row of an identification, inside the transaction that writes it."""
    value, u = _matrices(identification)
    db.execute(
        "INSERT INTO identified_values VALUES (?, ?::BIGINT[], ?::DOUBLE[][], ?::DOUBLE[][])",
        [number, [run.run for run in identification.runs], _lists(value), _lists(u)],
    )


def values_of(db: Database, numbers: Sequence[int]) -> Mapping[int, IdentifiedValues]:
    """The values of identifications by their number; one that has none is left out."""
    if not numbers:
        return {}
    marks = ", ".join("?" * len(numbers))
    # As arrays of one list each: lists of lists of Python's numbers cost twice the rest.
    columns = db.arrays(
        "SELECT identification_id, runs, flatten(value) AS value, flatten(u) AS u FROM identified_values "
        f"WHERE identification_id IN ({marks})",
        list(numbers),
    )
    values = {}
    for number, runs, value, u in zip(*columns.values(), strict=True):
        shape = (-1, len(runs))
        values[int(number)] = IdentifiedValues(
            int(number),
            np.asarray(runs, dtype=np.int64),
            # NULL, of what was refused, is masked.
            np.ma.filled(value, np.nan).reshape(shape).T,
            np.ma.filled(u, np.nan).reshape(shape).T,
        )
    return values


def agrees(db: Database, number: int, identification: StoredIdentification) -> bool:
    """Whether the row of an identification is what its runs say."""
    stored = values_of(db, [number]).get(number)
    if stored is None:
        return False
    value, u = _matrices(identification)
    runs = np.array([run.run for run in identification.runs], dtype=np.int64)
    a, b = np.argsort(stored.runs), np.argsort(runs)
    return (
        np.array_equal(stored.runs[a], runs[b])
        and np.array_equal(stored.value[a], value[b], equal_nan=True)
        and np.array_equal(stored.u[a], u[b], equal_nan=True)
    )


def gather_values(db: Database, portion: int = PORTION) -> None:
    """Write the rows that are missing after ``parameter_value`` was filled by SQL, as large test data are."""
    with db.connected() as connection:
        gather(connection, BY_PARAMETER, portion)


def _matrices(identification: StoredIdentification) -> tuple[Array, Array]:
    return (
        np.array([run.estimate for run in identification.runs]),
        np.array([np.sqrt(np.diag(run.covariance)) for run in identification.runs]),
    )


def _lists(matrix: Array) -> list[list[float | None]]:
    return [[None if np.isnan(value) else float(value) for value in column] for column in matrix.T]
