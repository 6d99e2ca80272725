"""The history of one parameter on one time axis: runs, tolerance, changes, events, forecast, conditions below."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

from monitor.web.charts.chart import DASHES, SERIES, Chart, Trace, axis, look
from monitor.web.words import channel, number

if TYPE_CHECKING:
    from monitor.workflow.history.values import ValuesAnswer
    from monitor.workflow.trend.answer import ParameterTrend, TrendAnswer

#: Expanded uncertainty of a run as it is drawn: k = 2.
K = 2.0
#: By what the runs can be coloured.
GROUPINGS = ("campaign", "method", "day", "warm-up")


def trend_chart(
    values: ValuesAnswer, parameter: str, trend: TrendAnswer | None, grouping: str = GROUPINGS[0]
) -> Chart:
    """Draw a parameter's runs with U (k = 2), and what is known of them once the trend is computed (None: not yet)."""
    series = values.parameters[parameter]
    traces = _runs(values, parameter, grouping)
    shapes, notes = _tolerance(series.tolerance, series.unit)
    statement = None if trend is None else trend.parameters.get(parameter)
    if trend is not None:
        events = [
            (_shop_time(values, event.at), f"{event.kind}: {event.description}") for event in trend.events
        ]
        shapes += [_upright(at, "@violet", "dash") for at, _ in events]
        notes += _flags(values, events, "@violet", 1.0)
    if statement is not None:
        changes = [
            (_shop_time(values, change.at), f"{change.kind} {number(change.size)} {change.unit}")
            for change in statement.changes
            if change.at
        ]
        shapes += [_upright(at, "@orange", "solid") for at, _ in changes]
        notes += _flags(values, changes, "@orange", 0.84)
        traces += _forecast(values, statement)
    conditions = _conditions(values)
    return Chart(
        key="trend",
        says=f"{parameter} of {values.machine} over {len(values.run)} runs in {series.unit}, bars are ± U (k = 2)",
        traces=[*traces, *conditions],
        layout={
            "xaxis": axis("", type="date", anchor="y2" if conditions else "y"),
            "yaxis": axis(f"{parameter} / {series.unit}", domain=[0.34 if conditions else 0.0, 1.0]),
            **({"yaxis2": axis(_shared_title(values), domain=[0.0, 0.26])} if conditions else {}),
            "shapes": shapes,
            "annotations": notes,
            "hovermode": "closest",
        },
        height=560 if conditions else 400,
    )


def _shop_time(values: ValuesAnswer, at: str) -> str:
    """A moment by the clock of the run nearest to it: plotly.js draws what the clock shows, whatever its offset."""
    moment = datetime.fromisoformat(at)
    nearest = min(values.started_at, key=lambda started: abs(started - moment))
    return moment.astimezone(nearest.tzinfo).isoformat()


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
                "hovertemplate": "%{text}<br>%{x}<br>%{y:.4g} " + series.unit + "<extra></extra>",
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


def _upright(at: str, colour: str, dash: str) -> Any:
    return {
        "type": "line", "yref": "paper", "y0": 0, "y1": 1, "x0": at, "x1": at,
        "line": {"color": colour, "width": 1.5, "dash": dash},
    }  # fmt: skip


def _flags(values: ValuesAnswer, flags: Sequence[tuple[str, str]], colour: str, top: float) -> list[Any]:
    """The words at upright lines, on paper of their own; one below the other in turns, since neighbours may be close.

    Those of the last quarter of the runs stand on the left of their lines, where they have room.
    """
    first, last = min(values.started_at), max(values.started_at)
    late = (first + 0.75 * (last - first)).isoformat()
    return [
        {
            "x": at, "yref": "paper", "y": top - 0.055 * (index % 3), "yanchor": "top", "text": text[:60],
            "showarrow": False, "xanchor": "right" if at > late else "left", "bgcolor": "@paper",
            "font": {"color": colour, "size": 11},
        }
        for index, (at, text) in enumerate(flags)
    ]  # fmt: skip


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
                    "marker": {"size": 4}, "hovertemplate": channel(name) + " %{y:.4g}<extra></extra>",
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
