"""The file of linear-axis errors: read in internal units, or refused with every fault."""

from __future__ import annotations

from pathlib import Path

import pytest

from monitor.exceptions import InputError
from monitor.readers import read_linear_axes

EXAMPLE = Path(__file__).resolve().parents[2] / "examples/linear-axes.toml"


def test_the_example_is_in_internal_units():
    found = read_linear_axes(EXAMPLE)
    assert found.node_spacing == (20.0, 50.0)
    assert found.axes["Z"].proportional == pytest.approx(1e-5)
    assert found.axes["Z"].straightness == pytest.approx(2e-3)
    assert found.axes["Z"].squareness == pytest.approx({"X": 3e-5, "Y": 3e-5})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[axes.X]\n", "node_spacing_mm: this key is missing"),
        ("node_spacing_mm = [50.0, 20.0]\n[axes.X]\n", "must rise from above 0"),
        ("node_spacing_mm = [20.0, 50.0]\n", r"the table \[axes\] is missing"),
        ("node_spacing_mm = [20.0, 50.0]\n[axes.B]\n", "'B' is no linear axis"),
        ("node_spacing_mm = [20.0, 50.0]\n[axes.X]\npositioning_um = -2.0\n", "is negative"),
        (
            "node_spacing_mm = [20.0, 50.0]\n[axes.X]\nstraightnes_um = 2.0\n",
            "did you mean 'straightness_um'",
        ),
        (
            "node_spacing_mm = [20.0, 50.0]\n[axes.X]\nsquareness_um_per_m = { X = 3.0 }\n",
            "to another linear axis",
        ),
        ("node_spacing_mm = [20.0,\n", "this is not TOML"),
    ],
)
def test_faults_are_told(tmp_path, text, message):
    file = tmp_path / "axes.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        read_linear_axes(file)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(InputError, match="cannot be used"):
        read_linear_axes(tmp_path / "axes.toml")
