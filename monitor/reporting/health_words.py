"""Numbers in the sentences of the health report and of `monitor trend`: an estimate with its standard uncertainty."""

from __future__ import annotations

import math

from monitor.reporting.numbers import decimal_of, round_result, written


def in_words(estimate: float, uncertainty: float, *, sign: bool = False) -> tuple[str, str]:
    """Estimate and uncertainty for a sentence, never in powers of ten; ``sign`` also writes a plus.

    Where there is no uncertainty above zero to round to, the estimate keeps three digits and the uncertainty is 0.
    """
    if math.isfinite(uncertainty) and uncertainty > 0.0:
        found = round_result(estimate, uncertainty)
        texts = written(found.estimate), written(found.uncertainty)
    else:
        texts = written(decimal_of(float(f"{estimate:.3g}"))), "0"
    return ("+" if sign and estimate >= 0.0 else "") + texts[0], texts[1]
