"""What the parameters of runs have of calibrated quantities that outlast a campaign, in and out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import TYPE_CHECKING

import numpy as np

from monitor.records import Array
from monitor.sources import CommonQuantity
from monitor.store.connection import Database

if TYPE_CHECKING:
    from monitor.store.results import StoredRun

_PARTS = """
SELECT identification_id, run, calibrated, certificate, quantity, u, part FROM common_part
WHERE identification_id IN ({marks}) ORDER BY rowid
"""


def insert_parts(db: Database, number: int, run: StoredRun) -> None:
    """Write the rows of a run, inside the transaction that writes its identification."""
    for quantity, part in run.common_parts.items():
        db.execute(
            "INSERT INTO common_part VALUES (?, ?, ?, ?, ?, ?, ?::DOUBLE[])",
            [
                number,
                run.run,
                *astuple(quantity),
                [None if np.isnan(value) else float(value) for value in part],
            ],
        )


def parts_of(db: Database, numbers: Sequence[int]) -> dict[tuple[int, int], dict[CommonQuantity, Array]]:
    """Return what runs have of each quantity (k,), in mm, rad or 1, by identification and run; none of older ones."""
    parts: dict[tuple[int, int], dict[CommonQuantity, Array]] = {}
    if not numbers:
        return parts
    for number, run, of, certificate, quantity, u, part in db.rows(
        _PARTS.format(marks=", ".join("?" * len(numbers))), list(numbers)
    ):
        of_run = parts.setdefault((number, run), {})
        of_run[CommonQuantity(of, certificate, quantity, u)] = np.array(part, dtype=np.float64)
    return parts
