"""Draws a parameter's history in one line of a table: dots with intervals, tolerance lines, changes.

Written as SVG without a drawing library: a night has thirteen of them for each of a hundred machines.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.reporting.health.records import ParameterHealth
from monitor.reporting.palette import BLUE, FAINT, INK, MID, ORANGE
from monitor.units import DAYS_PER_YEAR

WIDTH_MM, HEIGHT_MM = 52.0, 7.6
#: Units of the drawing a millimetre, and the empty frame around it in the same units.
_SCALE, _EDGE = 10.0, 8.0
#: Runs at most in one picture; of more, the latest.
MOST = 80
_SECONDS_PER_YEAR = DAYS_PER_YEAR * 86400.0


@dataclass(frozen=True)
class _Points:
    """Where the runs (n,) stand in the picture: their middles ``x`` and ``y``, half of each bar, the step in x.

    ``this_week`` (n,) marks the runs of the week.
    """

    x: Array
    y: Array
    half: Array
    step: float
    this_week: npt.NDArray[np.bool_]


def sparkline(parameter: ParameterHealth, factor: float) -> str:
    """Return the history as a data address; the bars are ``factor`` times each run's standard uncertainty.

    Runs stand side by side in the order of time, those of this week dark and filled. A vertical line marks a
    change, dashed horizontal lines the tolerance where it lies in or near the range of the values.
    """
    history = parameter.history
    values = np.array(history.values[-MOST:])
    half = factor * np.array(history.u[-MOST:])
    half = np.where(np.isfinite(half), half, 0.0)
    low, high = value_range(values, half, parameter.tolerance)
    width, height = WIDTH_MM * _SCALE, HEIGHT_MM * _SCALE
    inner_width, inner_height = width - 2 * _EDGE, height - 2 * _EDGE
    step = inner_width / max(len(values), 8)
    columns = np.arange(len(values), dtype=np.float64)
    points = _Points(
        x=_EDGE + inner_width - step * (len(values) - columns - 0.5),
        y=_EDGE + inner_height * (high - values) / (high - low),
        half=inner_height * half / (high - low),
        step=step,
        this_week=np.array(history.this_week[-MOST:], dtype=bool),
    )
    marks = [
        f'<rect x="0" y="0" width="{width:.0f}" height="{height:.0f}" fill="{FAINT}"/>',
        *_levels(parameter.tolerance, low, high),
        *_changes(parameter, points),
        *_drift(parameter, low, high, points),
        *_runs(points),
    ]
    picture = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH_MM}mm" height="{HEIGHT_MM}mm" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">{"".join(marks)}</svg>'
    )
    return "data:image/svg+xml;base64," + base64.b64encode(picture.encode("ascii")).decode("ascii")


def _levels(tolerance: float | None, low: float, high: float) -> Iterator[str]:
    """Yield the lines of zero and of the tolerance that lie within the range."""
    width, inner_height = WIDTH_MM * _SCALE, HEIGHT_MM * _SCALE - 2 * _EDGE
    for level in (-(tolerance or 0.0), 0.0, tolerance or 0.0):
        if low <= level <= high:
            y = _EDGE + inner_height * (high - level) / (high - low)
            limit = tolerance is not None and level != 0.0
            look = (
                f'stroke="{INK}" stroke-width="2.4" stroke-dasharray="9 5"'
                if limit
                else f'stroke="{MID}" stroke-width="1.2"'
            )
            yield f'<line x1="0" x2="{width:.0f}" y1="{y:.1f}" y2="{y:.1f}" {look}/>'


def _changes(parameter: ParameterHealth, points: _Points) -> Iterator[str]:
    """Yield a line at every change between two of the runs."""
    times, height = parameter.history.times[-MOST:], HEIGHT_MM * _SCALE
    for changed in parameter.changed_at:
        after = [index for index, time in enumerate(times) if time >= changed]
        if after and times[0] < changed:
            x = float(points.x[after[0]]) - points.step / 2
            yield (
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="2" y2="{height - 2:.0f}" stroke="{ORANGE}" stroke-width="3.2"/>'
            )


def _drift(parameter: ParameterHealth, low: float, high: float, points: _Points) -> Iterator[str]:
    """Yield the line of the drift at the runs that it was found from; between them it is straight in time."""
    drift, times = parameter.drift, parameter.history.times[-MOST:]
    if drift is None or drift.at_last is None or drift.since is None:
        return
    inner_height, joined = HEIGHT_MM * _SCALE - 2 * _EDGE, []
    for x, time in zip(points.x, times, strict=True):
        level = drift.at_last + drift.per_year * (time - times[-1]).total_seconds() / _SECONDS_PER_YEAR
        if time >= drift.since and low <= level <= high:
            joined.append(f"{x:.1f} {_EDGE + inner_height * (high - level) / (high - low):.1f}")
    if len(joined) > 1:
        yield f'<path d="M{"L".join(joined)}" fill="none" stroke="{ORANGE}" stroke-width="2.4"/>'


def _runs(points: _Points) -> Iterator[str]:
    """Yield the bars and dots of the runs, those of this week last.

    One path for all bars and one for all dots (round ends of lines of no length): the PDF is twice as quick.
    """
    for week, colour in ((False, MID), (True, BLUE)):
        rows = points.this_week == week
        middles = list(zip(points.x[rows], points.y[rows], points.half[rows], strict=True))
        if not middles:
            continue
        dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y, _ in middles)
        bars = "".join(f"M{x:.1f} {y - half:.1f}V{y + half:.1f}" for x, y, half in middles)
        yield f'<path d="{bars}" fill="none" stroke="{colour}" stroke-width="2"/>'
        for size, ink in ((10.2, colour),) if week else ((10.2, colour), (6.6, "white")):
            yield f'<path d="{dots}" fill="none" stroke="{ink}" stroke-width="{size}" stroke-linecap="round"/>'


def value_range(
    values: Array, half: Array, tolerance: float | None, *, always: bool = False
) -> tuple[float, float]:
    """Return the range of a picture: all values with their bars, and the tolerance where that leaves them legible.

    ``always`` has the tolerance in it all the same: where a forecast is drawn up to it.
    """
    low, high = float((values - half).min()), float((values + half).max())
    span = max(high - low, 1e-9 * max(abs(high), abs(low)), 1e-30)
    for level in () if tolerance is None else (-tolerance, tolerance):
        # A limit further off than twice the span would press the values into a line.
        near = low - 2.0 * span <= level <= high + 2.0 * span
        if near or (always and level * (low + high) > 0.0):
            low, high = min(low, level), max(high, level)
    margin = 0.06 * max(high - low, span)
    return low - margin, high + margin
