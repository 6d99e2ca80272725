"""The figures of a certificate's results, written as SVG: parameters with their intervals, residuals by group.

No figure is taller than a page: what 150 parameters need is broken into several, with one scale a unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from monitor.records import Array
from monitor.reporting.certificate.results import ResidualSummary, ResultSet
from monitor.reporting.palette import BLUE, FAINT, INK, MID, PALE
from monitor.reporting.svg.plot import (
    LETTER,
    SCALE,
    WIDE,
    Drawing,
    nice_ticks,
    shortened,
    text_width,
    tick_room,
    tick_words,
)
from monitor.reporting.texts import Texts

#: A figure with heading and caption takes less than half of a page (259 mm between the margins): a page before it that
#: it does not fit on is more than half full.
TALLEST_MM = 112.0
#: A row, and what a panel needs besides its rows (scale, unit, distance to the next), in tenths of a millimetre.
_ROW, _AROUND = 39.0, 96.0
#: Names of parameters may take this part of the width.
_MOST_OF_WIDTH = 0.5
#: Half the height of a bracket that marks a limit, and of the end of an interval.
_BRACKET, _END = 13.0, 7.0


@dataclass(frozen=True)
class _Panel:
    """Rows of one unit in a figure: which parameters, the unit, the range of its scale."""

    members: tuple[int, ...]
    unit: str
    across: tuple[float, float]


def interval_drawings(result: ResultSet, texts: Texts, width_mm: float) -> list[Drawing]:
    """Estimates with the interval ± U of each, a panel a unit, in as many figures as fit a page each.

    Limits of absolute values are drawn as brackets where there are any.
    """
    limits = np.full(len(result.names), np.nan) if result.tolerances is None else result.tolerances
    label = min(
        WIDE * LETTER * max(map(len, result.names), default=1) + 12.0, _MOST_OF_WIDTH * width_mm * SCALE
    )
    drawings = []
    for panels in _pages(result, limits):
        height = sum(len(panel.members) * _ROW + _AROUND for panel in panels)
        on = Drawing(width_mm, height / SCALE, texts("figures.intervals_alternative"))
        top = 0.0
        for panel in panels:
            _draw_panel(on, panel, result, limits, top, label, texts.decimal_sign)
            top += len(panel.members) * _ROW + _AROUND
        drawings.append(on)
    return drawings


def _pages(result: ResultSet, limits: Array) -> list[list[_Panel]]:
    """The panels, page by page; a unit with more rows than a page has goes on on the next one."""
    pages: list[list[_Panel]] = [[]]
    room = TALLEST_MM * SCALE
    most = int((room - _AROUND) // _ROW)
    for unit in dict.fromkeys(result.units):
        of_unit = [index for index, other in enumerate(result.units) if other == unit]
        across = _range(result, limits, of_unit)
        # Pieces of nearly the same length.
        pieces = -(-len(of_unit) // most)
        each = -(-len(of_unit) // pieces)
        for first in range(0, len(of_unit), each):
            part = tuple(of_unit[first : first + each])
            height = len(part) * _ROW + _AROUND
            if height > room and pages[-1]:
                pages.append([])
                room = TALLEST_MM * SCALE
            pages[-1].append(_Panel(part, unit, across))
            room -= height
    return pages


def _range(result: ResultSet, limits: Array, members: list[int]) -> tuple[float, float]:
    """What a scale spans: every interval, every limit, zero, and a little more."""
    ends = [0.0]
    for index in members:
        value, half = float(result.estimate[index]), float(result.expanded[index])
        ends += [value - half, value + half]
        if math.isfinite(limits[index]):
            ends += [-float(limits[index]), float(limits[index])]
    low, high = min(ends), max(ends)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _draw_panel(
    on: Drawing, panel: _Panel, result: ResultSet, limits: Array, top: float, label: float, sign: str
) -> None:
    left_edge, right_edge = label + 10.0, on.width_mm * SCALE - 14.0
    ticks = nice_ticks(*panel.across, max(3, int((right_edge - left_edge) / 130.0)))
    right_edge = _end(ticks, panel, left_edge, right_edge, on.width_mm * SCALE)
    bottom = top + len(panel.members) * _ROW
    low, high = panel.across

    def x(value: float) -> float:
        return left_edge + (right_edge - left_edge) * (value - low) / (high - low)

    bars, ends, dots, brackets, bands = [], [], [], [], []
    for row, index in enumerate(panel.members):
        y = top + (row + 0.5) * _ROW
        value, half = float(result.estimate[index]), float(result.expanded[index])
        first, last = x(value - half), x(value + half)
        bands.append(f"M{left_edge:.1f} {y:.1f}H{right_edge:.1f}")
        bars.append(f"M{first:.1f} {y:.1f}H{last:.1f}")
        ends += [f"M{end:.1f} {y - _END:.1f}v{2 * _END:g}" for end in (first, last)]
        dots.append(f"M{x(value):.1f} {y:.1f}h0")
        if math.isfinite(limits[index]):
            brackets += [
                f"M{x(limit):.1f} {y - _BRACKET:.1f}v{2 * _BRACKET:g}"
                for limit in (-limits[index], limits[index])
            ]
        on.text(label, y + 0.36 * LETTER, shortened(result.names[index], label), anchor="end")
    on.path("".join(bands), stroke=FAINT, width=11.0)
    on.line(x(0.0), top, x(0.0), bottom, MID, 2.0, "8 5")
    on.path("".join(bars), stroke=BLUE, width=4.6)
    on.path("".join(ends), stroke=BLUE, width=3.0)
    on.dots("".join(dots), BLUE, 13.0)
    if brackets:
        on.path("".join(brackets), stroke=INK, width=5.0)
    on.line(left_edge, bottom, right_edge, bottom, MID, 2.0)
    for value in ticks:
        on.line(x(value), bottom, x(value), bottom + 8.0, MID, 2.0)
        on.text(x(value), bottom + 12.0 + LETTER, tick_words(value, sign), anchor="middle")
    on.text((left_edge + right_edge) / 2, bottom + 17.0 + 2.0 * LETTER, panel.unit, anchor="middle")


def _end(ticks: Sequence[float], panel: _Panel, left: float, right: float, sheet: float) -> float:
    """Where an axis from ``left`` ends, at most at ``right``: its last number stays on the ``sheet``, tiny ones are
    wide."""
    low, high = panel.across
    room = sheet - 2.0 - 0.5 * text_width(tick_words(ticks[-1])) - left
    return min(right, left + room * (high - low) / (ticks[-1] - low))


def residual_drawing(
    residuals: ResidualSummary, texts: Texts, width_mm: float, height_mm: float, title: str
) -> Drawing:
    """Bars of the RMS residuals, µm, the probe's uncertainty dashed; bars above twice of it are striped."""
    on = Drawing(width_mm, height_mm, title)
    level = residuals.probe_um
    most = max([*residuals.rms_um, level or 0.0]) * 1.15 or 1.0
    left_edge = max(100.0, tick_room((0.0, most), 6) + 12.0 + LETTER)
    right_edge, top = width_mm * SCALE - 8.0, 14.0
    bottom = height_mm * SCALE - 30.0 - 2.4 * LETTER

    def y(value: float) -> float:
        return bottom - (bottom - top) * value / most

    for value in nice_ticks(0.0, most, 6):
        on.line(left_edge, y(value), right_edge, y(value), PALE, 1.5)
        on.text(
            left_edge - 10.0, y(value) + 0.36 * LETTER, tick_words(value, texts.decimal_sign), anchor="end"
        )
    step = (right_edge - left_edge) / max(len(residuals.labels), 4)
    bars, stripes = [], []
    for index, rms in enumerate(residuals.rms_um):
        first, wide = left_edge + (index + 0.17) * step, 0.66 * step
        bars.append(f"M{first:.1f} {bottom:.1f}V{y(rms):.1f}h{wide:.1f}V{bottom:.1f}z")
        if level is not None and rms > 2.0 * level:
            stripes += [
                f"M{first:.1f} {at:.1f}h{wide:.1f}" for at in np.arange(y(rms) + 9.0, bottom - 4.0, 12.0)
            ]
    on.path("".join(bars), fill=BLUE)
    if stripes:
        on.path("".join(stripes), stroke="white", width=4.0)
    longest = WIDE * LETTER * max(map(len, residuals.labels), default=1) + 10.0
    every = max(1, math.ceil(longest / step))
    for index in range(0, len(residuals.labels), every):
        at = left_edge + (index + 0.5) * step
        on.text(at, bottom + 10.0 + LETTER, residuals.labels[index], anchor="middle")
    on.line(left_edge, bottom, right_edge, bottom, MID, 2.4)
    if level is not None:
        on.line(left_edge, y(level), right_edge, y(level), INK, 3.4, "14 8")
    on.text(
        (left_edge + right_edge) / 2, bottom + 16.0 + 2.1 * LETTER,
        texts("figures.by", kind=texts(f"figures.{residuals.by}")), anchor="middle",
    )  # fmt: skip
    on.text(LETTER, (top + bottom) / 2, texts("figures.residual_axis"), anchor="middle", turned=True)
    return on
