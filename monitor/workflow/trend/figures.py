"""Figures of `monitor trend`, drawn from its answer into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

import numpy as np
import scipy

from monitor.reporting.figures import titles
from monitor.reporting.figures.style import save
from monitor.reporting.figures.trend import RunsOverTime, parameter_over_time
from monitor.statistics import predict
from monitor.workflow.figure_files import ENDINGS, make_folder
from monitor.workflow.history.calendar import SECONDS_PER_DAY, days_since_1970
from monitor.workflow.history.past import ParameterPast
from monitor.workflow.history.season import SlopeVerdict
from monitor.workflow.trend.answer import ParameterTrend, TrendAnswer

#: Below this p-value a drift is stated as one.
MOVING = 0.05


def headline(name: str, parameter: ParameterTrend) -> str:
    """What one parameter's history says, in one line."""
    if parameter.changes:
        last = parameter.changes[-1]
        return titles.parameter_changed(name, last.size, last.u, last.unit, (last.at or "")[:10])
    drift = parameter.drift
    moving = drift.p_value is not None and drift.p_value < MOVING
    unsure = drift.verdict is SlopeVerdict.DRIFT_OR_SEASON
    return titles.parameter_drifts(
        name, drift.slope_per_year, drift.u_slope, parameter.unit, moving=moving, season_not_told=unsure
    )


def trend_figures(answer: TrendAnswer, past: Mapping[str, ParameterPast], folder: Path) -> tuple[str, ...]:
    """Draw one figure a parameter: the runs, the drift since the last change with its band, changes, events, limits."""
    make_folder(folder)
    files = []
    events = {days_since_1970(datetime.fromisoformat(event.at)): event.kind for event in answer.events}
    for name, parameter in answer.parameters.items():
        series, drift = past[name].series, past[name].drift
        shift = series.offset.total_seconds() / SECONDS_PER_DAY
        line = None
        if drift.stated is not None:
            t = np.linspace(float(drift.piece.t[0]), float(series.t[-1]), 60)
            level, u, _ = predict(drift.stated, t)
            factor = scipy.stats.t.isf((1.0 - drift.stated.confidence) / 2.0, drift.stated.dof)
            line = (t + shift, level, factor * u)
        u_run = np.where(np.isfinite(series.u), series.u, 0.0)
        figure = parameter_over_time(
            RunsOverTime(series.t + shift, series.values, 2.0 * u_run, series.unit), title=headline(name, parameter),
            line=line, limit=parameter.forecast.limit,
            changes=[change.at + shift for change in past[name].search.changes],
            events={at + shift: kind for at, kind in events.items()},
        )  # fmt: skip
        files += [str(save(figure, folder / f"trend-{name}{ending}")) for ending in ENDINGS]
    return tuple(files)
