"""Every parameter of a machine over its past runs: since when it is another, how it drifts, how long it stays good."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError, InputError
from monitor.records import Array
from monitor.statistics import Change as Found
from monitor.statistics import forecast, trend
from monitor.store import Database, StoredModel
from monitor.workflow.history.change_search import search_changes
from monitor.workflow.history.health_history import Event, PastRun

DAY = 86400.0
#: Probability of any change where there is none, over all parameters and the whole history of a machine.
FALSE_ALARM = 0.01
#: Fewer runs than this between two events are not searched (``find_changes``).
FEWEST_RUNS = 6
#: Seed of the simulated null distributions of the search, so that a report can be made again.
SEED = 20260310
DAYS_A_YEAR = 365.25


@dataclass(frozen=True, eq=False)
class Series:
    """A parameter over the runs: times, days since the first run (n,), values and standard uncertainties (n,)."""

    name: str
    unit: str
    times: tuple[datetime, ...]
    t: Array
    values: Array
    u: Array
    warm_up: Array

    @property
    def days(self) -> npt.NDArray[np.str_]:
        """The calendar days of the runs (n,), by the shop's clock."""
        return np.array([f"{at:%Y-%m-%d}" for at in self.times], dtype=np.str_)

    def part(self, chosen: npt.NDArray[np.bool_]) -> Series:
        """The chosen runs."""
        times = tuple(at for at, kept in zip(self.times, chosen, strict=True) if kept)
        return Series(
            self.name, self.unit, times, self.t[chosen], self.values[chosen], self.u[chosen], self.warm_up[chosen]
        )  # fmt: skip


@dataclass(frozen=True)
class DriftFound:
    """A drift a year since the last change, its 95 % interval, and how many days a run stays in tolerance with 95 %."""

    slope: float
    u_slope: float
    between: tuple[float, float]
    p_value: float
    crosses: float | None
    crosses_between: tuple[float, float]
    good_for: float | None
    horizon: float


def series_of(db: Database, machine: str, model: StoredModel, runs: list[PastRun]) -> dict[str, Series]:
    """Every parameter that the runs have a number of, under one version of a model."""
    at = {(one.campaign, one.run): one for one in runs}
    rows = db.rows(
        "SELECT campaign, run, parameter, value, u, unit FROM v_parameters "
        "WHERE machine = ? AND model = ? AND model_version = ? AND value IS NOT NULL "
        "ORDER BY started_at, campaign, run",
        [machine, model.name, model.version],
    )
    found: dict[str, list[tuple[PastRun, float, float, str]]] = {}
    for campaign, run, parameter, value, u, unit in rows:
        if (campaign, run) in at and np.isfinite(value):
            found.setdefault(parameter, []).append((at[campaign, run], value, u, unit))
    origin = runs[0].at if runs else None
    return {
        name: Series(
            name,
            points[-1][3],
            tuple(one.at for one, *_ in points),
            np.array([(one.at - origin).total_seconds() / DAY for one, *_ in points]),
            np.array([value for _, value, _, _ in points]),
            np.array([u for _, _, u, _ in points]),
            np.array([one.warm_up for one, *_ in points], dtype=np.float64),
        )
        for name, points in found.items()
        if origin is not None
    }


def changes_of(series: dict[str, Series], events: list[Event], origin: datetime) -> dict[str, list[Found]]:
    """Changes of every parameter, runs that were warming up left out; the false-alarm probability is shared.

    Times of a change (``at``, ``interval``) are in days since ``origin``; its index is not that of the series.
    """
    steady = [one.part(one.warm_up == 0) for one in series.values()]
    searched = search_changes(
        [one for one in steady if len(one.t) >= FEWEST_RUNS],
        [(event.at - origin).total_seconds() / DAY for event in events],
        false_alarm=FALSE_ALARM,
        seed=SEED,
    )
    return {name: list(found.changes) for name, (found, _) in searched.items() if found and found.changes}


def drift_of(one: Series, since: float, now: float, tolerance: float | None) -> DriftFound | None:
    """The drift of a parameter since its last change (days since the first run); None with fewer than three days.

    Nothing is said of times further ahead than the history is long.
    """
    kept = (one.warm_up == 0) & (one.t >= since)
    days = np.array([at.toordinal() for at in one.times])[kept]
    if len(set(days.tolist())) < 3:
        return None
    try:
        line = trend(one.values[kept], one.t[kept], u=one.u[kept], days=days)
        span = float(np.ptp(one.t[kept]))
        low, high = line.slope_interval
        between = (low * DAYS_A_YEAR, high * DAYS_A_YEAR)
        head = (line.slope * DAYS_A_YEAR, line.u_slope * DAYS_A_YEAR, between, line.p_value)
        if tolerance is None:
            return DriftFound(*head, None, (np.inf, np.inf), None, span)
        ahead = forecast(line, (-tolerance, tolerance), now, [], horizon=now + span)
    except (DataError, InputError):
        return None
    good_for = float(min(ahead.recommended_interval, span))
    return DriftFound(*head, ahead.crossing.at, ahead.crossing.interval, good_for, span)


def moment(origin: datetime, days: float) -> datetime | None:
    """A time given in days since the first run; None where it is infinite."""
    return origin + timedelta(days=days) if np.isfinite(days) else None
