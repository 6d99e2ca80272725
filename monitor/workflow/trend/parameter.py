"""What the history of one parameter says: drift, dependence, cycles, warm-up. Parts of `monitor trend`.

Where the runs do not suffice for a part, it is a sentence under ``why`` and its numbers are null.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics import (
    Trend,
    control_false_discoveries,
    dependence,
    trend,
    warm_up,
)
from monitor.units import DEGREE_CELSIUS, ONE, Unit, column_unit
from monitor.workflow.history.change_search import weights_of

Document = dict[str, Any]

#: Days of a Julian year, by which slopes are stated.
DAYS_PER_YEAR = 365.25
#: A slope a year is stated from so many days of history on. Over fewer, the scatter of a few days, multiplied by
#: fifty and more, is no statement about a year; and where days differ much among themselves the weighted slope
#: rests on the hours within the days, which a machine that warms up every morning fills with something else.
SHORTEST_DAYS = 30.0
#: A cycle is fitted where its phases are seen: runs over half a day, and over the better part of a year.
DAY_COVERAGE_H, YEAR_COVERAGE_D = 12.0, 300.0
#: Channels that go together more closely than this cannot be told apart (their variances inflate tenfold).
COLLINEAR = 0.95


@dataclass(frozen=True)
class Series:
    """One parameter of one machine in the order of time: ``values`` and ``u`` (n,) in ``unit``, ``t`` (n,) in days
    since 1970 (UTC), ``days`` numbers of the machine's days (n,), ``hour`` of the shop's clock (n,)."""

    name: str
    unit: str
    values: Array
    u: Array
    t: Array
    days: npt.NDArray[np.int64]
    hour: Array
    offset: timedelta

    def part(self, chosen: npt.NDArray[np.bool_]) -> Series:
        """The chosen runs."""
        if chosen.all():
            return self
        return Series(
            self.name, self.unit, self.values[chosen], self.u[chosen], self.t[chosen], self.days[chosen],
            self.hour[chosen], self.offset,
        )  # fmt: skip

    @cached_property
    def day_count(self) -> int:
        """Number of different days; their numbers mostly come in order."""
        rises = np.diff(self.days)
        return (
            len(np.unique(self.days))
            if (rises < 0).any() or not len(self.days)
            else 1 + int((rises > 0).sum())
        )

    def weights(self) -> Array | None:
        """The uncertainties of the runs, None where a run has none (then all count alike)."""
        return weights_of(self)


def date(t: float, offset: timedelta) -> str | None:
    """A time in days since 1970 as ISO 8601 by the shop's clock; None where it is beyond any calendar."""
    if not np.isfinite(t):
        return None
    try:
        moment = datetime(1970, 1, 1) + timedelta(days=float(t)) + offset
    except OverflowError:
        return None
    sign = "-" if offset < timedelta() else "+"
    minutes = abs(int(offset.total_seconds())) // 60
    return f"{moment.isoformat(timespec='seconds')}{sign}{minutes // 60:02d}:{minutes % 60:02d}"


def number(value: float | None) -> float | None:
    """A finite number or None."""
    return None if value is None or not np.isfinite(value) else float(value)


def too_short(span: float, split: bool) -> str:
    """The sentence for a history of ``span`` days; ``split`` where it begins at a change or an event."""
    count = max(round(span), 1)
    since = " since the last change or event" if split else ""
    return (
        f"{count} day{'s' if count > 1 else ''} of history{since} {'are' if count > 1 else 'is'} too short for a "
        f"slope a year; at least {SHORTEST_DAYS:g} are needed"
    )


def drift(series: Series, since: float) -> tuple[Document, Trend | None]:
    """Slope of the piece since ``since`` (days since 1970), per year; none where the piece is too short for that."""
    piece = series.part(series.t >= since)
    span = float(np.ptp(piece.t)) if len(piece.t) else 0.0
    empty: Document = {
        "slope_per_year": None, "u_slope": None, "slope_interval": None, "p_value": None, "robust_slope_per_year": None,
        "robust_interval": None, "monotone_p": None, "autocorrelation": None, "between_days": None, "within_days": None,
        "since": None if not len(piece.t) else date(float(piece.t[0]), series.offset),
        "n": len(piece.t), "days": piece.day_count, "span_days": span, "why": None,
    }  # fmt: skip
    if span < SHORTEST_DAYS:
        return {**empty, "why": too_short(span, bool(np.isfinite(since)))}, None
    if np.ptp(piece.values) == 0.0:
        return {**empty, "why": f"no drift of {series.name}: it has the same value in every run"}, None
    try:
        line = trend(piece.values, piece.t, u=piece.weights(), days=piece.days)
    except DataError as error:
        return {**empty, "why": f"no drift: {error}"}, None
    year = DAYS_PER_YEAR
    return {
        **empty,
        "slope_per_year": line.slope * year,
        "u_slope": line.u_slope * year,
        "slope_interval": [x * year for x in line.slope_interval],
        "p_value": number(line.p_value),
        "robust_slope_per_year": line.robust_slope * year,
        "robust_interval": None if line.robust_interval is None else [x * year for x in line.robust_interval],
        "monotone_p": None if line.monotone is None else line.monotone.p_value,
        "autocorrelation": None if line.monotone is None else line.monotone.autocorrelation,
        "between_days": line.between,
        "within_days": number(float(np.sqrt(max(line.run_sd**2 - line.between**2, 0.0)))),
    }, line


def conditions(
    series: Series, channels: Mapping[str, Array], since: float
) -> tuple[list[Document], str | None]:
    """Coefficients of the conditions, one at a time beside the drift; or why there are none.

    One at a time because the channels of one campaign move together: a joint fit of four thermometers would
    tell nothing of any of them. ``moves_with`` names those that cannot be told apart.
    """
    piece = series.t >= since
    unit = Unit(series.unit, 1.0)
    found: list[Document] = []
    for name, recorded in channels.items():
        chosen = piece & np.isfinite(recorded)
        if chosen.sum() < 6 or np.ptp(recorded[chosen]) == 0.0:
            continue
        own, values = series.part(chosen), recorded[chosen]
        channel = column_unit(name) or ONE
        days = own.day_count
        try:
            fit = dependence(
                own.values, own.t, {name: values}, drift=days >= 3, u=own.weights(), days=own.days, unit=unit,
                channel_units={name: channel},
            )  # fmt: skip
        except DataError:
            continue
        one = fit.coefficients[0]
        per = "K" if channel == DEGREE_CELSIUS else channel.name
        found.append(
            {
                "channel": name, "coefficient": one.value, "u": one.u, "interval": list(one.interval),
                "unit": f"{series.unit}/{per}", "p_value": number(one.p_value), "n": int(chosen.sum()),
                "from": float(values.min()), "to": float(values.max()),
                "moves_with": [other for other, more in channels.items() if other != name and _together(
                    values, more[chosen])] + (["time"] if days >= 3 and _together(values, own.t) else []),
            }
        )  # fmt: skip
    if not found:
        return [], "no dependence: no recorded condition varies over six runs or more"
    q = control_false_discoveries(
        [np.nan if one["p_value"] is None else one["p_value"] for one in found]
    ).q_value
    for entry, rate in zip(found, q, strict=True):
        entry["q_value"] = number(float(rate))
    return sorted(found, key=lambda one: 2.0 if one["p_value"] is None else one["p_value"]), None


def _together(a: Array, b: Array) -> bool:
    if not np.isfinite(b).all() or np.ptp(b) == 0.0:
        return False
    return bool(abs(np.corrcoef(a, b)[0, 1]) > COLLINEAR)


def cycles(series: Series, since: float) -> tuple[list[Document], str | None]:
    """The cycles of day and year, where the record is long enough to see them beside the drift."""
    piece = series.part(series.t >= since)
    wanted = {}
    if len(piece.t) and np.ptp(piece.hour) >= DAY_COVERAGE_H and len(piece.t) >= 8:
        wanted["day"] = 1.0
    if len(piece.t) >= 12 and np.ptp(piece.t) >= YEAR_COVERAGE_D:
        wanted["year"] = DAYS_PER_YEAR
    if not wanted:
        return [], (
            f"no cycles: a daily one needs runs over {DAY_COVERAGE_H:g} hours of the clock, a yearly one "
            f"{YEAR_COVERAGE_D:g} days of history"
        )
    try:
        days = piece.day_count
        fit = dependence(
            piece.values, piece.t, {}, cycles=wanted, drift=days >= 3, u=piece.weights(), days=piece.days
        )
    except DataError as error:
        return [], f"no cycles: {error}"
    return [
        {
            "cycle": one.name, "period_days": one.period, "amplitude": one.amplitude, "u": one.u, "unit": series.unit,
            "peak_at": date(one.peak_at, series.offset), "p_value": number(one.p_value),
        }
        for one in fit.cycles
    ], None  # fmt: skip


def warming(
    series: Series, warm: npt.NDArray[np.bool_], rng: np.random.Generator, campaigns: npt.NDArray[np.str_]
) -> tuple[Document | None, str | None]:
    """Warm-up of the latest campaign that was begun cold or hot: time constant and when the machine is stable."""
    # A campaign with runs while warming up has seen the whole of it; its other runs say where it ends.
    for name in dict.fromkeys(campaigns[warm][::-1].tolist()):
        inside = campaigns == name
        if inside.sum() >= 6:
            own = series.part(inside)
            hours = (own.t - own.t[0]) * 24.0
            try:
                found = warm_up(own.values, hours, u=own.weights(), rng=rng)
            except DataError as error:
                return None, f"no warm-up: {error}"
            return {
                "campaign": name, "amplitude": found.amplitude, "u": found.u_amplitude, "unit": series.unit,
                "tau_h": found.tau, "tau_interval_h": [number(x) for x in found.tau_interval],
                "stable_after_h": number(found.stable_after),
                "stable_interval_h": [number(x) for x in found.stable_interval],
                "stable_within": found.tolerance, "p_value": found.p_value,
            }, None  # fmt: skip
    return None, "no warm-up: no campaign of six runs or more has runs marked warm_up"
