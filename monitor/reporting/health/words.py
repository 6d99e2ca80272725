"""Numbers and days in the sentences of the health report and of `monitor trend`."""

from __future__ import annotations

import math
from datetime import datetime

from monitor.reporting.numbers import decimal_of, round_result, round_to_place, round_uncertainty, written


def in_words(estimate: float, uncertainty: float, *, sign: bool = False) -> tuple[str, str]:
    """Estimate and uncertainty for a sentence, never in powers of ten; ``sign`` also writes a plus.

    Where there is no uncertainty above zero to round to, the estimate keeps three digits and the uncertainty is 0.
    """
    if math.isfinite(uncertainty) and uncertainty > 0.0:
        rounded = round_result(estimate, uncertainty)
        texts = written(rounded.estimate), written(rounded.uncertainty)
    else:
        texts = written(decimal_of(float(f"{estimate:.3g}"))), "0"
    return ("+" if sign and estimate >= 0.0 else "") + texts[0], texts[1]


def day(moment: datetime) -> str:
    """A day in ISO 8601."""
    return f"{moment:%Y-%m-%d}"


def p_in_words(p: float) -> str:
    """A p-value with the sign of the relation before it."""
    return "<\N{NO-BREAK SPACE}0.0001" if p < 1e-4 else f"=\N{NO-BREAK SPACE}{p:.2g}"


def percent(p: float) -> str:
    """A probability in percent; what is nearly sure is not printed as sure."""
    if p < 0.001:
        return "< 0.1 %"
    if p > 0.999:
        return "> 99.9 %"
    rounded = round_uncertainty(100.0 * p) if p < 0.1 else round_to_place(100.0 * p, decimal_of(1.0))
    return f"{written(rounded)}\N{NO-BREAK SPACE}%"


def micrometres(value: float) -> str:
    """A length in micrometres, its unit on the same line."""
    return f"{value:.2f}\N{NO-BREAK SPACE}µm"


def plain(value: float) -> str:
    """A number as it was stated or recorded: four digits at most."""
    return written(decimal_of(float(f"{value:.4g}")))
