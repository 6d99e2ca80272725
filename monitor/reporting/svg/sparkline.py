"""A parameter's history in one line of a table: dots with intervals, tolerance lines, where it changed.

Written as SVG by hand: thirteen of them a machine and a hundred machines a night have to cost nothing.
"""

from __future__ import annotations

import base64

import numpy as np

from monitor.records import Array
from monitor.reporting.health.records import ParameterHealth
from monitor.reporting.palette import BLUE, FAINT, INK, MID, ORANGE

WIDTH_MM, HEIGHT_MM = 52.0, 7.6
#: Units of the drawing a millimetre, and the empty frame around it in the same units.
_SCALE, _EDGE = 10.0, 8.0
#: Runs at most in one picture; of more, the latest.
MOST = 80


def sparkline(parameter: ParameterHealth, factor: float) -> str:
    """The history as a data address; the bars are ``factor`` times each run's standard uncertainty.

    Runs stand side by side in the order of time, those of this week dark and filled. A vertical line marks a
    change, dashed horizontal lines the tolerance where it lies in or near the range of the values.
    """
    history = parameter.history
    values = np.array(history.values[-MOST:])
    half = factor * np.array(history.u[-MOST:])
    half = np.where(np.isfinite(half), half, 0.0)
    low, high = _range(values, half, parameter.tolerance)
    width, height = WIDTH_MM * _SCALE, HEIGHT_MM * _SCALE
    inner_w, inner_h = width - 2 * _EDGE, height - 2 * _EDGE
    step = inner_w / max(len(values), 8)
    x = _EDGE + inner_w - step * (len(values) - np.arange(len(values)) - 0.5)
    y = _EDGE + inner_h * (high - values) / (high - low)
    bar = inner_h * half / (high - low)
    marks = [f'<rect x="0" y="0" width="{width:.0f}" height="{height:.0f}" fill="{FAINT}"/>']
    for level in (-(parameter.tolerance or 0.0), 0.0, parameter.tolerance or 0.0):
        if low <= level <= high:
            at = _EDGE + inner_h * (high - level) / (high - low)
            limit = parameter.tolerance is not None and level != 0.0
            look = (
                f'stroke="{INK}" stroke-width="2.4" stroke-dasharray="9 5"'
                if limit
                else f'stroke="{MID}" stroke-width="1.2"'
            )
            marks.append(f'<line x1="0" x2="{width:.0f}" y1="{at:.1f}" y2="{at:.1f}" {look}/>')
    times = history.times[-MOST:]
    for changed in parameter.changed_at:
        after = [place for place, at in enumerate(times) if at >= changed]
        if after and times[0] < changed:
            at = float(x[after[0]]) - step / 2
            marks.append(
                f'<line x1="{at:.1f}" x2="{at:.1f}" y1="2" y2="{height - 2:.0f}" stroke="{ORANGE}" stroke-width="3.2"/>'
            )
    own = np.array(history.this_week[-MOST:], dtype=bool)
    for week, colour in ((False, MID), (True, BLUE)):
        # One path for all bars and one for all dots (round ends of lines of no length): the PDF is twice as quick.
        dots = "".join(
            f"M{at:.1f} {here:.1f}h0" for at, here in zip(x[own == week], y[own == week], strict=True)
        )
        if not dots:
            continue
        bars = "".join(
            f"M{at:.1f} {here - long:.1f}V{here + long:.1f}"
            for at, here, long in zip(x[own == week], y[own == week], bar[own == week], strict=True)
        )
        marks.append(f'<path d="{bars}" fill="none" stroke="{colour}" stroke-width="2"/>')
        for wide, ink in ((10.2, colour),) if week else ((10.2, colour), (6.6, "white")):
            marks.append(
                f'<path d="{dots}" fill="none" stroke="{ink}" stroke-width="{wide}" stroke-linecap="round"/>'
            )
    picture = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH_MM}mm" height="{HEIGHT_MM}mm" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">{"".join(marks)}</svg>'
    )
    return "data:image/svg+xml;base64," + base64.b64encode(picture.encode("ascii")).decode("ascii")


def _range(values: Array, half: Array, tolerance: float | None) -> tuple[float, float]:
    """What the picture spans: all values with their bars, and the tolerance where that leaves them legible."""
    low, high = float((values - half).min()), float((values + half).max())
    span = max(high - low, 1e-9 * max(abs(high), abs(low)), 1e-30)
    for level in () if tolerance is None else (-tolerance, tolerance):
        # A limit further off than twice the span would press the values into a line.
        if low - 2.0 * span <= level <= high + 2.0 * span:
            low, high = min(low, level), max(high, level)
    margin = 0.06 * max(high - low, span)
    return low - margin, high + margin
