"""The history of one parameter on one time axis: runs, tolerance, changes, events, forecast, conditions below."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np

from monitor.records import Array
from monitor.web.charts.chart import DASHES, SERIES, Chart, Trace, axis, in_template, look
from monitor.web.charts.line_words import Line, Runs, words_at_lines
from monitor.web.words import channel, counted, number

if TYPE_CHECKING:
    from monitor.workflow.history.values import ValuesAnswer
    from monitor.workflow.trend.answer import ParameterTrend, TrendAnswer

#: Expanded uncertainty of a run as it is drawn: k = 2.
K = 2.0
#: Beside the runs a chart shows this part of the time that they span; runs of one day span this time.
MARGIN, LEAST_SPAN = 0.06, timedelta(hours=2)
#: Probability of a slope by chance below which a forecast widens the chart.
MOVING = 0.05
#: By what the runs can be coloured.
GROUPINGS = ("campaign", "method", "day", "warm-up")
#: What is drawn before and after the only moment of a history.
AROUND_ONE = timedelta(days=1)
#: Colours of upright lines: events of the machine, changes of the parameter.
EVENT, CHANGE = "@violet", "@orange"


def trend_chart(
    values: ValuesAnswer, parameter: str, trend: TrendAnswer | None, grouping: str = GROUPINGS[0]
) -> Chart:
    """Draw a parameter's runs with U (k = 2), and what is known of them once the trend is computed (None: not yet)."""
    series = values.parameters[parameter]
    traces = _runs(values, parameter, grouping)
    shapes, notes = _tolerance(series.tolerance, series.unit)
    statement = None if trend is None else trend.parameters.get(parameter)
    conditions = _conditions(values)
    lowest = 0.34 if conditions else 0.0
    begin, end = _shown_time(values, statement)
    lines = [] if trend is None else _lines(values, trend, statement)
    lines = [line for line in lines if begin <= datetime.fromisoformat(line.at) <= end]
    if lines:
        shapes += [_upright(line) for line in lines]
        runs = Runs.of(
            values.started_at, _numbers(series.values), K * np.nan_to_num(_numbers(series.u)), lowest
        )
        notes += words_at_lines(lines, runs, lowest)
    if statement is not None:
        traces += _forecast(values, statement)
    return Chart(
        key="trend",
        says=f"{parameter} of {values.machine} over {counted(len(values.run), 'run')} in {series.unit}, "
        "bars are ± U (k = 2)",
        traces=[*traces, *conditions],
        layout={
            "xaxis": axis(
                "",
                type="date",
                anchor="y2" if conditions else "y",
                range=[begin.isoformat(), end.isoformat()],
            ),
            "yaxis": axis(f"{parameter} / {series.unit}", domain=[lowest, 1.0]),
            **({"yaxis2": axis(_shared_title(values), domain=[0.0, 0.26])} if conditions else {}),
            "shapes": shapes,
            "annotations": notes,
            "hovermode": "closest",
        },
        height=560 if conditions else 400,
    )


def _shown_time(values: ValuesAnswer, statement: ParameterTrend | None) -> tuple[datetime, datetime]:
    """The time that a chart shows: that of the runs and as much of what follows as is told of it.

    Events and forecasts far away would press the runs into a line; a double click on the chart shows all of them. The
    slope of a forecast is told where chance makes as large a one in less than ``MOVING``.
    """
    begin, end = min(values.started_at), max(values.started_at)
    if begin == end:
        return begin - AROUND_ONE, end + AROUND_ONE
    span = max(end - begin, LEAST_SPAN)
    latest = end
    if statement is not None and statement.forecast.crosses_limit_at is not None:
        p_value = statement.drift.p_value
        if p_value is not None and p_value < MOVING:
            crosses_at = datetime.fromisoformat(_shop_time(values, statement.forecast.crosses_limit_at))
            latest = max(end, min(crosses_at, end + span))
    return begin - MARGIN * span, latest + MARGIN * span


def _shop_time(values: ValuesAnswer, at: str) -> str:
    """A moment by the clock of the run nearest to it: plotly.js draws what the clock shows, whatever its offset."""
    moment = datetime.fromisoformat(at)
    nearest = min(values.started_at, key=lambda started: abs(started - moment))
    return moment.astimezone(nearest.tzinfo).isoformat()


def groups_without_legend(values: ValuesAnswer, parameter: str, grouping: str) -> int:
    """Return how many groups the runs of a parameter have, where that is more than there are colours; else 0."""
    series = values.parameters.get(parameter)
    if series is None:
        return 0
    labels = _labels(values, grouping)
    count = len({labels[index] for index, value in enumerate(series.values) if value is not None})
    return count if count > len(SERIES) else 0


def _runs(values: ValuesAnswer, parameter: str, grouping: str) -> list[Trace]:
    series = values.parameters[parameter]
    groups: dict[str, list[int]] = {}
    labels = _labels(values, grouping)
    for index, value in enumerate(series.values):
        if value is not None:
            groups.setdefault(labels[index], []).append(index)
    traces = []
    # More have no colour of their own, and their legend would push the chart aside; the pointer names each.
    listed = len(groups) <= len(SERIES)
    for position, (label, rows) in enumerate(groups.items()):
        colour, marker = look(position)
        traces.append(
            {
                "type": "scatter", "mode": "markers", "name": label, "showlegend": listed,
                "x": [values.started_at[row].isoformat() for row in rows],
                "y": [series.values[row] for row in rows],
                "error_y": {
                    "type": "data", "array": [K * (series.u[row] or 0.0) for row in rows], "thickness": 1, "width": 0,
                    "color": colour,
                },
                "marker": {"color": colour, "symbol": marker, "size": 7},
                "text": [f"{values.campaign[row]}, run {values.run[row]}" for row in rows],
                "hovertemplate": "%{text}<br>%{x}<br>%{y:.4g} " + in_template(series.unit) + "<extra></extra>",
            }
        )  # fmt: skip
    return traces


def _labels(values: ValuesAnswer, grouping: str) -> Sequence[str]:
    if grouping == "method":
        return values.method
    if grouping == "day":
        return [f"{at:%Y-%m-%d}" for at in values.started_at]
    if grouping == "warm-up":
        return ["warming up" if warming else "warm" for warming in values.warm_up]
    return values.campaign


def _tolerance(limit: float | None, unit: str) -> tuple[list[Any], list[Any]]:
    if limit is None:
        return [], []
    lines = [
        {
            "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": level, "y1": level,
            "line": {"color": "@stop", "width": 1.5, "dash": "longdash"},
        }
        for level in (-limit, limit)
    ]  # fmt: skip
    note = {
        "xref": "paper", "x": 1, "xanchor": "right", "y": limit, "yanchor": "bottom", "showarrow": False,
        "text": f"tolerance ± {number(limit)} {unit}", "font": {"color": "@stop", "size": 11},
    }  # fmt: skip
    return lines, [note]


def _lines(values: ValuesAnswer, trend: TrendAnswer, statement: ParameterTrend | None) -> list[Line]:
    """The upright lines: events of the machine, then changes of the parameter."""
    events = [
        Line(_shop_time(values, event.at), f"{event.kind}: {event.description}", EVENT)
        for event in trend.events
    ]
    return events + [
        Line(_shop_time(values, change.at), f"{change.kind} {number(change.size)} {change.unit}", CHANGE)
        for change in (() if statement is None else statement.changes)
        if change.at
    ]


def _numbers(cells: Sequence[float | None]) -> Array:
    return np.array([np.nan if cell is None else cell for cell in cells])


def _upright(line: Line) -> Any:
    dash = "dash" if line.colour == EVENT else "solid"
    return {
        "type": "line", "yref": "paper", "y0": 0, "y1": 1, "x0": line.at, "x1": line.at,
        "line": {"color": line.colour, "width": 1.5, "dash": dash},
    }  # fmt: skip


def _forecast(values: ValuesAnswer, statement: ParameterTrend) -> list[Trace]:
    """The line from the latest runs to the day on which the limit is reached, with the interval of that day."""
    mean, forecast = statement.mean, statement.forecast
    if forecast.crosses_limit_at is None or forecast.limit is None or mean.latest_at is None:
        return []
    latest_at, crosses_at = (_shop_time(values, at) for at in (mean.latest_at, forecast.crosses_limit_at))
    level = forecast.limit if (statement.drift.slope_per_year or 0.0) >= 0.0 else -forecast.limit
    lines: list[Trace] = [
        {
            "type": "scatter", "mode": "lines", "name": "forecast", "x": [latest_at, crosses_at],
            "y": [mean.latest, level], "line": {"color": "@stop", "dash": "dot", "width": 2},
            "hovertemplate": "limit reached %{x|%Y-%m-%d}<extra></extra>",
        }
    ]  # fmt: skip
    first, last = forecast.crosses_limit_interval or (None, None)
    ends = (
        [latest_at if first is None else _shop_time(values, first), _shop_time(values, last)] if last else []
    )
    if ends:
        lines.append(
            {
                "type": "scatter", "mode": "lines+markers", "name": "when the limit is reached (interval)", "x": ends,
                "y": [level, level], "line": {"color": "@stop", "width": 4},
                "marker": {"symbol": "line-ns-open", "size": 12, "color": "@stop"},
            }
        )  # fmt: skip
    return lines


def _shared_title(values: ValuesAnswer) -> str:
    """The unit of the conditions where they share it; the legend has that of each."""
    return "°C" if all(name.endswith("_degC") for name in values.conditions) else "conditions"


def _conditions(values: ValuesAnswer) -> list[Trace]:
    traces = []
    for index, (name, column) in enumerate(values.conditions.items()):
        rows = [row for row, value in enumerate(column) if value is not None]
        if rows:
            x, y = _broken(values, column, rows)
            traces.append(
                {
                    "type": "scatter", "mode": "lines+markers", "name": channel(name), "yaxis": "y2",
                    "x": x, "y": y,
                    "line": {"color": look(index + 2)[0], "dash": DASHES[index % len(DASHES)], "width": 1.2},
                    "marker": {"size": 4}, "hovertemplate": in_template(channel(name)) + " %{y:.4g}<extra></extra>",
                }
            )  # fmt: skip
    return traces


def _broken(
    values: ValuesAnswer, column: Sequence[float | None], rows: Sequence[int]
) -> tuple[list[str], list[float | None]]:
    """Times and values of a condition, with a gap between days: nobody knows what it was overnight."""
    x: list[str] = []
    y: list[float | None] = []
    day = None
    for row in rows:
        at = values.started_at[row]
        if day is not None and at.date() != day:
            x.append(at.isoformat())
            y.append(None)
        x.append(at.isoformat())
        y.append(column[row])
        day = at.date()
    return x, y
