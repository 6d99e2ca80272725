"""What `monitor trend` says of a machine: the table of its parameters, and a sentence for each finding."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from monitor.cli import output
from monitor.cli.agreement_output import agreement_line
from monitor.cli.day_output import resemblance
from monitor.cli.dependence_output import dependences
from monitor.cli.forecast_output import forecast_start
from monitor.cli.rests_on_output import levels, steps_at_once
from monitor.reporting.confounding import charted
from monitor.reporting.lacks import NO_MAP_STORED
from monitor.reporting.messages import ONE_DAY
from monitor.reporting.weekly_notice import WeeklyNotices, weekly_sentence
from monitor.workflow.history.season import SlopeVerdict
from monitor.workflow.trend.answer import (
    FEW_DAYS,
    Between,
    DatedChange,
    ParameterTrend,
    StepAtEvent,
    TrendAnswer,
    VolumetricForecast,
)
from monitor.workflow.trend.charts_answer import VectorState

#: From so many runs on it is said why there are no charts.
FEWEST_RUNS = 10


def say(answer: TrendAnswer) -> None:
    """Print a page: what is out of tolerance first, because whoever reads one line has to read that."""
    output.copied(answer.copied_readings)
    for name, parameter in answer.parameters.items():
        for sentence in out_of_tolerance(name, parameter):
            output.say(sentence)
    for note in answer.notes:
        output.say(f"note: {note}")
    for pair in answer.agreement:
        output.say(agreement_line(pair))
    if answer.why is not None:
        output.say(answer.why)
        return
    if answer.runs == 1:
        latest = next(iter(answer.parameters.values())).mean.latest_at or ""
        output.say(
            f"{answer.machine}: {_size(answer)}, of {_minute(latest)}; a history begins with the second run"
        )
        return
    _table(answer)
    for sentence in _sentences(answer):
        output.say(sentence)


def _sentences(answer: TrendAnswer) -> Iterator[str]:
    parameters = answer.parameters.items()
    for name, parameter in parameters:
        yield from (_change(name, change) for change in parameter.changes)
        yield from _settled(name, parameter)
        yield from (_event_step(name, step) for step in parameter.event_steps)
    yield from steps_at_once(answer)
    few = [
        change.days for _, parameter in parameters for change in parameter.changes if change.days < FEW_DAYS
    ]
    if few:
        yield (
            f"{min(few)} days cannot tell a change from days that differ by much more than runs scatter: none of these "
            "is allowed for where the other parameters do not show such days"
        )
    yield from dependences(answer)
    for name, parameter in parameters:
        yield from forecast_start(name, parameter)
    yield from _charts(answer)
    latest = max((parameter.mean.latest_at or "" for _, parameter in parameters), default="")
    yield from _volumetric(answer.volumetric_error, latest)
    yield from _next_check(answer)
    yield from _backtest(answer)
    yield from resemblance(answer)
    yield from levels(answer)
    yield from _no_slopes(answer)
    if answer.weekly_looks is not None:
        yield from weekly_lines(answer.weekly_looks)
    for event in answer.events:
        yield f"event {event.at[:10]}: {event.kind}, {event.description}"
    yield from answer.figures or ()


def _no_slopes(answer: TrendAnswer) -> Iterator[str]:
    """Why parameters have no slope a year; which ones, where others have one or lack it for another reason."""
    lacking: dict[str, list[str]] = {}
    for name, parameter in answer.parameters.items():
        if parameter.drift.why is not None:
            lacking.setdefault(str(parameter.drift.why), []).append(name)
    for why, names in lacking.items():
        yield why if len(names) == len(answer.parameters) else f"{', '.join(names)}: {why}"


def out_of_tolerance(name: str, parameter: ParameterTrend) -> Iterator[str]:
    """Yield a sentence where the latest runs lie beyond the limit, whatever is foretold."""
    latest, limit = parameter.mean.latest, parameter.forecast.limit
    if limit is not None and abs(latest) > limit:
        value = _latest(latest, parameter.mean.latest_u)
        yield f"out of tolerance: {name}, {value} {parameter.unit} in the latest runs, limit {limit:g} {parameter.unit}"


def weekly_lines(looks: WeeklyNotices, *, machines: bool = False) -> Iterator[str]:
    """What weekly looks noticed, a sentence each, with the name of the machine where there are several."""
    for notice in looks.notices:
        yield (f"{notice.machine}: {weekly_sentence(notice)}" if machines else weekly_sentence(notice))
    yield (
        f"weekly looks: {looks.weeks} weeks, {looks.machines} machine{'' if looks.machines == 1 else 's'}, "
        f"{looks.series} series in the last; of all notices at most {100 * looks.false_discovery_rate:g} % false on "
        f"average{'' if looks.notices else '; nothing was noticed'}"
    )


def _size(answer: TrendAnswer) -> str:
    runs, campaigns = answer.runs, len(answer.campaigns)
    return f"{runs} run{'s' if runs > 1 else ''} of {campaigns} campaign{'s' if campaigns > 1 else ''}"


def _three(value: float | None) -> str:
    """Three digits, never in powers of ten."""
    return "-" if value is None else f"{float(f'{value:.3g}'):.10g}"


#: The columns of the table: heading, and the cell of a parameter.
_COLUMNS: dict[str, Callable[[ParameterTrend], str]] = {
    "unit": lambda parameter: parameter.unit,
    "latest": lambda parameter: _latest(parameter.mean.latest, parameter.mean.latest_u),
    "u": lambda parameter: output.two_digits(parameter.mean.latest_u) if parameter.mean.latest_u else "-",
    "n": lambda parameter: str(parameter.mean.latest_runs),
    "slope": lambda parameter: output.rounded(parameter.drift.slope_per_year, parameter.drift.u_slope),
    "u of slope": lambda parameter: output.two_digits(parameter.drift.u_slope),
    "p": lambda parameter: output.probability(parameter.drift.p_value),
    "Theil-Sen": lambda parameter: _three(parameter.drift.robust_slope_per_year),
    "limit": lambda parameter: "-" if parameter.forecast.limit is None else f"{parameter.forecast.limit:g}",
    "crosses": lambda parameter: _crosses(parameter),
    "in tolerance next": lambda parameter: output.probability(parameter.forecast.in_tolerance_at_next_check),
    "charts": lambda parameter: _chart_words(parameter),
}
#: What is said of charts without an alarm beside a slope that is not by chance: they are slow to see one.
_QUIET_CHARTS = {
    SlopeVerdict.DRIFT: "no alarm, but drifts",
    SlopeVerdict.DRIFT_OR_SEASON: "no alarm, but moves",
}
#: Headings that are shorter on paper than what tells two columns apart.
_HEADINGS = {"u of slope": "u"}


def _chart_words(parameter: ParameterTrend) -> str:
    """The charts in alarm; without one a parameter is in control, unless its drift says that it is not."""
    if parameter.control.why:
        return "-"
    quiet = "in control" if parameter.drift.verdict is None else _QUIET_CHARTS[parameter.drift.verdict]
    return ", ".join(parameter.control.alarms) or quiet


def _crosses(parameter: ParameterTrend) -> str:
    """When the drift reaches the limit; since when it is beyond, where that day is past."""
    if parameter.forecast.beyond_since is not None:
        return f"since {parameter.forecast.beyond_since[:10]}"
    at = parameter.forecast.crosses_limit_at
    if at is None:
        return "-"
    return f"since {at[:10]}" if at <= (parameter.mean.latest_at or "") else at[:10]


def _latest(value: float, u: float | None) -> str:
    return output.rounded(value, u) if u else _three(value)


def _table(answer: TrendAnswer) -> None:
    """The parameters. A column that has nothing for any of them is left out; the sentences below say why."""
    columns = {
        heading: [cell(parameter) for parameter in answer.parameters.values()]
        for heading, cell in _COLUMNS.items()
    }
    columns = {heading: cells for heading, cells in columns.items() if any(text != "-" for text in cells)}
    slopes = "; slopes a year" if "slope" in columns else ""
    output.table(
        f"{answer.machine}: {_size(answer)}; latest: mean of the n runs of the last day{_freedoms(answer)}{slopes}",
        ["parameter", "relative to", *(_HEADINGS.get(heading, heading) for heading in columns)],
        [
            [name, answer.refers_to.get(name, ""), *cells]
            for name, *cells in zip(answer.parameters, *columns.values(), strict=True)
        ],
        text_columns=3,
    )


def _freedoms(answer: TrendAnswer) -> str:
    """By what the u of the latest means is known, with its degrees of freedom."""
    means = (parameter.mean for parameter in answer.parameters.values())
    with_freedoms = [mean for mean in means if mean.latest_degrees_of_freedom is not None]
    if not with_freedoms:
        return ""
    freedoms = sorted(
        mean.few_degrees_of_freedom for mean in with_freedoms if mean.few_degrees_of_freedom is not None
    )
    if not freedoms:
        return ", u by the scatter of runs within days"
    few = freedoms[0]
    more = "" if few == freedoms[-1] and len(freedoms) == len(with_freedoms) else " or more"
    return f", u by the scatter of runs within days ({few} degree{'' if few == 1 else 's'} of freedom{more})"


def _p_value(change: DatedChange) -> str:
    """The p-value of a change; where no simulated history was like it, that of one in all of them, as a bound."""
    stated = output.stated("p", change.p_value)
    return stated.replace(" = ", " at most ") if change.p_at_most else stated


def _change(name: str, change: DatedChange) -> str:
    others = change.between_instruments
    # Of several steps at once one sentence says it.
    exchanged = "" if others is None or others.together else f"; {others.in_words(change.unit)}"
    one_day = f"; {ONE_DAY}" if change.one_day else ""
    return (
        f"{name}: {change.kind} of {output.with_u(change.size, change.u, change.unit)} at {_minute(change.at)} "
        f"({_interval(change.interval)}, {_p_value(change)}){exchanged}{one_day}"
    )


def _settled(name: str, parameter: ParameterTrend) -> Iterator[str]:
    """The sentence of the weekly report on each change that passes again, with the time and the probability."""
    for change in parameter.drifts:
        if change.time_constant_days is not None:
            # Loaded here, as below.
            from monitor.reporting.health.settling import ParameterSettled

            what = ParameterSettled(name, change.size, change.u, change.unit, change.time_constant_days)
            yield f"from {_minute(change.at)} on: {what}; {_p_value(change)}"


def _event_step(name: str, step: StepAtEvent) -> str:
    """The sentence of the weekly report, with the time and the probability."""
    # Loaded here: most machines have no step at an event, and the report has two dozen kinds of sentences.
    from monitor.reporting.health.news import SteppedAtEvent

    what = SteppedAtEvent(
        name, step.description, step.size, step.u, step.unit, step.why_not_decided, step.drift_in_30_days
    )
    p_value = f" ({output.stated('p', step.p_value)})" if step.decided else ""
    return f"{_minute(step.at)} UTC, {step.kind}: {what}{p_value}"


def _minute(at: str | None) -> str:
    return (at or "")[:16].replace("T", " ")


def _interval(interval: Between) -> str:
    """Between which dates, or times of one date, a change lies."""
    low, high = (end or "" for end in interval)
    digits = 10 if low[:10] != high[:10] else 16
    return f"between {low[:digits].replace('T', ' ')} and {high[:digits].replace('T', ' ')}"


def _charts(answer: TrendAnswer) -> Iterator[str]:
    """What the charts were compared with, those of the vector, and why there are none."""
    control = answer.control
    whys = [parameter.control.why for parameter in answer.parameters.values()]
    if control is None or all(whys):
        # Of histories of a few runs the other sentences say enough.
        if whys and answer.runs >= FEWEST_RUNS:
            yield str(whys[0] or "")
        return
    period, vector = control.period, control.vector
    of_whom = charted(period.measured_by, period.several_instruments)
    yield (
        f"charts: reference period {(period.reference_from or '')[:10]} to {(period.reference_to or '')[:10]}, "
        f"{period.reference_points} {period.points}{of_whom}; a false alarm once in "
        f"{period.average_run_length:g} {period.points}"
    )
    if len(answer.parameters) == 1:
        return
    if vector.why is not None:
        yield str(vector.why)
        return
    for name, state in (("T²", vector.t_squared), ("MEWMA", vector.mewma)):
        if state is not None:
            yield _vector(name, state, len(vector.parameters or ()))


def _vector(name: str, state: VectorState, count: int) -> str:
    verdict = "in control"
    if state.state == "alarm":
        largest = sorted(state.shares, key=lambda parameter: -state.shares[parameter])[:3]
        verdict = f"alarm, mostly of {', '.join(largest)}"
    return (
        f"{name} of {count} parameters together: {verdict} "
        f"({_three(state.value)}, limit {_three(state.limit)})"
    )


def _volumetric(ahead: VolumetricForecast | None, latest: str) -> Iterator[str]:
    """The volumetric error ahead, from the ``latest`` run on, and how good its forecasts were."""
    if ahead is None:
        return
    if ahead.why is not None or ahead.predicted_interval_um is None:
        if ahead.limit_um is not None and ahead.why is not None:
            yield from _not_foretold(str(ahead.why), ahead.mapped_um, ahead.limit_um)
        return
    low, high = ahead.predicted_interval_um
    beyond = None not in (ahead.latest_um, ahead.limit_um) and (ahead.latest_um or 0.0) > (
        ahead.limit_um or 0.0
    )
    yield (
        f"volumetric error: {_three(ahead.latest_um)} µm by the drifts of all parameters together, limit "
        f"{_three(ahead.limit_um)} µm; {_reaches(ahead, beyond, latest)}"
    )
    yield (
        f"  at the next check, {(ahead.next_check or '')[:10]}: {_three(ahead.predicted_um)} µm "
        f"({_three(low)} to {_three(high)} µm with 95 %), in tolerance with "
        f"{output.probability(ahead.in_tolerance_at_next_check)}; check within "
        f"{ahead.recommended_interval_days:.0f} days"
    )
    if ahead.backtest is not None:
        yield (
            f"  {ahead.backtest.inside} of {ahead.backtest.forecasts} past days, each foretold by the days before it, "
            f"lay in the interval ({_three(ahead.backtest.rms_um)} µm off, root mean square)"
        )


def _not_foretold(why: str, worst: float | None, limit: float) -> Iterator[str]:
    """Why no volumetric error is foretold, and that of the last map that is stored, as the fleet has it."""
    if worst is None:
        yield f"{why}; its limit, {_three(limit)} µm, is not judged: {NO_MAP_STORED}"
        return
    yield why
    verdict = "out of tolerance" if worst >= limit else "within it"
    yield f"volumetric error: {_three(worst)} µm at worst in the last map stored, limit {_three(limit)} µm: {verdict}"


def _reaches(ahead: VolumetricForecast, beyond: bool, latest: str) -> str:
    """When the volumetric error reaches its limit; where it lies beyond already, since when."""
    at = ahead.crosses_limit_at
    if beyond:
        return f"already beyond it since {(ahead.beyond_since or latest)[:10]}"
    if at is None:
        return "does not reach its limit" + _crossing(ahead.crosses_limit_interval)
    return f"reaches its limit on {at[:10]}{_crossing(ahead.crosses_limit_interval)}"


def _next_check(answer: TrendAnswer) -> Iterator[str]:
    """When the machine is best checked again."""
    intervals = {
        name: parameter.forecast.recommended_interval_days
        for name, parameter in answer.parameters.items()
        if parameter.forecast.recommended_interval_days is not None
    }
    if not intervals:
        return
    name = min(intervals, key=lambda parameter: intervals[parameter])
    first = answer.parameters[name]
    if intervals[name] < 0.5:
        yield f"check at once, for {name} ({first.forecast.recommended_by})"
        return
    yield f"check within {intervals[name]:.0f} days, for {name} ({first.forecast.recommended_by})"
    span = first.drift.span_days
    if intervals[name] >= span:
        yield f"  its drift was seen over {span:.0f} days only; that it goes on for longer is an assumption"


def _backtest(answer: TrendAnswer) -> Iterator[str]:
    """How good the forecasts of the parameters were."""
    tests = {
        name: parameter.backtest
        for name, parameter in answer.parameters.items()
        if parameter.backtest is not None
    }
    if not tests:
        return
    forecasts, inside = (
        sum(test.forecasts for test in tests.values()),
        sum(test.inside for test in tests.values()),
    )
    name = min(tests, key=lambda parameter: tests[parameter].share_inside)
    yield (
        f"backtest of {_all_of(len(tests))}, each day forecast from the days before it: {inside} of {forecasts} values "
        f"({100 * inside / forecasts:.0f} %) inside the 95 % forecast interval; least for {name}, "
        f"{tests[name].inside} of {tests[name].forecasts}"
    )


def _all_of(count: int) -> str:
    return "the one parameter" if count == 1 else f"all {count} parameters together"


def _crossing(interval: Between | None) -> str:
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
