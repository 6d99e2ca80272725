"""Draws one parameter over dates: runs with their intervals, tolerance, changes, and the drift up to its limit."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta

import numpy as np

from monitor.reporting.health.concern import DRIFT_P
from monitor.reporting.health.records import Drift, ParameterHealth
from monitor.reporting.palette import BLUE, INK, MID, ORANGE
from monitor.reporting.svg.plot import LETTER, SCALE, Drawing, Panel, text_width, tick_room, tick_words
from monitor.reporting.svg.sparkline import value_range
from monitor.units import DAYS_PER_YEAR

WIDTH_MM, HEIGHT_MM = 104.0, 45.0
#: Margins around the panel in tenths of a millimetre: numbers, words above, tolerances at the right, dates.
_LEFT, _TOP, _RIGHT, _BOTTOM = 92.0, 74.0, 78.0, 52.0
#: Signs of a machine's name for which a title has room: a parameter whose words leave it less has its symbol alone.
_NAME_OF_MACHINE = 12
#: A forecast is drawn at most so many times the history's length ahead.
_AHEAD = 1.0
#: A stated U is drawn by itself where it is so many times the bar of its run.
_WIDER = 1.15
#: Steps between dates along the axis, in days, and in months where a month is the least.
_DAYS = (1, 2, 7, 14)
_MONTHS = (1, 2, 3, 6, 12, 24, 60, 120)
_DAYS_PER_MONTH = DAYS_PER_YEAR / 12


def trend_picture(machine: str, parameter: ParameterHealth) -> str:
    """Return the history of a parameter of a machine as SVG; no words stand inside the panel.

    The line of a drift that is more than chance is drawn over the runs that it was found from, and dashed ahead to the
    day on which the tolerance is reached, where that is no further ahead than the drift was watched for.
    """
    history, drift = parameter.history, parameter.drift
    half = np.nan_to_num(np.array(history.u) * parameter.expanded / parameter.u, posinf=0.0)
    stated = _stated_apart(parameter, float(half[-1]))
    first, last = history.times[0], _end(parameter)
    margin = max((last - first) * 0.03, timedelta(hours=12))
    low, high = value_range(
        np.array([*history.values, *stated[:1]]),
        np.array([*half, *stated[1:]]),
        parameter.tolerance,
        always=parameter.reaches_soon,
    )
    left_edge = max(_LEFT, tick_room((low, high), 5) + 6.0)
    limits = () if parameter.tolerance is None else (parameter.tolerance, -parameter.tolerance)
    right_room = max(_RIGHT, *(text_width(_limit_words(limit), bold=True) + 14.0 for limit in (0.0, *limits)))
    on = Drawing(WIDTH_MM, HEIGHT_MM, f"{machine}: {parameter.in_words} over dates")
    panel = Panel(
        left_edge, _TOP, WIDTH_MM * SCALE - left_edge - right_room, HEIGHT_MM * SCALE - _TOP - _BOTTOM,
        (_days(first - margin), _days(last + margin)), (low, high),
    )  # fmt: skip
    _words(on, machine, parameter)
    panel.frame(on, "", "", ticks=4, named=dict(_date_ticks(first - margin, last + margin)))
    _tolerance(on, panel, parameter.tolerance)
    for changed in parameter.changed_at:
        if first <= changed <= last:
            on.line(panel.x(_days(changed)), _TOP, panel.x(_days(changed)), _TOP + panel.height, ORANGE, 4.0)
    for week, colour in ((False, MID), (True, BLUE)):
        rows = [index for index, this_week in enumerate(history.this_week) if this_week == week]
        middles = [
            (panel.x(_days(history.times[index])), panel.y(history.values[index]), half[index])
            for index in rows
        ]
        scale = panel.height / (high - low)
        on.path(
            "".join(f"M{x:.1f} {y - u * scale:.1f}V{y + u * scale:.1f}" for x, y, u in middles),
            stroke=colour,
            width=2.2,
        )
        on.dots("".join(f"M{x:.1f} {y:.1f}h0" for x, y, _ in middles), colour, 11.0)
    if stated:
        _ends(on, panel, _days(history.times[-1]), *stated)
    if drift is not None and _is_drawn(parameter):
        _drift(on, panel, drift, history.times[-1], last)
    return on.svg()


def _is_drawn(parameter: ParameterHealth) -> bool:
    """Return whether there is a line of a drift: one that is stated, or that will come to the limit soon. A line
    through what chance or a step makes would be taken for a forecast."""
    drift = parameter.drift
    if drift is None or drift.at_last is None or drift.since is None:
        return False
    last = parameter.history.times[-1].date()
    is_ahead = drift.crosses_at is not None and drift.crosses_at > last
    return drift.p_value < DRIFT_P or (is_ahead and parameter.reaches_soon)


def _end(parameter: ParameterHealth) -> datetime:
    """The last moment of the picture: the last run, or the day on which the limit is reached."""
    first, last = parameter.history.times[0], parameter.history.times[-1]
    if parameter.drift is None or not _is_drawn(parameter):
        return last
    limit = last + (last - first) * _AHEAD
    crossing = parameter.drift.crosses_at
    if crossing is None or crossing <= last.date() or not parameter.reaches_soon:
        return last + (last - first) * 0.15
    return min(limit, datetime.combine(crossing, datetime.min.time()) + timedelta(days=1))


def _stated_apart(parameter: ParameterHealth, half: float) -> tuple[float, ...]:
    """Estimate and U as stated, where that U is wider than the bar of the last run: it has more than the scatter of
    the readings in it, such as lack of fit; else nothing."""
    wider = np.isfinite(parameter.expanded) and parameter.expanded > _WIDER * half
    return (parameter.estimate, parameter.expanded) if wider else ()


def _ends(on: Drawing, panel: Panel, at: float, estimate: float, expanded: float) -> None:
    """Draw a stated interval with ends, so that it is told from the bars of the runs."""
    x, top, bottom = panel.x(at), panel.y(estimate + expanded), panel.y(estimate - expanded)
    on.path(
        f"M{x:.1f} {top:.1f}V{bottom:.1f}M{x - 9:.1f} {top:.1f}h18M{x - 9:.1f} {bottom:.1f}h18",
        stroke=BLUE,
        width=2.2,
    )


def _words(on: Drawing, machine: str, parameter: ParameterHealth) -> None:
    """Write machine, parameter and unit above the panel, and below them what the line says."""
    on.text(0.0, 0.9 * LETTER, _title(machine, parameter), bold=True)
    half = parameter.history.u[-1] * parameter.expanded / parameter.u
    legend = "bars: U; blue: this week"
    if _stated_apart(parameter, half):
        legend = "bars: scatter; with ends: U; blue: this week"
    if parameter.changed_at:
        legend += "; orange: a change"
    if _is_drawn(parameter):
        legend += "; line: drift, dashed: forecast"
    on.text(0.0, 2.2 * LETTER, legend, colour=MID)


def _title(machine: str, parameter: ParameterHealth) -> str:
    """Return machine, parameter and unit; the machine's name is cut where there is no room, before that the words of a
    parameter that leave it little."""
    name = f"{parameter.in_words} ({parameter.name}) / {parameter.unit}"
    if text_width(f"{machine[:_NAME_OF_MACHINE]}…: {name}", bold=True) > WIDTH_MM * SCALE:
        name = f"{parameter.name} / {parameter.unit}"
    title, signs = f"{machine}: {name}", len(machine)
    while text_width(title, bold=True) > WIDTH_MM * SCALE and signs > 1:
        signs -= 1
        title = f"{machine[:signs]}…: {name}"
    return title


def _tolerance(on: Drawing, panel: Panel, tolerance: float | None) -> None:
    """Draw the limits that lie in the panel, dashed, with their values at the right."""
    right = panel.x0 + panel.width
    low, high = panel.up
    if (
        tolerance is not None
        and low <= -tolerance
        and tolerance <= high
        and panel.y(-tolerance) - panel.y(tolerance) < LETTER
    ):
        # Next to each other where the scatter is that much larger: one number for both.
        on.line(panel.x0, panel.y(0.0), right, panel.y(0.0), INK, 3.0, "14 8")
        on.text(right + 8, panel.y(0.0) + 0.36 * LETTER, f"±{tick_words(tolerance)}", bold=True)
        return
    for limit in () if tolerance is None else (-tolerance, tolerance):
        if panel.up[0] <= limit <= panel.up[1]:
            y = panel.y(limit)
            on.line(panel.x0, y, right, y, INK, 3.0, "14 8")
            on.text(right + 8, y + 0.36 * LETTER, _limit_words(limit), bold=True)


def _limit_words(limit: float) -> str:
    return ("+" if limit > 0 else "") + tick_words(limit)


def _drift(on: Drawing, panel: Panel, drift: Drift, last: datetime, end: datetime) -> None:
    """Draw the line of a drift through its value at the last run, cut off where it leaves the panel."""
    assert drift.at_last is not None
    assert drift.since is not None
    level, slope, low, high = drift.at_last, drift.per_year / DAYS_PER_YEAR, *panel.up
    begin = max(_days(drift.since), panel.across[0])
    ahead = _days(end)
    if slope:
        edges = sorted((edge - level) / slope + _days(last) for edge in (low, high))
        begin, ahead = max(begin, edges[0]), min(ahead, edges[1])
    for start, stop, dash in ((begin, min(_days(last), ahead), ""), (_days(last), ahead, "12 9")):
        if stop > start:
            heights = [level + slope * (at - _days(last)) for at in (start, stop)]
            on.line(
                panel.x(start), panel.y(heights[0]), panel.x(stop), panel.y(heights[1]), ORANGE, 4.5, dash
            )


def _days(moment: datetime) -> float:
    return (moment - datetime(1970, 1, 1)) / timedelta(days=1)


def _date_ticks(first: datetime, last: datetime) -> Iterator[tuple[float, str]]:
    """Yield at most seven days, months or years between two moments with what is written there."""
    days = (last - first) / timedelta(days=1)
    step = next((step for step in _DAYS if days / step <= 6.5), None)
    if step is not None:
        at = first.date() + timedelta(days=1)
        while (moment := datetime.combine(at, datetime.min.time())) <= last:
            yield _days(moment), f"{at:%Y-%m-%d}" if days <= 4 or step > 1 else f"{at:%m-%d}"
            at += timedelta(days=step)
        return
    months = next((step for step in _MONTHS if days / _DAYS_PER_MONTH / step <= 6.5), _MONTHS[-1])
    index = first.year * 12 + first.month  # the first month that begins within the picture
    index = -(-index // months) * months
    while (moment := datetime(index // 12, index % 12 + 1, 1)) <= last:
        yield _days(moment), f"{moment:%Y}" if months % 12 == 0 else f"{moment:%Y-%m}"
        index += months
