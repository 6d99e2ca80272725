"""The long view of one machine: drift, changes, dependence, cycles, warm-up, alarms, forecast of each parameter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError, InputError, NotFoundError
from monitor.statistics import Change, History, Trend, control_false_discoveries
from monitor.store import (
    NOTE,
    Database,
    MachineHistory,
    machine_events,
    machine_history,
    save_analysis,
)
from monitor.workflow.history.agreement import Moment, agreement
from monitor.workflow.history.campaigns import chosen_only, same_hours
from monitor.workflow.history.change_search import search_changes
from monitor.workflow.history.series import SECONDS_PER_DAY, all_series, piece_begins, points_of, steady_runs
from monitor.workflow.trend.control import Charts
from monitor.workflow.trend.forecast import backtested, prediction
from monitor.workflow.trend.parameter import (
    DAYS_PER_YEAR,
    SHORTEST_DAYS,
    Series,
    conditions,
    cycles,
    date,
    drift,
    number,
    warming,
)
from monitor.workflow.trend.volumetric import Followed, volumetric_forecast

Document = dict[str, Any]

# Seeds what is simulated: the null distributions of changes and warm-up, the limit of MEWMA; stored with the result.
SEED = 20260302
#: The next check where none is named: as far away as the campaigns lie apart (median), or this many days.
NEXT_CHECK_D = 30.0
FALSE_ALARM = 0.05


@dataclass(frozen=True)
class Choice:
    """What the user asked for; times in days since 1970, None where not named."""

    parameter: str | None = None
    since: datetime | None = None
    next_check: datetime | None = None
    reference: tuple[datetime, datetime] | None = None
    reliability: float = 0.95
    campaigns: tuple[str, ...] = ()
    model: str | None = None
    volumetric_limit_um: float | None = None


@dataclass(frozen=True)
class Trends:
    """The document, and what it was computed from (for the figures)."""

    document: Document
    series: tuple[Series, ...]
    lines: Mapping[str, Trend | None]


def _days(moment: datetime) -> float:
    return moment.timestamp() / SECONDS_PER_DAY


def _history(db: Database, machine: str, choice: Choice) -> MachineHistory:
    """The history of a machine; campaigns not yet identified are identified first where the database may be written."""
    model, version = None, None
    if choice.model is not None:
        from monitor.workflow.models import resolve

        stored = resolve(db, choice.model)
        model, version = stored.name, stored.version

    def read() -> MachineHistory:
        return machine_history(
            db, machine, model=model, version=version, parameter=choice.parameter, since=choice.since
        )

    found = read()
    if not db.read_only and found.unidentified:
        # Loaded here: most pages have nothing to identify, and the methods take as long to load as a page to make.
        from monitor.workflow.identify.identify import identify
        from monitor.workflow.identify.request import IdentifyRequest

        for campaign in found.unidentified:
            try:
                identify(db, IdentifyRequest(campaign, choice.model))
            except DataError:
                # A campaign that cannot be identified does not keep the others from being followed.
                continue
        found = read()
    found = chosen_only(found, choice.campaigns)
    if choice.parameter is not None and len(found.run) and choice.parameter not in found.parameters:
        there = machine_history(db, machine, model=model, version=version).parameters
        raise NotFoundError(
            f"machine {machine} has no parameter {choice.parameter!r}; it has {', '.join(there) or 'none yet'}"
        )
    return found


def _change(one: Change, series: Series) -> Document:
    slope = one.kind in ("slope", "trend")
    # A slope of a short history is stated a day: see SHORTEST_DAYS.
    period, days = ("day", 1.0) if np.ptp(series.t) < SHORTEST_DAYS else ("year", DAYS_PER_YEAR)
    return {
        "at": date(one.at, series.offset),
        "interval": [date(x, series.offset) for x in one.interval],
        "kind": one.kind,
        "size": one.size * (days if slope else 1.0),
        "u": one.u * (days if slope else 1.0),
        "unit": f"{series.unit}/{period}" if slope else series.unit,
        "p_value": one.p_value,
    }


def _parameter(
    series: Series, history: MachineHistory, own: npt.NDArray[np.bool_], events: list[float], check: float,
    choice: Choice, charts: Charts, place: int, searched: Mapping[str, tuple[History | None, str | None]],
    several: bool,
) -> tuple[Document, Followed]:  # fmt: skip
    steady = steady_runs(series, history.warm_up[own])
    found, why = searched[series.name]
    begins = piece_begins(steady, found, events)
    slope, line = drift(steady, begins)
    channels = {name: values[own] for name, values in history.conditions.items()}
    # The method is a condition like any other: 1 for the runs of each but the first.
    if several:
        for method in list(dict.fromkeys(history.method[own].tolist()))[1:]:
            channels[f"method {method}"] = (history.method[own] == method).astype(np.float64)
    coefficients, why_conditions = conditions(series, channels, begins)
    waves, why_cycles = cycles(steady, begins)
    warmth, why_warm = warming(
        series, history.warm_up[own], np.random.default_rng([SEED, len(series.t)]), history.campaign[own]
    )
    tested, why_untested = backtested(steady, begins)
    limit = history.tolerances.get(series.name)
    ahead, _ = prediction(steady, line, limit, check, choice.reliability)
    last = steady.days == steady.days[-1]
    return {
        "unit": series.unit,
        **slope,
        "latest": float(steady.values[last].mean()),
        "latest_u": _u_of_mean(steady, last),
        "latest_runs": int(last.sum()),
        "latest_at": date(float(steady.t[-1]), series.offset),
        "changes": [] if found is None else [_change(one, series) for one in found.changes],
        "drifts": [] if found is None else [_change(one, series) for one in found.trends],
        "why_no_changes": why,
        "conditions": coefficients,
        "why_no_conditions": why_conditions,
        "cycles": waves,
        "why_no_cycles": why_cycles,
        "warm_up": warmth,
        "why_no_warm_up": why_warm,
        **ahead,
        "backtest": tested,
        "why_no_backtest": why_untested,
        "control": charts.of(place),
    }, Followed(steady, begins, line)


def _u_of_mean(series: Series, chosen: npt.NDArray[np.bool_]) -> float | None:
    """Standard uncertainty of the mean of runs by their scatter, of a single run as stated; None where not stated."""
    count = int(chosen.sum())
    u = float(series.values[chosen].std(ddof=1) / np.sqrt(count)) if count > 1 else float(series.u[chosen][0])
    return u if np.isfinite(u) else None


def _next_check(history: MachineHistory, choice: Choice) -> float:
    last = history.seconds[-1] / SECONDS_PER_DAY
    if choice.next_check is not None:
        at = _days(choice.next_check)
        if at < last:
            raise InputError(
                f"--next-check {choice.next_check.date()} lies before the last run, {history.started_at[-1].date()}"
            )
        return at
    seconds = history.seconds
    # Runs are in the order of time: the first of a campaign that is met is its earliest.
    first = np.unique(history.campaign, return_index=True)[1]
    starts = np.sort(seconds[first])
    apart = np.diff(starts) / SECONDS_PER_DAY
    return float(last + (np.median(apart) if len(apart) else NEXT_CHECK_D))


def trends(db: Database, machine: str, choice: Choice | None = None) -> Trends:
    """Follow every parameter of a machine; the document is stored where all parameters were asked for.

    Raises NotFoundError for a machine or parameter that is not there, InputError for dates that cannot be.
    """
    choice = choice or Choice()
    history = _history(db, machine, choice)
    happened = machine_events(db, machine)
    splitting = [one for one in happened if one[1] != NOTE]
    known = [{"at": at.isoformat(), "kind": kind, "description": text} for at, kind, text in happened]
    head: Document = {
        "machine": machine,
        "since": None if choice.since is None else choice.since.isoformat(),
        "runs": len(history.run),
        "campaigns": list(dict.fromkeys(history.campaign.tolist())),
        "methods": list(dict.fromkeys(history.method.tolist())),
        "agreement": agreement(
            db, history, [Moment(at.timestamp(), kind, text) for at, kind, text in splitting]
        ),
        "events": known,
        "notes": same_hours(history),
        "false_alarm": FALSE_ALARM,
        "seed": SEED,
    }
    if not len(history.run):
        when = "yet" if choice.since is None else f"since {choice.since:%Y-%m-%d}"
        of = f" of campaign {', '.join(choice.campaigns)}" if choice.campaigns else ""
        why = f"machine {machine} has no identified run{of} {when}"
        return Trends({**head, "why": why, "parameters": {}}, (), {})
    series = all_series(history)
    events = [_days(at) for at, _, _ in splitting]
    reference = None if choice.reference is None else (_days(choice.reference[0]), _days(choice.reference[1]))
    charts = Charts(points_of(history, series), reference)
    check = _next_check(history, choice)
    searched = search_changes(
        [steady_runs(one, history.warm_up[own]) for one, own in series if len(one.t)],
        events,
        false_alarm=FALSE_ALARM,
        seed=SEED,
    )
    judged = {
        one.name: _parameter(
            one, history, own, events, check, choice, charts, place, searched, len(head["methods"]) > 1
        )
        for place, (one, own) in enumerate(series)
        if len(one.t)
    }
    parameters = {name: one for name, (one, _) in judged.items()}
    followed = {name: one for name, (_, one) in judged.items()}
    _discoveries(parameters)
    document: Document = {
        **head,
        "why": None,
        "next_check": date(check, series[0][0].offset),
        "control": {
            **charts.period(),
            "vector": charts.of_vector(history.parameters, np.random.default_rng(SEED)),
        },
        "parameters": parameters,
    }
    if choice.parameter is None:
        document["volumetric_error"] = volumetric_forecast(
            db, history, followed, check,
            model=choice.model, limit_um=choice.volumetric_limit_um, reliability=choice.reliability,
            rng=np.random.default_rng([SEED, 1]), offset=series[0][0].offset,
        )  # fmt: skip
    if choice == Choice() and not db.read_only:
        save_analysis(db, "trend", document, method="all parameters", machine=machine, seed=SEED)
    return Trends(
        document, tuple(one for one, _ in series), {name: one.line for name, one in followed.items()}
    )


def _discoveries(parameters: Mapping[str, Document]) -> None:
    """The false discovery rate over the drifts of all parameters."""
    p = [np.nan if one["p_value"] is None else one["p_value"] for one in parameters.values()]
    q = control_false_discoveries(p).q_value
    for one, rate in zip(parameters.values(), q, strict=True):
        one["q_value"] = number(float(rate))
