"""What the history of one parameter says: drift, latest mean, calibrations, changes. Parts of `monitor trend`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from monitor.statistics import Change
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.history.calendar import date
from monitor.workflow.history.drift import SHORTEST_DAYS, PieceDrift
from monitor.workflow.history.in_common import RestsOn, rests_on
from monitor.workflow.history.series import Series
from monitor.workflow.history.what_measured import COUNTS
from monitor.workflow.trend.answer import (
    DatedChange,
    DayResemblance,
    DriftStatement,
    LatestMean,
)


def number(value: float | None) -> float | None:
    """A finite number or None."""
    return None if value is None or not np.isfinite(value) else float(value)


def drift_statement(drift: PieceDrift) -> DriftStatement:
    """The slope of the present piece of history a year; none where the piece is too short for that."""
    piece = drift.piece
    statement = DriftStatement(
        since=None if not len(piece.t) else date(float(piece.t[0]), piece.offset),
        n=len(piece.t),
        days=piece.day_count,
        span_days=drift.span,
        why=drift.why_not_stated,
    )
    line, year = drift.stated, DAYS_PER_YEAR
    if line is None:
        return statement
    robust, resemblance = line.robust_interval, line.resemblance
    return replace(
        statement,
        slope_per_year=line.slope * year,
        u_slope=line.u_slope * year,
        slope_interval=(line.slope_interval[0] * year, line.slope_interval[1] * year),
        p_value=number(line.p_value),
        robust_slope_per_year=line.robust_slope * year,
        robust_interval=None if robust is None else (robust[0] * year, robust[1] * year),
        monotone_p=None if line.monotone is None else line.monotone.p_value,
        autocorrelation=None if line.monotone is None else line.monotone.autocorrelation,
        between_days=line.between,
        within_days=number(float(np.sqrt(max(line.run_sd**2 - line.between**2, 0.0)))),
        resemblance=DayResemblance(
            resemblance.correlation, resemblance.allowed, resemblance.widening, resemblance.blocks
        ),
        season=drift.season,
        season_p=line.season_p,
        verdict=drift.verdict,
        temperature=drift.thermometer,
    )


#: Below this probability the runs of the last day scatter more than those of the other days by more than chance.
_CHANCE = 0.01


def latest_mean(drift: PieceDrift) -> LatestMean:
    """The mean of the last day's steady runs since the last event, with standard uncertainty and degrees of freedom.

    A day of another campaign that overlaps it is part of it, as in the table of all machines. Of several runs u is
    the scatter of runs within days by their number, and what it has of the calibrations that they rest on; of a single
    run it is the stated one, None where there is none.
    """
    steady, last = drift.whole, drift.of_latest_day
    count = int(last.sum())
    u, dof = float(steady.u[last][0]), None
    if count > 1:
        scatter, freedom = _scatter(steady, last)
        of_mean = scatter / np.sqrt(count)
        u = float(np.hypot(of_mean, np.linalg.norm(steady.part(last).common_of_mean)))
        # JCGM 100:2008, G.4.1: what the calibrations add has no end of degrees of freedom here.
        dof = freedom * (u / of_mean) ** 4 if of_mean > 0.0 else None
    return LatestMean(
        float(steady.values[last].mean()),
        number(u),
        count,
        date(float(steady.t[-1]), steady.offset),
        number(dof),
    )


def _scatter(steady: Series, last: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """Standard deviation of the runs of a day, and its degrees of freedom.

    Pooled over the days that the instruments of the last one measured (JCGM 100:2008, 4.2.4), because two runs know it
    with one degree of freedom; that of the last day alone where its runs scatter more by more than chance.
    """
    variance = float(steady.values[last].var(ddof=1))
    own_freedom = int(last.sum()) - 1
    others = ~last & np.isin(steady.measured, steady.measured[last])
    _, day = np.unique(steady.days[others], return_inverse=True)
    runs = np.bincount(day)
    dof = int((runs - 1).sum())
    if dof == 0:
        return float(np.sqrt(variance)), own_freedom
    values = steady.values[others]
    pooled = float(((values - (np.bincount(day, values) / runs)[day]) ** 2).sum())
    if scipy.special.fdtrc(own_freedom, dof, variance * dof / pooled if pooled > 0.0 else np.inf) < _CHANCE:
        return float(np.sqrt(variance)), own_freedom
    return float(np.sqrt((variance * own_freedom + pooled) / (own_freedom + dof))), own_freedom + dof


def calibrations(drift: PieceDrift) -> tuple[RestsOn, ...]:
    """What the runs of the present piece have of calibrated quantities, as far as it counts in the u of a run; of each
    what the latest mean, the line at the last run and the slope are off by for one standard uncertainty."""
    piece, latest = drift.piece, drift.whole.part(drift.of_latest_day)
    of_mean = dict(zip(latest.common_parts, np.abs(latest.common_of_mean), strict=True))
    line, year = drift.line, DAYS_PER_YEAR
    stated = []
    for row, (quantity, part) in enumerate(piece.common_parts.items()):
        rests = part != 0.0
        if not (np.abs(part) > COUNTS * piece.u).any():
            continue
        of_line = of_slope = None
        if line is not None:
            level, slope = line.common[row]
            of_line = float(abs(level + slope * (piece.t[-1] - line.at)))
            of_slope = float(abs(slope) * year) if drift.stated is not None else None
        bounded = piece.bounded is not None and bool(piece.bounded[rests].any())
        stated.append(
            replace(
                rests_on(quantity), u=float(of_mean[quantity]), runs=int(rests.sum()), of_runs=len(rests),
                u_line=of_line, u_slope_per_year=of_slope, at_most=bounded or None,
            )
        )  # fmt: skip
    return tuple(stated)


def dated_change(
    change: Change, series: Series, least_p: float = 0.0, *, is_of_latest_day: bool = False
) -> DatedChange:
    """A change with its dates; a slope of a short history is stated a day, as ``SHORTEST_DAYS`` says why.

    ``least_p`` is the smallest p-value that the search can say; that of a line may be any. ``is_of_latest_day``: one
    day alone follows it.
    """
    slope = change.kind in ("slope", "trend")
    period, days = ("day", 1.0) if np.ptp(series.t) < SHORTEST_DAYS else ("year", DAYS_PER_YEAR)
    return DatedChange(
        at=date(change.at, series.offset),
        interval=(date(change.interval[0], series.offset), date(change.interval[1], series.offset)),
        kind=change.kind,
        size=change.size * (days if slope else 1.0),
        u=change.u * (days if slope else 1.0),
        unit=f"{series.unit}/{period}" if slope else series.unit,
        p_value=change.p_value,
        days=series.steady.day_count,
        time_constant_days=change.time_constant,
        p_at_most=True if np.isclose(change.p_value, least_p, rtol=1e-9, atol=0.0) else None,
        one_day=is_of_latest_day or None,
    )
