"""What `monitor trend` says of a machine: the table of its parameters, and a sentence for each finding."""

from __future__ import annotations

from typing import Any

from monitor.cli import output
from monitor.workflow.history import agreement

#: From so many runs on it is said why there are no charts.
FEWEST_RUNS = 10


def _three(value: float) -> str:
    """Three digits, never in powers of ten."""
    return f"{float(f'{value:.3g}'):.10g}"


def _latest(one: dict[str, Any]) -> tuple[str, str, str]:
    """The mean of the last day with its standard uncertainty and the number of its runs."""
    value, u = one["latest"], one["latest_u"]
    if not u:
        return _three(value), "-", str(one["latest_runs"])
    return output.rounded(value, u), output.two_digits(u), str(one["latest_runs"])


def say(found: dict[str, Any]) -> None:
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
        text_columns=2,
    )
    for name, one in found["parameters"].items():
        for change in one["changes"]:
            output.say(
                f"{name}: {change['kind']} of {output.rounded(change['size'], change['u'])} {change['unit']} "
                f"(u = {output.two_digits(change['u'])} {change['unit']}) at {_minute(change['at'])} "
                f"({_place(change['interval'])}, p = {output.probability(change['p_value'])})"
            )
    for name, one in found["parameters"].items():
        for condition in one["conditions"]:
            if condition["q_value"] is not None and condition["q_value"] < 0.05:
                beside = (
                    f"; not told from {', '.join(condition['moves_with'])}" if condition["moves_with"] else ""
                )
                output.say(
                    f"{name}: {output.rounded(condition['coefficient'], condition['u'])} {condition['unit']} "
                    f"(u = {output.two_digits(condition['u'])} {condition['unit']}) with "
                    f"{condition['channel']}{beside}"
                )
        for wave in one["cycles"]:
            if wave["p_value"] is not None and wave["p_value"] < 0.05:
                output.say(
                    f"{name}: goes up and down by {output.rounded(wave['amplitude'], wave['u'])} {wave['unit']} (u = "
                    f"{output.two_digits(wave['u'])} {wave['unit']}) over the {wave['cycle']}"
                )
        warm = one["warm_up"]
        if warm is not None and warm["p_value"] < 0.05 and warm["stable_after_h"] is not None:
            output.say(
                f"{name}: warms up by {warm['amplitude']:.3g} {warm['unit']} with a time constant of "
                f"{warm['tau_h']:.2g} h; stable after {warm['stable_after_h']:.2g} h"
            )
    _charts(found)
    _forecasts(found)
    for sentence in dict.fromkeys(one["why"] for one in found["parameters"].values() if one["why"]):
        output.say(sentence)
    for event in found["events"]:
        output.say(f"event {event['at'][:10]}: {event['kind']}, {event['description']}")
    for file in found.get("figures", []):
        output.say(file)


def _minute(at: str) -> str:
    return at[:16].replace("T", " ")


def _place(interval: list[str]) -> str:
    """Between which dates, or times of one date, a change lies."""
    low, high = interval
    digits = 10 if low[:10] != high[:10] else 16
    return f"between {low[:digits].replace('T', ' ')} and {high[:digits].replace('T', ' ')}"


def _charts(found: dict[str, Any]) -> None:
    """What the charts were compared with, those of the vector, and why there are none."""
    control = found["control"]
    whys = [one["control"]["why"] for one in found["parameters"].values()]
    if all(whys):
        # Of histories of a few runs the other sentences say enough.
        if len(found["parameters"]) and found["runs"] >= FEWEST_RUNS:
            output.say(whys[0])
        return
    output.say(
        f"charts: reference period {control['reference_from'][:10]} to {control['reference_to'][:10]}, "
        f"{control['reference_points']} {control['points']}; a false alarm once in "
        f"{control['average_run_length']:g} {control['points']}"
    )
    vector = control["vector"]
    if len(found["parameters"]) == 1:
        return
    if vector["why"] is not None:
        output.say(vector["why"])
        return
    for key, name in (("t_squared", "T²"), ("mewma", "MEWMA")):
        one = vector[key]
        words = "in control"
        if one["state"] == "alarm":
            shares = sorted(one["shares"], key=lambda parameter: -one["shares"][parameter])[:3]
            words = f"alarm, mostly of {', '.join(shares)}"
        output.say(
            f"{name} of {len(vector['parameters'])} parameters together: {words} "
            f"({_three(one['value'])}, limit {_three(one['limit'])})"
        )


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
        span = found["parameters"][first]["span_days"]
        if intervals[first] > span:
            output.say(
                f"  its drift was seen over {span:.0f} days only; that it goes on for longer is a supposition"
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
