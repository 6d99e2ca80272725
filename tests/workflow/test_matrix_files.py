"""Matrices of repeated runs as files: those of numpy on the readings, with names, units and degrees of freedom."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from monitor.cli import main
from monitor.exceptions import InputError
from monitor.statistics import pool
from monitor.workflow.run_statistics.matrix_files import write_matrices

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "five-days"


def matrix(path: Path) -> tuple[list[dict[str, str]], np.ndarray]:
    """The rows of a file and its matrix."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    names = [row["name"] for row in rows]
    return rows, np.array([[float(row[name]) for name in names] for row in rows])


def test_the_matrices_of_the_probed_coordinates_are_those_of_numpy(tmp_path: Path, capsys) -> None:
    db, out = tmp_path / "one.duckdb", tmp_path / "out"
    assert main(["--db", str(db), "import", str(EXAMPLE)]) == 0
    assert main(["--db", str(db), "stats", "five-days", "--matrices", str(out)]) == 0
    said = capsys.readouterr().out
    assert str(out / "coordinates-covariance-pooled.csv") in said
    # All runs of the example follow one plan in one order: the readings of a run are one row, by numpy alone.
    with (EXAMPLE / "probings.csv").open(encoding="utf-8", newline="") as file:
        probings = list(csv.DictReader(file))
    with (EXAMPLE / "runs.csv").open(encoding="utf-8", newline="") as file:
        day = np.array([int(row["day"]) for row in csv.DictReader(file)])
    axes = [next(name for name in probings[0] if name.startswith(axis)) for axis in ("x", "y", "z")]
    runs = sorted({int(row["run"]) for row in probings})
    values = 1e3 * np.array(
        [[float(row[axis]) for row in probings if int(row["run"]) == run for axis in axes] for run in runs]
    )
    rows, everything = matrix(out / "coordinates-covariance-all.csv")
    np.testing.assert_allclose(everything, np.cov(values.T), atol=1e-6 * everything.max())
    assert {(row["unit"], row["degrees_of_freedom"]) for row in rows} == {("µm", "19")}
    rows, pooled = matrix(out / "coordinates-covariance-pooled.csv")
    within = sum(np.cov(values[day == one].T) * (np.sum(day == one) - 1) for one in set(day)) / 15
    np.testing.assert_allclose(pooled, within, atol=1e-6 * pooled.max())
    assert {row["degrees_of_freedom"] for row in rows} == {"15"}
    np.testing.assert_allclose([float(row["u"]) for row in rows], np.sqrt(np.diag(pooled)), rtol=1e-12)
    _, correlation = matrix(out / "coordinates-correlation-pooled.csv")
    scale = np.sqrt(np.diag(within))
    np.testing.assert_allclose(correlation, within / np.outer(scale, scale), atol=1e-6)
    assert len(list(out.glob("parameters-correlation-*.csv"))) == 2 + 5


def test_what_never_varies_is_empty_and_labels_may_hold_anything(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    values = np.column_stack([rng.normal(size=6), np.ones(6)])
    groups = ["below 21.3 / °C"] * 3 + ["below 21.3 : °C"] * 3
    paths = write_matrices(tmp_path, "parameters", pool(values, groups, ["EXX", "still"]), ["µm", "µm"])
    assert len(set(paths)) == len(list(tmp_path.iterdir())) == 8
    with (tmp_path / "parameters-correlation-all.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["name", "unit", "degrees_of_freedom", "u", "EXX", "still"]
    assert rows[1][4:] == ["1.0", ""]
    assert rows[2][3:] == ["0.0", "", ""]


def test_a_file_in_the_place_of_the_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="--matrices"):
        write_matrices(tmp_path / "taken", "parameters", pool([[1.0], [2.0]], [1, 1], ["EXX"]), ["µm"])
