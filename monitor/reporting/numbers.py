"""Rounds and writes a result: the last step before paper, never before.

The expanded uncertainty keeps two significant digits and the estimate is rounded to the same place
(GUM 7.2.6; ILAC-P14:09/2020, 5.4). Numbers are rounded as written in decimal, so that 2.675 is a tie although the
binary number nearest to it is not. A tie of an estimate goes to the even digit (ISO 80000-1:2022, rule A); a
tie of an uncertainty goes up, and an uncertainty never loses more than a twentieth by rounding
(EA-4/02 M:2022, 6.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, ROUND_HALF_UP, ROUND_UP, Context, Decimal

from monitor.exceptions import DataError

#: Significant digits of an uncertainty (GUM 7.2.6: at most two usually suffice).
DIGITS = 2
#: The part of an uncertainty that rounding may take away (EA-4/02 M:2022, 6.3).
LARGEST_LOSS = Decimal("0.05")
#: A correlation coefficient this near to 1 is 1: what double precision leaves of a diagonal.
_UNITY = Decimal("1e-9")
#: Holds every digit of every double: 309 before and 324 behind the decimal sign.
_EXACT = Context(prec=700)
MINUS = "\N{MINUS SIGN}"
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"
LESS_OR_EQUAL = "\N{LESS-THAN OR EQUAL TO}"


@dataclass(frozen=True)
class Rounded:
    """An estimate and its uncertainty at the same decimal place, as decimal numbers."""

    estimate: Decimal
    uncertainty: Decimal


def decimal_of(value: float, what: str = "the number") -> Decimal:
    """Return the shortest decimal number that means this double. Raises DataError for NaN and infinities."""
    if not math.isfinite(value):
        raise DataError(f"{what} must be finite to be printed, but is {value}")
    return Decimal(repr(float(value)))


def round_uncertainty(uncertainty: float, digits: int = DIGITS) -> Decimal:
    """Round an uncertainty to so many significant digits, never by more than ``LARGEST_LOSS`` downwards.

    Raises DataError where it is negative, zero (no digit is significant) or not finite, or digits below 1.
    """
    if digits < 1:
        raise DataError(f"digits must be at least 1, but is {digits}")
    exact = decimal_of(uncertainty, "an uncertainty")
    if exact <= 0:
        raise DataError(f"an uncertainty must be positive to be rounded, but is {uncertainty}")
    rounded = _significant(exact, digits, ROUND_HALF_UP)
    if exact - rounded > LARGEST_LOSS * exact:
        rounded = _significant(exact, digits, ROUND_UP)
    return rounded


def round_to_place(value: float, reference: Decimal) -> Decimal:
    """Round a value at the last decimal place of ``reference``, ties to the even digit; zero has no sign."""
    unit = Decimal(1).scaleb(_exponent(reference))
    rounded = decimal_of(value, "an estimate").quantize(unit, ROUND_HALF_EVEN, context=_EXACT)
    return abs(rounded) if rounded.is_zero() else rounded


def round_result(estimate: float, uncertainty: float, digits: int = DIGITS) -> Rounded:
    """Round an estimate at the place of the rounded uncertainty. Raises DataError as ``round_uncertainty``."""
    rounded = round_uncertainty(uncertainty, digits)
    return Rounded(round_to_place(estimate, rounded), rounded)


def written(number: Decimal, decimal_sign: str = ".") -> str:
    """Write a decimal number: fixed notation, a true minus sign, the decimal sign of the language."""
    text = f"{number:f}"
    return text.replace("-", MINUS).replace(".", decimal_sign)


def written_correlation(coefficient: float, decimal_sign: str = ".") -> str:
    """Write a correlation coefficient: two decimals, and more where two would print 1 or -1 (GUM 7.2.6)."""
    exact = decimal_of(coefficient, "a correlation coefficient")
    if abs(exact) > 1 + _UNITY:
        raise DataError(f"a correlation coefficient lies between -1 and 1, but is {coefficient}")
    if abs(exact) > 1 - _UNITY:
        return written(Decimal(1).copy_sign(exact), decimal_sign)
    decimals = 2
    while abs(rounded := round_to_place(coefficient, Decimal(1).scaleb(-decimals))) == 1:
        decimals += 1
    return written(rounded, decimal_sign)


def written_factor(factor: float, decimal_sign: str = ".", standard_error: float = 0.0) -> str:
    """Write a coverage factor with two decimals, 2.45; fewer where its standard error exceeds half of the last."""
    step = next((step for step in ("0.01", "0.1") if standard_error <= 0.5 * float(step)), "1")
    return written(round_to_place(factor, Decimal(step)), decimal_sign)


def written_probability(p: float, decimal_sign: str = ".") -> str:
    """Write a coverage probability in percent, without trailing zeros: 95 %, 99.73 %."""
    percent = (decimal_of(p, "a probability") * 100).normalize()
    return f"{written(percent, decimal_sign)}\N{NO-BREAK SPACE}%"


def _exponent(number: Decimal) -> int:
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)  # finite: the only Decimals made here
    return exponent


def _significant(exact: Decimal, digits: int, rounding: str) -> Decimal:
    rounded = exact.quantize(Decimal(1).scaleb(exact.adjusted() - digits + 1), rounding)
    if rounded.adjusted() > exact.adjusted():  # 9.96 became 10.0: one digit fewer stands behind the sign
        rounded = rounded.quantize(Decimal(1).scaleb(rounded.adjusted() - digits + 1), rounding)
    return rounded
