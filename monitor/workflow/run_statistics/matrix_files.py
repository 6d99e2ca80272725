"""Covariance and correlation matrices of repeated runs as CSV files, for a spreadsheet or another program.

186 probed coordinates make matrices of 35 000 numbers: too much for a document that people read.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from monitor.exceptions import InputError
from monitor.records import Array
from monitor.statistics import Covariance, Pooling


def write_matrices(folder: Path, what: str, pooled: Pooling, units: Sequence[str]) -> list[str]:
    """Two files for all runs, for what is pooled within groups, and for every group of two runs or more; their paths.

    ``what`` begins their names; ``units`` (p,) are those of the values. A row is one quantity: its name, unit,
    degrees of freedom and standard uncertainty, then its covariances (in the product of both units) or correlations
    with all, empty where it never varies. Raises InputError where the folder cannot be written.
    """
    paths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, covariance in _kinds(pooled):
            for kind, matrix in (("covariance", covariance.matrix), ("correlation", covariance.correlation)):
                path = folder / f"{what}-{kind}-{name}.csv"
                _write(path, covariance, matrix, units)
                paths.append(str(path))
    except OSError as error:
        raise InputError(f"--matrices {folder}: {error.strerror or error}") from error
    return paths


def _kinds(pooled: Pooling) -> Iterator[tuple[str, Covariance]]:
    yield "all", pooled.covariance_all
    yield "pooled", pooled.covariance_pooled
    for number, (label, covariance) in enumerate(
        zip(pooled.labels, pooled.covariance_by_group, strict=True), start=1
    ):
        if covariance is not None:
            # A label may hold what no file name may; its number keeps two labels apart.
            plain = re.sub(r"[^\w.-]+", "-", label).strip("-")
            yield f"{number}-{plain}", covariance


def _write(path: Path, covariance: Covariance, matrix: Array, units: Sequence[str]) -> None:
    # Excel reads UTF-8 where a byte order mark says so.
    with path.open("w", encoding="utf-8-sig", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(["name", "unit", "degrees_of_freedom", "u", *covariance.names])
        for name, unit, u, row in zip(covariance.names, units, covariance.u, matrix, strict=True):
            numbers = ["" if not np.isfinite(value) else repr(float(value)) for value in row]
            lines.writerow([name, unit, covariance.dof, repr(float(u)), *numbers])
