"""The warm-up of each day that a campaign began cold or hot: a part of `monitor trend`.

Hours count from the first run of a day, and every day has a level of its own: what differs from day to day is no
warm-up. Steps and bends that were found are fitted beside it. Of several days, what goes on from one day to the next
where it left off is a drift, by time or by run: only what begins anew every day is stated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.statistics import Change, warm_up
from monitor.statistics.mixed import fit_with_days
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import WarmUp
from monitor.workflow.trend.causes import FEWEST_RUNS
from monitor.workflow.trend.parameter import number


def warming(
    series: Series, campaigns: npt.NDArray[np.str_], changes: Sequence[Change], rng: np.random.Generator
) -> tuple[WarmUp | None, Lack | None]:
    """Return the warm-up of the latest campaign with runs marked so: time constant and when the machine is stable.

    ``campaigns`` (n,) are those of the runs of the series, ``changes`` what the search of the parameter found. Days
    without a run that was marked do not take part: nobody says that their first run is a cold one.
    """
    for name in dict.fromkeys(campaigns[series.warm_up][::-1].tolist()):
        of_campaign = campaigns == name
        cold = of_campaign & np.isin(series.days, series.days[of_campaign & series.warm_up])
        if cold.sum() >= FEWEST_RUNS:
            try:
                return _of_days(series.part(cold), name, changes, rng)
            except DataError as error:
                return None, refused(Part.WARM_UP, error)
    return None, Lack(Part.WARM_UP, Cause.NO_WARM_UP_RUNS)


def _of_days(
    part: Series, campaign: str, changes: Sequence[Change], rng: np.random.Generator
) -> tuple[WarmUp | None, Lack | None]:
    """The warm-up of the runs of one campaign's cold days."""
    day = np.unique(part.days, return_inverse=True)[1]
    first = np.full(day.max() + 1, np.inf)
    np.minimum.at(first, day, part.t)
    hours = (part.t - first[day]) * 24.0
    levels = (day[:, np.newaxis] == np.arange(1, day.max() + 1)).astype(np.float64)
    stepped = _change_columns(part.t, changes)
    beside = np.column_stack([levels, stepped])
    fit = warm_up(part.values, hours, u=part.weights(), rng=rng, beside=beside if beside.shape[1] else None)
    recorded = float(hours.max())
    if not fit.settles:
        return None, Lack(Part.WARM_UP, Cause.DOES_NOT_SETTLE, needed=(float(f"{recorded:.2g}"),))
    p_value = max(fit.p_value, *_beside_drifts(part, day, stepped, np.exp(-hours / fit.tau)))
    tau, stable = fit.tau_interval, fit.stable_interval
    # Where a line does as well, what the curve comes to beyond the hours recorded is nobody's measurement.
    is_seen = fit.tau_is_known or fit.stable_after <= recorded
    return WarmUp(
        campaign=campaign, amplitude=fit.amplitude * fit.share_seen, u=fit.u_amplitude * fit.share_seen,
        unit=part.unit, recorded_h=recorded,
        tau_h=fit.tau if fit.tau_is_known else None, tau_interval_h=(number(tau[0]), number(tau[1])),
        stable_after_h=number(fit.stable_after) if is_seen else None,
        stable_interval_h=(number(stable[0]), number(stable[1])),
        stable_within=fit.tolerance, p_value=p_value,
    ), None  # fmt: skip


def _change_columns(t: Array, changes: Sequence[Change]) -> Array:
    """Columns (n, e) of the steps and bends within the runs at ``t`` (n,)."""
    inside = [change for change in changes if t.min() < change.at <= t.max()]
    columns = [
        np.where(t >= change.at, 1.0 if change.kind == "step" else t - change.at, 0.0) for change in inside
    ]
    varying = [column for column in columns if np.ptp(column) > 0.0]
    return np.column_stack(varying) if varying else np.empty((len(t), 0))


def _beside_drifts(
    part: Series, day: npt.NDArray[np.intp], stepped: Array, shape: Array
) -> tuple[float, ...]:
    """Probabilities that there is no warm-up beside a drift by time, and beside one by run; 0 for a single day.

    Both are asked alone: together they are a line within the day. Where days differ at random, that counts, too.
    """
    if day.max() == 0:
        return (0.0,)
    n = len(part.t)
    drifts = (part.t - part.t.mean(), np.argsort(np.argsort(part.t, kind="stable")) - 0.5 * (n - 1))
    return tuple(
        float(fit_with_days(part.values, design, part.weights(), day).p_value[-1])
        for design in (np.column_stack([np.ones(n), drift, stepped, shape]) for drift in drifts)
    )
