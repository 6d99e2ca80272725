"""The file of true values that a rehearsal writes beside its campaign folders.

Names by a pattern (`shop/*`) meet it among the folders, and it is no campaign.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path

TRUTH = "truth.csv"


@dataclass(frozen=True)
class TrueValue:
    """A row of the file of true values."""

    machine: str
    campaign: str
    run: int
    started_at: str
    parameter: str
    value: float
    unit: str


def write_truth(file: Path, rows: Iterable[TrueValue]) -> None:
    """Write the true values as CSV, the names of the columns first."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(_columns())
        writer.writerows(map(astuple, rows))


def is_truth(path: Path) -> bool:
    """Whether a path is such a file: by its name and the names of its columns."""
    if path.name != TRUTH or not path.is_file():
        return False
    head = ",".join(_columns()).encode()
    try:
        with path.open("rb") as stream:
            return stream.read(len(head) + 2).rstrip() == head
    except OSError:
        # A file that cannot be read is refused in words by who reads it.
        return False


def _columns() -> list[str]:
    return [each.name for each in fields(TrueValue)]
