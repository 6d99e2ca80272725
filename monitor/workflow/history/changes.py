"""When did the parameters of a machine change? The one search that the trend page and the health report share.

The same runs give the same changes, with the same p-values, whoever asks: one probability of a false alarm, one seed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.statistics import FEWEST_RUNS, Change, History, find_changes
from monitor.statistics.days.latest_day import FEWEST_DAYS, latest_day
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.history.series import Series

#: Probability of any change where there is none, over all parameters and the whole history of a machine: a change that
#: is none splits the history, and of a hundred machines that nobody touched one shows such a change, not five
#: (docs/decisions.md; measured rates and the price in power: docs/trials-statistics.md).
FALSE_ALARM = 0.01
#: Seed of all that is simulated about a history (the null distributions of changes and of the warm-up, the limit of
#: MEWMA), so that an answer can be computed again; stored with the result.
SEED = 20260302
#: From so many days on, changes are sought in the means of the days, which hide no day component.
DAYS_FOR_MEANS = 15
#: Uncertainties that differ by less than this factor weigh runs alike (it costs less than 1 % of the precision).
ALIKE = 1.25
#: A latest day is a step where it lies at least so many times as far off as any day before it (measured rates and the
#: price in power: docs/trials-statistics.md).
FAR = 2.5
#: Trials of the simulated null distribution at least; more where the level asks for it.
TRIALS = 1999


@dataclass(frozen=True)
class ChangeSearch:
    """Changes and drifts that a search of one parameter found, in the order of time; or why none were sought.

    The last change may be a step before the latest day, whose permanence that day alone cannot show.
    ``least_p`` is the smallest p-value that its simulated histories can say, which are more where more parameters are
    searched: a change with that one may be less probable still.
    """

    changes: tuple[Change, ...] = ()
    drifts: tuple[Change, ...] = ()
    why_none: Lack | None = None
    least_p: float = 0.0


def day_means(series: Series) -> tuple[Array, Array, Array | None, Array]:
    """Times, means and relative uncertainties of the means by day, in order of time, and when each day's first run was.

    The uncertainties are in units of the first, None where the days weigh alike.
    """
    _, first, index = np.unique(series.days, return_index=True, return_inverse=True)
    weights = series.weights()
    weight = np.ones_like(series.values) if weights is None else 1.0 / _relative(weights) ** 2
    total = np.bincount(index, weight)
    order = np.argsort(first, kind="stable")
    # Of all runs alike: parameters that were measured together then share their times, and with them one search.
    t = np.bincount(index, series.t) / np.bincount(index)
    y = np.bincount(index, weight * series.values) / total
    u = 1.0 / np.sqrt(total)
    alike = u.max() <= ALIKE * u.min()
    return t[order], y[order], None if alike else _relative(u[order]), series.t[first[order]]


def _relative(u: Array) -> Array:
    """Uncertainties in units of the first, to 9 digits.

    Of the parameters that one plan determines they go together: their runs then weigh alike to the last bit, and one
    search is theirs.
    """
    return np.asarray(np.round(u / u[0], 9))


class _Plan(NamedTuple):
    """What is searched at once; ``days`` are None where the values are means of days.

    ``u`` are of the parameters whose runs weigh differently, ``groups`` of those that not one instrument measured.
    """

    t: Array
    begins: Array
    days: npt.NDArray[Any] | None
    values: dict[str, Array]
    u: dict[str, Array]
    groups: dict[str, npt.NDArray[np.intp]]


def _too_few(runs: int) -> Lack:
    return Lack(Part.CHANGES, Cause.FEW_RUNS, count=runs, needed=(FEWEST_RUNS,))


def search_changes(
    series: Sequence[Series], events: Sequence[float], *, false_alarm: float = FALSE_ALARM, seed: int = SEED
) -> Mapping[str, ChangeSearch]:
    """Steps, bends and transients of each parameter; or why none were sought.

    A latest day that stands out from the days since the last change or event is a step before it, at its own level of
    ``false_alarm`` over all parameters. ``events`` are times of known changes, in the unit of ``t``. Parameters
    measured at the same times share one search, and those weighed alike the simulated null distribution. Which search a
    parameter is in does not change its share of ``false_alarm``, the probability of any finding where there is nothing
    to find. The ``at`` of a change is the start of its run, or of the first run of its day.
    """
    results: dict[str, ChangeSearch] = {}
    for plan in _plans(series):
        t = plan.t
        pieces = len({0, *np.searchsorted(t, np.asarray(events, dtype=np.float64)).tolist()} - {len(t)})
        try:
            history = find_changes(
                plan.values, t, rng=np.random.default_rng([seed, len(t)]), events=sorted(events),
                u=plan.u, days=plan.days, cycle=DAYS_PER_YEAR, groups=plan.groups,
                false_alarm=false_alarm * len(plan.values) / len(series),
                # Five times as many trials as the level of one parameter in one piece needs at least.
                trials=max(TRIALS, ceil(5 * len(series) * pieces / false_alarm)),
            )  # fmt: skip
        except DataError as error:
            why = refused(Part.CHANGES, error) if len(t) >= FEWEST_RUNS else _too_few(len(t))
            results |= dict.fromkeys(plan.values, ChangeSearch(why_none=why))
            continue
        results |= {name: _of_parameter(history, name, plan.begins) for name in plan.values}
    level = false_alarm / max(len(series), 1)
    return {each.name: _with_latest_day(each, results[each.name], events, level) for each in series}


def _plans(series: Sequence[Series]) -> list[_Plan]:
    """The parameters by what they share: times and days."""
    plans: dict[tuple[bytes, ...], _Plan] = {}
    for parameter in series:
        days: npt.NDArray[Any] | None
        if parameter.day_count >= DAYS_FOR_MEANS:
            t, y, u, begins = day_means(parameter)
            days = None
        else:
            t, y, begins, u = parameter.t, parameter.values, parameter.t, parameter.weights()
            u = _relative(u) if u is not None and u.max() > ALIKE * u.min() else None
            days = parameter.days
        key = (t.tobytes(), b"" if days is None else days.tobytes())
        plan = plans.setdefault(key, _Plan(t, begins, days, {}, {}, {}))
        plan.values[parameter.name] = y
        if u is not None:
            plan.u[parameter.name] = u
        if parameter.has_several_instruments:
            # A day is one of a campaign, and so of what measured in it.
            first = np.sort(np.unique(parameter.days, return_index=True)[1])
            plan.groups[parameter.name] = parameter.measured[first] if days is None else parameter.measured
    return list(plans.values())


def _of_parameter(history: History, name: str, begins: Array) -> ChangeSearch:
    changes, drifts = (
        tuple(replace(change, at=float(begins[change.index])) for change in part if change.parameter == name)
        for part in (history.changes, history.trends)
    )
    return ChangeSearch(changes, drifts, least_p=1.0 / (history.trials + 1))


def _with_latest_day(
    series: Series, search: ChangeSearch, events: Sequence[float], level: float
) -> ChangeSearch:
    """The search with the step before the latest day, where that stands out from the days since the last change or
    event; as it is while a transient settles.

    A step of the latest day that the search put one day early, as it takes no nearer one, is put in its place.
    """
    if search.why_none is not None or any(drift.kind == "transient" for drift in search.drifts):
        return search
    earlier = search.changes
    if earlier and series.days_since(earlier[-1].at) == 2:
        earlier = earlier[:-1]
    ends = [*(at for at in events if at <= series.t[-1]), *(change.at for change in earlier)]
    step = _latest_step(series.part(series.t >= max(ends, default=-np.inf)), level)
    if step is None:
        return search
    return replace(search, changes=(*earlier, replace(step, index=int(np.searchsorted(series.t, step.at)))))


def _latest_step(piece: Series, level: float) -> Change | None:
    """The step before the latest day of a piece of history; None where that does not stand out."""
    if piece.day_count < FEWEST_DAYS:
        return None
    last = piece.of_last_day
    latest, before = piece.part(last), piece.part(~last)
    alike = before.part(np.isin(before.measured, latest.measured))
    if alike.day_count >= FEWEST_DAYS - 1:
        before = alike
    (t, y, _, _), (t_last, y_last, _, begins) = day_means(before), day_means(latest)
    stands_out = latest_day(
        np.append(t, t_last.mean()), np.append(y, y_last.mean()), _more_than_before(latest, before)
    )
    if stands_out is None or not stands_out.p_value < level or stands_out.times_others < FAR:
        return None
    at = float(begins.min())
    between = (float(piece.t[~last].max(initial=-np.inf)), at)
    return Change(piece.name, "step", 0, at, between, stands_out.size, stands_out.u, stands_out.p_value)


def _more_than_before(latest: Series, before: Series) -> float:
    """The variance that the mean of the latest day has beyond that of a day before it: of fewer runs, by their scatter
    within days, or of runs that are known worse, by their stated uncertainty."""
    index = np.unique(before.days, return_inverse=True)[1]
    runs = np.bincount(index)
    within = before.values - (np.bincount(index, before.values) / runs)[index]
    freedom = len(index) - len(runs)
    fewer = 1.0 / len(latest.t) - len(runs) / len(index)
    by_scatter = float(within @ within) / freedom * fewer if freedom else 0.0
    u_latest, u_before = latest.weights(), before.weights()
    if u_latest is None or u_before is None:
        return max(by_scatter, 0.0)
    of_day = np.bincount(index, u_before**2) / runs**2
    by_stated = float((u_latest**2).mean()) / len(latest.t) - float(np.median(of_day))
    return max(by_scatter, by_stated, 0.0)
