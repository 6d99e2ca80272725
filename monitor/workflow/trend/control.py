"""Control charts of a machine's parameters against a reference period: which alarm can be believed.

Points are the runs, or the means of the days where there are enough of them: runs of one day resemble each other,
and a chart that takes them for independent raises false alarms. Part of `monitor trend`.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics import (
    cusum_chart,
    ewma_chart,
    individuals_chart,
    mewma_chart,
    reference_period,
    t_squared_chart,
)
from monitor.workflow.trend.parameter import date

Document = dict[str, Any]

#: Average number of points to a false alarm of each chart: that of the three-sigma chart, rounded.
RUN_LENGTH = 370.0
#: Without a chosen reference period: the first points, a third of all, at least 8 and at most 30.
SHARE, FEWEST, MOST = 3, 8, 30


@dataclass(frozen=True)
class Points:
    """What the charts are of: ``values`` (m, p) NaN where a parameter has none, ``t`` (m,) days since 1970."""

    values: Array
    t: Array
    what: str
    offset: timedelta


def reference_rows(points: Points, chosen: tuple[float, float] | None) -> npt.NDArray[np.bool_]:
    """Which points (m,) are the reference period: those between two times, or the first ones."""
    if chosen is not None:
        return (points.t >= chosen[0]) & (points.t < chosen[1])
    count = int(np.clip(len(points.t) // SHARE, FEWEST, MOST))
    return np.asarray(np.arange(len(points.t)) < count)


class Charts:
    """All charts of a machine about one reference period."""

    def __init__(self, points: Points, chosen: tuple[float, float] | None) -> None:
        self.points = points
        self.inside = reference_rows(points, chosen)

    def period(self) -> Document:
        """The reference period in words and dates."""
        times = self.points.t[self.inside]
        return {
            "points": self.points.what,
            "reference_points": len(times),
            "reference_from": date(float(times[0]), self.points.offset) if len(times) else None,
            "reference_to": date(float(times[-1]), self.points.offset) if len(times) else None,
            "average_run_length": RUN_LENGTH,
        }

    def of(self, column: int) -> Document:
        """Shewhart, EWMA and CUSUM of one parameter: state, limits, and the alarms after the reference period."""
        own = np.isfinite(self.points.values[:, column])
        known = self.points.values[own & self.inside, column]
        new = own & ~self.inside
        values, t = self.points.values[new, column], self.points.t[new]
        if not len(known):
            return {"why": "no chart: no run of the history lies in the reference period"}
        try:
            reference = reference_period(known)
        except DataError as error:
            return {"why": f"no chart: {error}"}
        if not len(values):
            return {"why": f"no chart: all {len(known)} {self.points.what} are the reference period"}
        plain = individuals_chart(values, reference, arl=RUN_LENGTH)
        path = ewma_chart(values, reference, arl=RUN_LENGTH)
        sums = cusum_chart(values, reference, arl=RUN_LENGTH)
        return {
            "why": None, "centre": reference.centre, "sd": reference.sd,
            "shewhart": self._state(plain.alarms, t) | {
                "lower": float(plain.lower[-1]), "upper": float(plain.upper[-1])},
            "ewma": self._state(path.alarms, t) | {
                "value": float(path.statistic[-1]), "lower": float(path.lower[-1]), "upper": float(path.upper[-1]),
                "weight": 0.2},
            "cusum": self._state(sums.alarms, t) | {
                "high": float(sums.high[-1]), "low": float(sums.low[-1]), "limit": sums.limit,
                "since": None if sums.started is None else date(float(t[sums.started]), self.points.offset)},
        }  # fmt: skip

    def of_vector(self, names: tuple[str, ...], rng: np.random.Generator) -> Document:
        """T² and MEWMA of all parameters together; the shares say which of them raise the latest point."""
        whole = np.isfinite(self.points.values)
        kept = whole.mean(axis=0) > 0.9
        # What never varies in the reference period has no limits, and no part in the vector.
        known = np.where(whole & self.inside[:, np.newaxis], self.points.values, np.nan)
        kept &= np.nanmax(known, axis=0, initial=-np.inf) > np.nanmin(known, axis=0, initial=np.inf)
        rows = whole[:, kept].all(axis=1)
        used = [name for name, keep in zip(names, kept, strict=True) if keep]
        values = self.points.values[:, kept]
        known, new = values[rows & self.inside], values[rows & ~self.inside]
        if len(new) == 0 or len(known) < len(used) + 2:
            return {
                "why": f"no chart of the vector: {len(known)} {self.points.what} in the reference period and "
                f"{len(new)} after it for {len(used)} parameters; at least {len(used) + 2} and one are needed "
                "(--reference FROM..TO)"
            }  # fmt: skip
        t = self.points.t[rows & ~self.inside]
        try:
            single = t_squared_chart(new, known, arl=RUN_LENGTH)
            path = mewma_chart(new, known, rng=rng, arl=200.0, trials=1000)
        except DataError as error:
            return {"why": f"no chart of the vector: {error}"}
        return {
            "why": None, "parameters": used,
            "t_squared": self._state(single.alarms, t) | {
                "value": float(single.statistic[-1]), "limit": single.limit,
                "shares": dict(zip(used, map(float, single.shares[-1]), strict=True))},
            "mewma": self._state(path.alarms, t) | {
                "value": float(path.statistic[-1]), "limit": path.limit, "average_run_length": 200.0,
                "shares": dict(zip(used, map(float, path.shares[-1]), strict=True))},
        }  # fmt: skip

    def _state(self, alarms: npt.NDArray[np.int64], t: Array) -> Document:
        return {
            "state": "alarm" if len(alarms) and int(alarms[-1]) == len(t) - 1 else "in control",
            "alarms": len(alarms),
            "first_alarm_at": None if not len(alarms) else date(float(t[alarms[0]]), self.points.offset),
            "last_alarm_at": None if not len(alarms) else date(float(t[alarms[-1]]), self.points.offset),
        }
