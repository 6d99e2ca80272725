"""Rounding: the examples of GUM 7.2.6 and cases worked by hand."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given, strategies as st

from monitor.exceptions import DataError
from monitor.reporting.numbers import (
    round_result,
    round_to_place,
    round_uncertainty,
    written,
    written_correlation,
    written_factor,
    written_probability,
)


def test_ea_4_02_6_3_an_uncertainty_loses_at_most_a_twentieth() -> None:
    # GUM 7.2.6 would round 10.47 up to 11, as its reader may; 10 loses 4.5 %, which EA-4/02 allows.
    assert written(round_uncertainty(10.47)) == "10"
    assert written(round_uncertainty(1.44, digits=1)) == "2"  # 1 would lose 31 %


def test_gum_7_2_6_u_of_28_05_kilohertz_is_rounded_to_28() -> None:
    assert written(round_uncertainty(28.05)) == "28"


def test_gum_7_2_6_10_05762_ohm_with_27_milliohm_becomes_10_058() -> None:
    rounded = round_result(10.05762, 0.027)
    assert (written(rounded.estimate), written(rounded.uncertainty)) == ("10.058", "0.027")


def test_gum_7_2_6_correlation_near_unity_keeps_the_digits_that_say_it_is_not_one() -> None:
    assert written_correlation(0.9996) == "0.9996"
    assert written_correlation(-0.99996) == "−0.99996"
    assert written_correlation(0.995) == "0.995"
    assert written_correlation(-0.336) == "−0.34"
    assert written_correlation(-0.002) == "0.00"
    assert written_correlation(1.0 - 1e-15) == "1"


@pytest.mark.parametrize(
    ("uncertainty", "expected"),
    [
        (0.0996, "0.10"),
        (9.96, "10"),
        (99.5, "100"),
        (1234.0, "1200"),
        (0.00012345, "0.00012"),
        (2.0, "2.0"),
        (1e-12, "0.0000000000010"),
    ],
)
def test_two_significant_digits_by_hand(uncertainty: float, expected: str) -> None:
    assert written(round_uncertainty(uncertainty)) == expected


def test_tie_of_an_uncertainty_goes_up_as_written_in_decimal() -> None:
    assert (
        written(round_uncertainty(0.265)) == "0.27"
    )  # the double is below the tie, the decimal number is on it
    assert written(round_uncertainty(0.0345)) == "0.035"


def test_iso_80000_1_rule_a_tie_of_an_estimate_goes_to_the_even_digit() -> None:
    assert written(round_to_place(12.25, Decimal("0.1"))) == "12.2"
    assert written(round_to_place(12.35, Decimal("0.1"))) == "12.4"
    assert written(round_to_place(-0.5, Decimal("1"))) == "0"


def test_ea_4_02_6_3_one_digit_that_would_lose_over_a_twentieth_goes_up() -> None:
    assert written(round_uncertainty(0.0234, 1)) == "0.03"
    assert written(round_uncertainty(0.0204, 1)) == "0.02"


def test_estimate_follows_the_place_of_a_large_uncertainty() -> None:
    rounded = round_result(-98764.3, 1234.0)
    assert (written(rounded.estimate), written(rounded.uncertainty)) == ("−98800", "1200")
    assert written(round_result(104.4, 99.5).estimate) == "100"


def test_estimate_that_rounds_to_zero_has_no_sign() -> None:
    assert written(round_result(-0.04, 1.9).estimate) == "0.0"


def test_decimal_sign_is_a_matter_of_the_language() -> None:
    assert written(Decimal("-1.50"), ",") == "−1,50"
    assert written_factor(2.447, ",") == "2,45"


def test_probability_in_percent() -> None:
    assert written_probability(0.95) == "95\N{NO-BREAK SPACE}%"
    assert written_probability(0.9973) == "99.73\N{NO-BREAK SPACE}%"
    assert written_probability(0.9) == "90\N{NO-BREAK SPACE}%"


@given(st.floats(1e-30, 1e30), st.floats(-1e30, 1e30))
def test_rounding_moves_an_uncertainty_by_at_most_a_twentieth_and_an_estimate_by_half_a_place(
    uncertainty: float, estimate: float
) -> None:
    u, y = Decimal(repr(uncertainty)), Decimal(repr(estimate))
    rounded = round_result(estimate, uncertainty)
    assert abs(rounded.uncertainty - u) <= u / 20
    assert rounded.estimate.as_tuple().exponent == rounded.uncertainty.as_tuple().exponent
    assert abs(rounded.estimate - y) <= Decimal(5).scaleb(int(rounded.uncertainty.as_tuple().exponent) - 1)


def test_what_cannot_be_rounded_is_refused_in_words() -> None:
    with pytest.raises(DataError, match=r"an uncertainty must be positive to be rounded, but is 0\.0"):
        round_uncertainty(0.0)
    with pytest.raises(DataError, match="an uncertainty must be finite to be printed, but is nan"):
        round_uncertainty(float("nan"))
    with pytest.raises(DataError, match="an estimate must be finite to be printed, but is inf"):
        round_result(float("inf"), 1.0)
    with pytest.raises(DataError, match="digits must be at least 1, but is 0"):
        round_uncertainty(1.0, 0)
    with pytest.raises(DataError, match=r"lies between -1 and 1, but is 1\.2"):
        written_correlation(1.2)
