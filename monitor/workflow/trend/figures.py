"""Figures of `monitor trend`, drawn from its result into a folder."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import numpy as np
import scipy

from monitor.reporting.figures.style import save
from monitor.reporting.figures.trend import parameter_over_time
from monitor.reporting.health.words import in_words
from monitor.statistics import predict
from monitor.workflow.figure_files import ENDINGS, make_folder
from monitor.workflow.history.series import SECONDS_PER_DAY
from monitor.workflow.trend.parameter import Document
from monitor.workflow.trend.trends import Trends


def _day(text: str) -> float:
    return datetime.fromisoformat(text).timestamp() / SECONDS_PER_DAY


def headline(name: str, one: Document) -> str:
    """What one parameter's history says, in one line."""
    if one["changes"]:
        last = one["changes"][-1]
        size, u = in_words(last["size"], last["u"], sign=True)
        return f"{name}: changed by {size} {last['unit']} (u = {u} {last['unit']}) on {last['at'][:10]}"
    if one["slope_per_year"] is None:
        return f"{name}: too little history for a drift"
    moving = one["p_value"] is not None and one["p_value"] < 0.05
    slope, u = in_words(one["slope_per_year"], one["u_slope"], sign=True)
    said = f"{name}: {slope} {one['unit']} a year (u = {u} {one['unit']} a year)"
    return said if moving else f"{said}, no drift seen"


def trend_figures(found: Trends, folder: Path) -> list[str]:
    """One figure a parameter: the runs, the drift since the last change with its band, changes, events, limits."""
    make_folder(folder)
    files = []
    events = {_day(one["at"]): one["kind"] for one in found.document.get("events", [])}
    for series in found.series:
        one = found.document["parameters"].get(series.name)
        if one is None:
            continue
        line, fit = None, found.lines.get(series.name)
        if fit is not None:
            t = np.linspace(_day(one["since"]), float(series.t[-1]), 60)
            level, u, _ = predict(fit, t)
            line = (t, level, scipy.stats.t.isf((1.0 - fit.confidence) / 2.0, fit.dof) * u)
        u_run = np.where(np.isfinite(series.u), series.u, 0.0)
        shift = series.offset.total_seconds() / SECONDS_PER_DAY
        figure = parameter_over_time(
            series.t + shift, series.values, 2.0 * u_run, unit=series.unit, title=headline(series.name, one),
            line=None if line is None else (line[0] + shift, line[1], line[2]), limit=one["limit"],
            changes=[_day(change["at"]) + shift for change in one["changes"]],
            events={at + shift: words for at, words in events.items()},
        )  # fmt: skip
        files += [str(save(figure, folder / f"trend-{series.name}{ending}")) for ending in ENDINGS]
    return files
