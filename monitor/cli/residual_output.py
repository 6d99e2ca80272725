"""What the verbs print of residuals: a machine in micrometres with two decimals, a curve with four digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from monitor.cli import output
from monitor.reporting.curve_finding import correlation

if TYPE_CHECKING:
    from monitor.workflow.explain.compare_answer import CurveComparison, MachineComparison

#: Said of residuals in µm where nothing but angles was read.
ANGLES = "all readings are angles: 1 µm stands for 1 µrad, what it comes to at one metre"


def four_digits(value: float | None) -> str:
    """A number with four digits; a dash where there is none."""
    return "-" if value is None else f"{value:.4g}"


def with_uncertainty(value: float | None, u: float | None) -> str:
    """A value with its standard uncertainty, to two digits of the latter; with a power of ten where needed."""
    if value is None:
        return "-"
    if u is None or not u > 0.0:
        return f"{value:.6g}"
    size = max(abs(value), u)
    if 1e-4 <= size < 1e6:
        return f"{output.rounded(value, u)} ± {output.two_digits(u)}"
    power = int(f"{size:e}".partition("e")[2])
    value, u = value / 10.0**power, u / 10.0**power
    return f"({output.rounded(value, u)} ± {output.two_digits(u)})e{power:+03d}"


def summary(comparison: MachineComparison | CurveComparison) -> None:
    """The comparison in some sentences."""
    # Loaded here: `model list`, which prints no comparison, waits twice as long otherwise.
    from monitor.workflow.explain.compare_answer import CurveComparison, MachineComparison

    curve = comparison if isinstance(comparison, CurveComparison) else None
    number = output.micrometres if curve is None else four_digits
    unit = comparison.unit
    base = "" if curve is None else f" ({curve.base})"
    source = "the stated uncertainty"
    expected = (
        ""
        if comparison.expected_rms is None
        else f", expected {number(comparison.expected_rms)} {unit} from {source}"
    )
    repeats = (
        "no repeats"
        if comparison.repeatability is None
        else f"repeatability {number(comparison.repeatability)} {unit}"
    )
    model = f"{comparison.campaign}, model {comparison.model}{base}"
    output.say(f"{model}: RMS {number(comparison.rms)} {unit}{expected}; {repeats}")
    if isinstance(comparison, MachineComparison) and comparison.are_angles:
        output.say(ANGLES)
    test = comparison.lack_of_fit
    if test.f is not None:
        output.say(f"lack of fit over repeatability: F = {test.f:.2f}, {output.stated('p', test.p)}")
    if curve is not None and curve.autocorrelation.noticed:
        noise = curve.autocorrelation
        output.say(
            "neighbouring rows resemble each other under this model: "
            f"{correlation(noise.lag_one, noise.slow)} (a missing effect or correlated noise; explain tells which)"
        )
    output.say(f"verdict: {comparison.verdict.value}")


def files(names: Sequence[str] | None) -> None:
    """The files of the figures, one a line."""
    for name in names or ():
        output.say(name)
