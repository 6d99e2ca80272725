"""Since when are the parameters of a machine others? The one search behind `monitor trend` and the health report.

Both ask with their own probability of a false alarm; what is searched, and how it is weighed, is the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics import Change, History, find_changes

#: From so many days on, changes are sought in the means of the days, which hide no day component.
DAYS_FOR_MEANS = 15
#: Uncertainties that differ by less than this factor weigh runs alike (it costs less than 1 % of the precision).
ALIKE = 1.25
#: Trials of the simulated null distribution at least; more where the level asks for it.
TRIALS = 1999


class Recorded(Protocol):
    """One parameter in the order of time: ``values``, ``u`` and ``t`` (n,), and ``days`` (n,), labels of the days."""

    @property
    def name(self) -> str: ...

    @property
    def values(self) -> Array: ...

    @property
    def u(self) -> Array: ...

    @property
    def t(self) -> Array: ...

    @property
    def days(self) -> npt.NDArray[Any]: ...


def weights_of(series: Recorded) -> Array | None:
    """The uncertainties of the runs, None where a run has none (then all count alike)."""
    return series.u if bool(np.isfinite(series.u).all() and (series.u > 0.0).all()) else None


def day_means(series: Recorded) -> tuple[Array, Array, Array | None, Array]:
    """Times, means and relative uncertainties of the means by day, in order of time, and when each day's first run was.

    The uncertainties are in units of the first, None where the days weigh alike.
    """
    labels, first, index = np.unique(series.days, return_index=True, return_inverse=True)
    own = weights_of(series)
    weight = np.ones_like(series.values) if own is None else 1.0 / _relative(own) ** 2
    total = np.bincount(index, weight)
    order = np.argsort(first, kind="stable")
    # Of all runs alike: parameters that were measured together then share their times, and with them one search.
    t = np.bincount(index, series.t) / np.bincount(index)
    y = np.bincount(index, weight * series.values) / total
    u = 1.0 / np.sqrt(total)
    assert len(labels) == len(total)
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

    ``u`` are of the parameters whose runs weigh differently.
    """

    t: Array
    begins: Array
    days: npt.NDArray[Any] | None
    values: dict[str, Array]
    u: dict[str, Array]


def search_changes(
    every: Sequence[Recorded], events: Sequence[float], *, false_alarm: float, seed: int
) -> Mapping[str, tuple[History | None, str | None]]:
    """Steps, bends and transients of each parameter; or why none were sought.

    ``events`` are times of known changes, in the unit of ``t``. Parameters measured at the same times share one
    search, and those weighed alike the simulated null distribution. Which search a parameter is in does not change its
    share of ``false_alarm``, the probability of any finding where there is nothing to find. The ``at`` of a
    change is the start of its run, or of the first run of its day.
    """
    searches: dict[tuple[bytes, ...], _Plan] = {}
    for series in every:
        if len(np.unique(series.days)) >= DAYS_FOR_MEANS:
            t, y, u, begins = day_means(series)
            days = None
        else:
            t, y, begins, u = series.t, series.values, series.t, weights_of(series)
            u = _relative(u) if u is not None and u.max() > ALIKE * u.min() else None
            days = series.days
        key = tuple(b"" if one is None else one.tobytes() for one in (t, days))
        plan = searches.setdefault(key, _Plan(t, begins, days, {}, {}))
        plan.values[series.name] = y
        if u is not None:
            plan.u[series.name] = u
    found: dict[str, tuple[History | None, str | None]] = {}
    for plan in searches.values():
        t, values = plan.t, plan.values
        pieces = len({0, *np.searchsorted(t, np.asarray(events, dtype=np.float64)).tolist()} - {len(t)})
        try:
            history = find_changes(
                values, t, rng=np.random.default_rng([seed, len(t)]), events=sorted(events),
                u=plan.u, days=plan.days,
                false_alarm=false_alarm * len(values) / len(every),
                # Five times as many trials as the level of one parameter in one piece needs at least.
                trials=max(TRIALS, ceil(5 * len(every) * pieces / false_alarm)),
            )  # fmt: skip
        except DataError as error:
            found |= dict.fromkeys(values, (None, f"no search for changes: {error}"))
            continue
        for name in values:
            changes, trends = (
                tuple(_at_first_run(one, plan.begins) for one in part if one.parameter == name)
                for part in (history.changes, history.trends)
            )
            found[name] = (replace(history, changes=changes, trends=trends), None)
    return found


def _at_first_run(one: Change, begins: Array) -> Change:
    return replace(one, at=float(begins[one.index]))
