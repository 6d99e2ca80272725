"""A health report's records as the words and numbers of its template: rounded, with units, nothing computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from markupsafe import Markup

from monitor.reporting.health.answers import URGENT, answers, first_names, reason, to_do
from monitor.reporting.health.columns import column_widths
from monitor.reporting.health.concern import DRIFT_P, concern
from monitor.reporting.health.pictures import PrintedPictures, against_driver, map_picture, printed_pictures
from monitor.reporting.health.records import (
    ALARMS,
    DUE,
    DUE_MEANS,
    STATES,
    Change,
    ConditionRange,
    Drift,
    Fleet,
    FleetRow,
    MachineHealth,
    ParameterHealth,
    State,
    VolumetricMap,
    fleet_row,
    is_due,
    state_in_words,
)
from monitor.reporting.health.refusals import PrintedRefusal, printed_refusal
from monitor.reporting.health.sentences import NO_ROTARY_AXES
from monitor.reporting.health.trend_picture import trend_picture
from monitor.reporting.health.words import day, in_words, micrometres, p_in_words, percent, plain
from monitor.reporting.messages import DRIFT_OR_SEASON, times_stated
from monitor.reporting.numbers import round_result, written
from monitor.reporting.svg.sparkline import sparkline

#: Signs before a state: they tell the states apart without colour.
SIGNS = {
    State.OUT_OF_TOLERANCE: "■",
    State.MAY_BE_OUT_OF_TOLERANCE: "▲",
    State.NOT_EVALUATED: "?",
    State.CHANGED: "◆",
    State.MODEL_FAILS: "◇",
    State.DRIFTS: "↗",
    State.SUSPECT_DATA: "○",
    State.NOT_MEASURED: "–",
    State.IN_TOLERANCE: "✓",
    State.NO_CHANGE_SEEN: "✓",
}
#: How a state looks, beside its sign and its word: bad, doubtful, unknown or good.
LOOKS = {
    State.OUT_OF_TOLERANCE: "bad",
    State.MAY_BE_OUT_OF_TOLERANCE: "doubtful",
    State.NOT_EVALUATED: "doubtful",
    State.CHANGED: "doubtful",
    State.MODEL_FAILS: "doubtful",
    State.DRIFTS: "doubtful",
    State.SUSPECT_DATA: "doubtful",
    State.NOT_MEASURED: "unknown",
    State.IN_TOLERANCE: "good",
    State.NO_CHANGE_SEEN: "good",
}
#: The sign of a machine that is due for a check.
_DUE_SIGN = "◔"
#: Blind spots named on the page; the rest are counted (all stand in the JSON).
_BLIND_SHOWN = 4
#: Changes and events named on the page, the latest first.
_CHANGES_SHOWN = 12
#: Poses of the rotary axes named for the volumetric error, the worst first.
_POSES_SHOWN = 3
#: A drift is set in bold below this probability of seeing it where there is none.
_DRIFT_P = 0.001


@dataclass(frozen=True)
class FleetLine:
    """A machine as printed in the fleet table; ``anchor`` leads to its page."""

    machine: str
    anchor: str
    location: str
    sign: str
    state: str
    look: str
    alarm: bool
    changed: str
    since: str
    out: str
    next_check: str


@dataclass(frozen=True)
class Card:
    """A machine that needs attention on the first page: why, what to do, and the history of what is wrong.

    ``alike`` names others of which the same is found.
    """

    head: FleetLine
    reason: str
    to_do: str
    alike: str
    picture: Markup


@dataclass(frozen=True)
class ParameterLine:
    """A parameter as printed; ``picture`` is its history."""

    name: str
    description: str
    estimate: str
    expanded: str
    tolerance: str
    out: str
    beyond: bool
    drift: str
    drifts: bool
    unit: str
    picture: str


@dataclass(frozen=True)
class PrintedMachine:
    """A machine's page; of one that ``says_more`` than that it was not measured, below its head.

    ``judged``: whether a parameter has a tolerance; the table else lacks its columns, and ``widths`` theirs.
    """

    health: MachineHealth
    head: FleetLine
    meaning: str
    says_more: bool
    lines: tuple[ParameterLine, ...]
    judged: bool
    widths: tuple[float, ...]
    no_trend: str
    changes: tuple[tuple[str, str, bool], ...]
    more_changes: int
    conditions: tuple[tuple[str, str], ...]
    fit: tuple[tuple[str, str], ...]
    map: tuple[tuple[str, str], ...]
    map_picture: Markup
    map_of: str
    map_beyond: str
    blind: str
    refused: tuple[tuple[str, str], ...]
    imports: tuple[PrintedRefusal, ...]
    pictures: PrintedPictures
    reversal: str


def fleet_context(fleet: Fleet) -> dict[str, Any]:
    """What the first page prints."""
    return {
        "week": fleet.week,
        "days": f"{fleet.first_day.isoformat()} to {fleet.last_day.isoformat()}",
        "made_at": f"{fleet.made_at:%Y-%m-%d %H:%M}",
        "made_iso": fleet.made_at.isoformat() + "Z",
        "software": fleet.software,
        "risk": percent(fleet.risk),
        "anchor": fleet.anchor,
        "ended": fleet.ended,
        "lines": [_line(row) for row in fleet.rows],
        "legend": _legend(fleet.rows),
        "noticed": [(machine, _anchor(machine), what) for machine, what in fleet.noticed],
        "answers": answers(fleet),
        "cards": [
            _card(health, fleet.alike.get(health.machine, ()))
            for health in fleet.attention
            if health.state in URGENT or is_due(health)
        ],
        "imports": [printed_refusal(refusal) for refusal in fleet.refused_imports],
        "alarms": sum(row.state in ALARMS for row in fleet.rows),
        "measured": sum(row.state is not State.NOT_MEASURED for row in fleet.rows),
    }


def _legend(rows: Sequence[FleetRow]) -> list[tuple[str, str, str]]:
    """Sign, word and meaning of the states on the page."""
    states = {row.state for row in rows if not is_due(row)}
    due = [(_DUE_SIGN, DUE, DUE_MEANS)] if any(map(is_due, rows)) else []
    return [
        *((SIGNS[state], state.value, meaning) for state, meaning in STATES.items() if state in states),
        *due,
    ]


def _card(health: MachineHealth, alike: tuple[str, ...]) -> Card:
    return Card(
        _line(fleet_row(health)), reason(health), to_do(health), first_names(alike), _card_picture(health)
    )


def _card_picture(health: MachineHealth) -> Markup:
    """What shows the state: the residual against what drives it where the model fails, else a parameter's history."""
    if health.state is State.MODEL_FAILS and health.model is not None and health.model.against is not None:
        return Markup(against_driver(health.model.against))
    parameter = concern(health)
    if parameter is None or not parameter.history.times:
        return Markup()
    return Markup(trend_picture(health.machine, parameter))


def machine_pages(machines: Iterable[MachineHealth]) -> Iterator[PrintedMachine]:
    """The pages one after the other, so that only one machine is held at a time."""
    for health in machines:
        yield _page(health)


def _page(health: MachineHealth) -> PrintedMachine:
    shown = health.changes[:_CHANGES_SHOWN]
    blind = health.quality.blind_spots
    lines = tuple(_parameter(parameter) for parameter in health.parameters)
    is_judged, widths = any(line.tolerance or line.out for line in lines), column_widths(lines)
    more = f" and {len(blind) - _BLIND_SHOWN} more" if len(blind) > _BLIND_SHOWN else ""
    return PrintedMachine(
        health=health,
        head=_line(fleet_row(health)),
        meaning=DUE_MEANS if is_due(health) else STATES[health.state],
        says_more=_says_more(health),
        lines=lines,
        judged=is_judged,
        widths=widths if is_judged else (*widths[:3], widths[4]),
        no_trend=(
            ""
            if any(parameter.drift for parameter in health.parameters)
            else "No trend a year: the history is too short for one."
        ),
        changes=tuple((_span(change), _sentence(change), change.this_week) for change in shown),
        more_changes=len(health.changes) - len(shown),
        conditions=tuple((condition.name, _range(condition)) for condition in health.conditions),
        fit=_fit(health),
        map=_map(health.map),
        map_picture=map_picture(health.map),
        map_of=_shown(health.map),
        map_beyond=_beyond_the_slices(health.map),
        blind=", ".join(blind[:_BLIND_SHOWN]) + more if blind else "",
        refused=health.quality.refused,
        imports=tuple(printed_refusal(refusal) for refusal in health.quality.refused_imports),
        pictures=printed_pictures(health.model),
        reversal=_reversal(health),
    )


def _says_more(health: MachineHealth) -> bool:
    """Return whether there is anything to say of a machine beside that it was not measured this week."""
    quality = health.quality
    results = (health.parameters, health.changes, health.conditions, health.model, health.map)
    remarks = (quality.runs, quality.suspect, quality.refused, quality.refused_imports, quality.remarks)
    return health.state is not State.NOT_MEASURED or any(results) or any(remarks)


def _reversal(health: MachineHealth) -> str:
    """The reversal value of the first missing effect, where that is a play; it stands beside what to do about it."""
    missing = () if health.model is None else health.model.missing
    if not missing or missing[0].reversal is None:
        return ""
    reversal = missing[0].reversal
    value, u = in_words(reversal.value, reversal.u)
    return f"{value} ± {u} {reversal.unit} (ISO 230-2: from one direction to the other, twice the amplitude)"


def _range(condition: ConditionRange) -> str:
    lowest, highest, mean = plain(condition.lowest), plain(condition.highest), plain(condition.mean)
    return f"{lowest} to {highest}, mean {mean} {condition.unit}".strip()


def _anchor(machine: str) -> str:
    return "machine-" + "".join(sign if sign.isalnum() else f"_{ord(sign):x}_" for sign in machine)


def _line(row: FleetRow) -> FleetLine:
    return FleetLine(
        machine=row.machine,
        anchor=_anchor(row.machine),
        location=row.location,
        sign=_DUE_SIGN if is_due(row) else SIGNS[row.state],
        state=state_in_words(row),
        look="doubtful" if is_due(row) else LOOKS[row.state],
        alarm=row.state in ALARMS,
        changed=str(row.changed),
        since="" if row.since is None else day(row.since),
        out="" if row.probability_out is None else percent(row.probability_out),
        next_check=str(row.next_check),
    )


def _parameter(parameter: ParameterHealth) -> ParameterLine:
    rounded = round_result(parameter.estimate, parameter.expanded)
    factor = parameter.expanded / parameter.u
    drift = _drift(parameter)
    return ParameterLine(
        name=parameter.name,
        description=parameter.description,
        estimate=written(rounded.estimate),
        expanded=written(rounded.uncertainty),
        tolerance="" if parameter.tolerance is None else "± " + plain(parameter.tolerance),
        out="" if parameter.probability_out is None else percent(parameter.probability_out),
        beyond=parameter.tolerance is not None and abs(parameter.estimate) > parameter.tolerance,
        drift=drift,
        drifts=parameter.drift is not None and parameter.drift.p_value < _DRIFT_P,
        unit=parameter.unit,
        picture=sparkline(parameter, factor),
    )


def _drift(parameter: ParameterHealth) -> str:
    """The drift a year in the unit of its line with its interval, and when the limit is reached by any sign of it."""
    if parameter.drift is None:
        return ""
    u = parameter.drift.u_per_year
    slope, low, high = (
        in_words(value, u, sign=True)[0] for value in (parameter.drift.per_year, *parameter.drift.between)
    )
    sentence = f"{slope} ({low} to {high}) a year"
    if parameter.drift.season_not_told and parameter.drift.p_value < _DRIFT_P:
        sentence += f"; {DRIFT_OR_SEASON}"
    if parameter.out_since is not None:
        return f"{sentence}; beyond its tolerance since {parameter.out_since:%Y-%m-%d}"
    if parameter.drift.crosses_at is not None:
        sentence += _crossing(parameter, parameter.drift, parameter.drift.crosses_at)
    return sentence


def _crossing(parameter: ParameterHealth, drift: Drift, crosses_at: date) -> str:
    """When a drift reaches the limit; of one that did before the last run, only where it is more than chance."""
    if not parameter.history.times or crosses_at > parameter.history.times[-1].date():
        first, last = drift.crosses_between
        when = f" ({first} at the earliest)" if first else ""
        when = f" ({first} to {last})" if first and last else when
        return f"; tolerance reached about {crosses_at}{when}"
    return f"; by this trend beyond its tolerance since about {crosses_at}" if drift.p_value < DRIFT_P else ""


def _fit(health: MachineHealth) -> tuple[tuple[str, str], ...]:
    model = health.model
    if model is None:
        return ()
    lines = [("model", model.model), ("compared with", str(model.runs)), ("verdict", model.verdict)]
    lines.append(("what it leaves", f"{micrometres(model.rms_um)} rms of all coordinates"))
    if model.repeatability_um is not None:
        lines.append(("repeatability", micrometres(model.repeatability_um)))
    if model.lack_of_fit_p is not None and model.lack_of_fit_f is not None:
        lines.append(("lack of fit", f"F = {model.lack_of_fit_f:.3g}, p {p_in_words(model.lack_of_fit_p)}"))
    if model.times_stated is not None:
        lines.append(("against the statement", times_stated(model.times_stated)))
    if model.refuted_p is not None:
        lines.append(
            (
                "refuted",
                f"by the readings, noise of neighbours allowed for (p {p_in_words(model.refuted_p)}): the values hold "
                f"what the model lacks; monitor explain {model.campaign}",
            )
        )
    return tuple(lines)


def _map(error_map: VolumetricMap | None) -> tuple[tuple[str, str], ...]:
    if error_map is None:
        return ()
    worst = round_result(error_map.worst_um, error_map.expanded_um)
    lines = [
        (
            "worst",
            f"{written(worst.estimate)} µm (U = {written(worst.uncertainty)} µm) at {error_map.worst_at}",
        ),
        ("root mean square", f"{plain(float(f'{error_map.rms_um:.3g}'))} µm over {error_map.region}"),
    ]
    if error_map.limit_um is not None and error_map.probability_out is not None:
        beyond = "beyond it" if error_map.worst_um > error_map.limit_um else "within it"
        lines.append(
            (
                "limit",
                f"{plain(error_map.limit_um)} µm for the worst: {beyond}, "
                f"P(out): {percent(error_map.probability_out)}",
            )
        )
    worst_poses = sorted(error_map.by_pose, key=lambda pose: -pose.worst_um)[:_POSES_SHOWN]
    if worst_poses:
        poses = "; ".join(
            f"{pose.pose}: {pose.worst_um:.1f} µm ({pose.rms_um:.1f} µm)" for pose in worst_poses
        )
        lines.append(("by pose", f"at most (rms) {poses}"))
    lines += [("not followed", str(effect)) for effect in error_map.between_points or ()]
    lines += [("place unknown", str(step)) for step in error_map.step_places or ()]
    return tuple(lines)


def _shown(error_map: VolumetricMap | None) -> str:
    """At which pose the slices are, where there are poses."""
    if error_map is None or [str(pose.pose) for pose in error_map.by_pose] == [NO_ROTARY_AXES]:
        return "Three slices"
    return "Rotary axes at zero, three slices"


def _beyond_the_slices(error_map: VolumetricMap | None) -> str:
    """What to say where the slices show less than the worst error, so that nobody takes their scale for it."""
    if error_map is None or not error_map.slices:
        return ""
    shown = max(length for part in error_map.slices for row in part.lengths_um for length in row)
    longest, worst = micrometres(shown), micrometres(error_map.worst_um)
    if longest == worst:
        return ""
    return f"The longest here is {longest}: the worst, {worst}, lies outside of these slices."


def _span(change: Change) -> str:
    if change.after is None or change.after == change.at:
        return day(change.at)
    return f"{day(change.after)} to {day(change.at)}"


def _sentence(change: Change) -> str:
    return (
        str(change.what)
        if change.p_value is None
        else f"{change.what} (p\N{NO-BREAK SPACE}{p_in_words(change.p_value)})"
    )
