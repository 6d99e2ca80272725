"""The correlation of a curve's neighbouring rows in words, for the verbs and for the sentences of a finding."""

from __future__ import annotations

from monitor.workflow.identify.answer import CurveNoise


def correlation(noise: CurveNoise) -> str:
    """The correlation of neighbouring rows, and how slowly it fades: what a mean is worth depends on both."""
    neighbours = f"correlation {noise.lag_one:.2f}"
    return (
        f"{neighbours}, times {noise.slow:.2f} with each further row" if noise.lag_one > 0.0 else neighbours
    )
