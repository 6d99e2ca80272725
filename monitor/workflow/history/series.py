"""The history of a machine as series of its parameters, in the order of time: parts of `monitor trend`."""

from __future__ import annotations

from datetime import timedelta

import numpy as np
import numpy.typing as npt

from monitor.statistics import History
from monitor.store import MachineHistory
from monitor.workflow.history.change_search import DAYS_FOR_MEANS
from monitor.workflow.trend.control import Points
from monitor.workflow.trend.parameter import Series

SECONDS_PER_DAY = 86400.0


def _days(history: MachineHistory) -> npt.NDArray[np.int64]:
    """Number (n,) of each run's day of its campaign, from 0 in the order of time."""
    numbers: dict[tuple[str, int], int] = {}
    pairs = zip(history.campaign.tolist(), history.day.tolist(), strict=True)
    return np.array([numbers.setdefault(pair, len(numbers)) for pair in pairs], dtype=np.int64)


def all_series(history: MachineHistory) -> list[tuple[Series, npt.NDArray[np.bool_]]]:
    """Each parameter with the runs that have it."""
    t = history.seconds / SECONDS_PER_DAY
    days = _days(history)
    hour = np.array([at.hour + at.minute / 60.0 for at in history.started_at])
    offset = (history.started_at[-1].utcoffset() if history.started_at else None) or timedelta()
    found = []
    for j, (name, unit) in enumerate(zip(history.parameters, history.units, strict=True)):
        own = np.isfinite(history.values[:, j])
        whole = Series(name, unit, history.values[:, j], history.u[:, j], t, days, hour, offset)
        found.append((whole.part(own), own))
    return found


def piece_begins(series: Series, found: History | None, events: list[float]) -> float:
    """When the present piece of history began: at the last event or change."""
    moments = [at for at in events if at <= series.t[-1]]
    moments += [one.at for one in found.changes] if found is not None else []
    return max(moments, default=-np.inf)


def steady_runs(series: Series, warm: npt.NDArray[np.bool_]) -> Series:
    """The runs that are not marked warm_up, where six or more are not: a warming machine is another matter."""
    return series.part(~warm) if (~warm).sum() >= 6 else series


def points_of(history: MachineHistory, series: list[tuple[Series, npt.NDArray[np.bool_]]]) -> Points:
    """Points of the charts: runs, or day means where there are enough days; runs of a warming machine left out."""
    t = history.seconds / SECONDS_PER_DAY
    offset = series[0][0].offset
    keep = ~history.warm_up if (~history.warm_up).sum() >= 6 else np.ones(len(t), dtype=np.bool_)
    labels = _days(history)[keep]
    distinct, first, index = np.unique(labels, return_index=True, return_inverse=True)
    if len(distinct) < DAYS_FOR_MEANS:
        return Points(history.values[keep], t[keep], "runs", offset)
    values = history.values[keep]
    here = np.isfinite(values)
    sums, counts = np.zeros((len(distinct), values.shape[1])), np.zeros((len(distinct), values.shape[1]))
    np.add.at(sums, index, np.where(here, values, 0.0))
    np.add.at(counts, index, here)
    means = sums / np.where(counts > 0, counts, np.nan)
    order = np.argsort(first, kind="stable")
    moments = np.bincount(index, t[keep]) / np.bincount(index)
    return Points(means[order], moments[order], "days", offset)
