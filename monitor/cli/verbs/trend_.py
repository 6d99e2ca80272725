"""Drift, changes, dependence on conditions, warm-up, alarms and forecast of a machine's parameters over its history.

A change that was found or recorded (`monitor event`) splits the history: the drift is that since the last one. Runs
marked warm_up are left out of drift and changes where six others remain. The control charts compare with a
reference period (--reference), by default the first third of the history.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from monitor.cli import output
from monitor.cli.database import opened
from monitor.cli.parser import common
from monitor.exceptions import InputError
from monitor.workflow import agreement
from monitor.workflow.trends import Choice, trends

EXAMPLE = "monitor trend HU40-T --since 2025-01-01 --figures figures"


def options(parser: ArgumentParser) -> None:
    common(parser)
    parser.add_argument("machine", metavar="MACHINE")
    parser.add_argument("--parameter", metavar="P", help="one parameter only")
    parser.add_argument("--since", metavar="DATE", help="only runs from then on")
    parser.add_argument("--next-check", metavar="DATE", help="when the machine is to be checked again")
    parser.add_argument(
        "--reliability", type=float, default=0.95, metavar="P",
        help="wanted probability of being in tolerance until the next check (default 0.95)",
    )  # fmt: skip
    parser.add_argument(
        "--volumetric-limit", type=float, metavar="UM",
        help="limit of the volumetric error, in place of 'volumetric' of the machine's tolerances, in µm",
    )  # fmt: skip
    parser.add_argument(
        "--reference", metavar="FROM..TO", help="reference period of the control charts, two dates"
    )
    parser.add_argument(
        "--campaign", action="append", default=[], metavar="NAME", help="only this campaign (may be repeated)"
    )
    parser.add_argument("--model", metavar="NAME")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw every parameter over the dates")


def _date(text: str, option: str) -> datetime:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            f"{option} {text}: write a date as 2026-03-05 or 2026-03-05T07:00:00-05:00"
        ) from None
    return moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)


def run(options: Namespace) -> int:
    if not 0.0 < options.reliability < 1.0:
        raise InputError(f"--reliability {options.reliability:g}: a probability lies between 0 and 1")
    limit = options.volumetric_limit
    if limit is not None and not 0.0 < limit < float("inf"):
        raise InputError(f"--volumetric-limit {limit:g}: a limit in µm lies above zero")
    if limit is not None and options.parameter is not None:
        raise InputError("--volumetric-limit needs all parameters; leave out --parameter")
    reference = None
    if options.reference is not None:
        start, dots, end = options.reference.partition("..")
        if not dots:
            raise InputError(f"--reference {options.reference}: write two dates as 2026-01-01..2026-03-01")
        reference = (_date(start, "--reference"), _date(end, "--reference"))
        if reference[0] >= reference[1]:
            raise InputError(f"--reference {options.reference}: the first date must lie before the second")
    choice = Choice(
        parameter=options.parameter,
        since=None if options.since is None else _date(options.since, "--since"),
        next_check=None if options.next_check is None else _date(options.next_check, "--next-check"),
        reference=reference,
        reliability=options.reliability,
        campaigns=tuple(options.campaign),
        model=options.model,
        volumetric_limit_um=limit,
    )
    with opened(options) as db, output.working("following"), db.transaction():
        made = trends(db, options.machine, choice)
        found = made.document
        if options.figures is not None:
            from monitor.workflow.trend_figures import trend_figures

            found["figures"] = trend_figures(made, options.figures)
    if options.json:
        output.document(found)
        return 0
    _tables(found)
    return 0


def _three(value: float) -> str:
    """Three digits, never in powers of ten."""
    return f"{float(f'{value:.3g}'):.10g}"


def _latest(one: dict[str, Any]) -> tuple[str, str, str]:
    """The mean of the last day with its standard uncertainty and the number of its runs."""
    value, u = one["latest"], one["latest_u"]
    if not u:
        return _three(value), "-", str(one["latest_runs"])
    return output.rounded(value, u), output.two_digits(u), str(one["latest_runs"])


def _tables(found: dict[str, Any]) -> None:
    for note in found["notes"]:
        output.say(f"note: {note}")
    for pair in found["agreement"]:
        output.say(agreement.sentence(pair))
    if found["why"] is not None:
        output.say(found["why"])
        return
    runs, campaigns = found["runs"], len(found["campaigns"])
    held = f"{runs} run{'s' if runs > 1 else ''} of {campaigns} campaign{'s' if campaigns > 1 else ''}"
    if runs == 1:
        latest = next(iter(found["parameters"].values()))["latest_at"]
        output.say(
            f"{found['machine']}: {held}, of {latest[:16].replace('T', ' ')}; a history begins with the second run"
        )
        return
    rows = []
    for name, one in found["parameters"].items():
        slope = one["slope_per_year"]
        charts = one["control"]
        alarms = [
            kind for kind in ("shewhart", "ewma", "cusum") if charts.get(kind, {}).get("state") == "alarm"
        ]
        rows.append(
            [
                name, one["unit"], *_latest(one),
                "-" if slope is None else output.rounded(slope, one["u_slope"]),
                "-" if slope is None else output.two_digits(one['u_slope']), output.probability(one["p_value"]),
                "-" if one["robust_slope_per_year"] is None else _three(one["robust_slope_per_year"]),
                "-" if one["limit"] is None else f"{one['limit']:g}",
                (one["crosses_limit_at"] or "-")[:10],
                output.probability(one["in_tolerance_at_next_check"]),
                "-" if charts["why"] else ", ".join(alarms) or "in control",
            ]
        )  # fmt: skip
    names = ["parameter", "unit", "latest", "u", "n", "slope", "u", "p", "Theil-Sen", "limit", "crosses",
             "in tolerance next", "charts"]  # fmt: skip
    # A column that has nothing for any parameter is left out; the sentences below say why.
    told = [place for place in range(len(names)) if any(row[place] != "-" for row in rows)]
    output.table(
        f"{found['machine']}: {held}" + ("; slopes a year" if names.index("slope") in told else ""),
        [names[place] for place in told],
        [[row[place] for place in told] for row in rows],
        left=2,
    )
    for name, one in found["parameters"].items():
        for change in one["changes"]:
            output.say(
                f"{name}: {change['kind']} of {output.rounded(change['size'], change['u'])} {change['unit']} "
                f"(u = {output.two_digits(change['u'])} {change['unit']}) at "
                f"{change['at'][:16].replace('T', ' ')} (between {change['interval'][0][:10]} and "
                f"{change['interval'][1][:10]}, p = {output.probability(change['p_value'])})"
            )
    for name, one in found["parameters"].items():
        for condition in one["conditions"]:
            if (condition["q_value"] or 1.0) < 0.05:
                beside = (
                    f"; not told from {', '.join(condition['moves_with'])}" if condition["moves_with"] else ""
                )
                output.say(
                    f"{name}: {output.rounded(condition['coefficient'], condition['u'])} {condition['unit']} "
                    f"(u = {output.two_digits(condition['u'])} {condition['unit']}) with "
                    f"{condition['channel']}{beside}"
                )
        warm = one["warm_up"]
        if warm is not None and warm["p_value"] < 0.05 and warm["stable_after_h"] is not None:
            output.say(
                f"{name}: warms up by {warm['amplitude']:.3g} {warm['unit']} with a time constant of "
                f"{warm['tau_h']:.2g} h; stable after {warm['stable_after_h']:.2g} h"
            )
    _forecasts(found)
    for sentence in dict.fromkeys(one["why"] for one in found["parameters"].values() if one["why"]):
        output.say(sentence)
    for event in found["events"]:
        output.say(f"event {event['at'][:10]}: {event['kind']}, {event['description']}")
    for file in found.get("figures", []):
        output.say(file)


def _forecasts(found: dict[str, Any]) -> None:
    """The volumetric error ahead, how good the forecasts were, and when the machine is best checked again."""
    ahead = found.get("volumetric_error")
    if ahead is not None and ahead["why"] is None:
        low, high = ahead["predicted_interval_um"]
        crosses = "does not reach its limit" if ahead["crosses_limit_at"] is None else (
            f"reaches its limit on {ahead['crosses_limit_at'][:10]}"
        )  # fmt: skip
        between = _between(ahead["crosses_limit_interval"])
        output.say(
            f"volumetric error: {_three(ahead['latest_um'])} µm by the drifts of all parameters together, limit "
            f"{_three(ahead['limit_um'])} µm; {crosses}{between}"
        )
        output.say(
            f"  at the next check, {ahead['next_check'][:10]}: {_three(ahead['predicted_um'])} µm "
            f"({_three(low)} to {_three(high)} µm with 95 %), in tolerance with "
            f"{output.probability(ahead['in_tolerance_at_next_check'])}; check within "
            f"{ahead['recommended_interval_days']:.0f} days"
        )
        tested = ahead["backtest"]
        if tested is not None:
            output.say(
                f"  {tested['inside']} of {tested['made']} past days, each foretold by the days before it, lay in the "
                f"interval ({_three(tested['rms_um'])} µm off, root mean square)"
            )
    elif ahead is not None and ahead["limit_um"] is not None:
        output.say(ahead["why"])
    intervals = {
        name: one["recommended_interval_days"]
        for name, one in found["parameters"].items()
        if one["recommended_interval_days"] is not None
    }
    if intervals:
        first = min(intervals, key=lambda name: intervals[name])
        output.say(
            f"check within {intervals[first]:.0f} days, for {first} ({found['parameters'][first]['recommended_by']})"
        )
    tested = {
        name: one["backtest"] for name, one in found["parameters"].items() if one["backtest"] is not None
    }
    if tested:
        made, inside = (sum(one[key] for one in tested.values()) for key in ("made", "inside"))
        worst = min(tested, key=lambda name: tested[name]["share_inside"])
        output.say(
            f"backtest, every day foretold by the days before it: {inside} of {made} later values "
            f"({100 * inside / made:.0f} %) inside the 95 % forecast interval; least for {worst}, "
            f"{tested[worst]['inside']} of {tested[worst]['made']}"
        )


def _between(interval: list[str | None] | None) -> str:
    if interval is None:
        return ""
    low, high = interval
    if low is None:
        return f" (95 %: by {high[:10]})" if high is not None else ""
    return (
        f" (95 %: {low[:10]} or later, perhaps never)"
        if high is None
        else f" (95 %: {low[:10]} to {high[:10]})"
    )
