"""JCGM 101:2008 7.9.2: numerical tolerances, edge cases included."""

import pytest

from monitor.exceptions import DataError
from monitor.uncertainty import numerical_tolerance


def test_jcgm101_7_9_2_every_vector(gum):
    vectors = (
        gum("numerical_tolerance")["vectors"] + gum("numerical_tolerance")["recalled_examples_JCGM101_7_9_2"]
    )
    assert len(vectors) == 18
    for row in vectors:
        assert numerical_tolerance(row["u"], row["n_dig"]) == pytest.approx(row["delta"], rel=1e-12)


def test_powers_of_ten_over_all_decades():
    for exponent in range(-12, 12):
        value = float(f"1e{exponent}")
        assert numerical_tolerance(value, 2) == pytest.approx(0.05 * value, rel=1e-12)


def test_tolerance_refusals():
    with pytest.raises(DataError, match=r"positive, finite value, but the value is 0"):
        numerical_tolerance(0.0)
    with pytest.raises(DataError, match=r"digits must be at least 1, but is 0"):
        numerical_tolerance(1.0, 0)
