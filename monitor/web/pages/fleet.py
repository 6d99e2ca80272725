"""The first page: every machine, the most urgent first, with what is wrong, how far, since when and what to do next."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from monitor.exceptions import InputError, NotFoundError
from monitor.reporting.adjusting import adjusting
from monitor.reporting.health.records import History, ParameterHealth
from monitor.reporting.messages import UNEXPLAINED, attention_words, times_stated
from monitor.reporting.svg.sparkline import MOST, sparkline
from monitor.web.days import as_iso
from monitor.web.desk import Desk
from monitor.web.forms import read_form
from monitor.web.rendering import page
from monitor.web.ticket import Ticket
from monitor.web.words import (
    BEING_COMPUTED,
    DOES_NOT_FIT,
    NOT_IDENTIFIED,
    NOT_MEASURED,
    STOP,
    URGENCIES,
    WITHOUT_NUMBERS,
    Urgency,
    how_far,
    how_long_ago,
    since,
)
from monitor.workflow.fleet.attention import ATTENTION, Attention

if TYPE_CHECKING:
    from monitor.workflow.fleet.answer import FleetAnswer, FleetTableRow, OlderVersion
    from monitor.workflow.history.refuted import ContradictedStatement
    from monitor.workflow.history.values import ValuesAnswer
    from monitor.workflow.query import TableAnswer

IDENTIFY = "identify all"
#: The question after all machines and parameters.
ASKED: tuple[str, Mapping[str, Any]] = ("fleet", {"top": 0})
#: So many days a drift needs at least.
DAYS_OF_A_DRIFT = 5
#: Machines of one page.
PAGE_SIZE = 40
_USUAL = ATTENTION.index(Attention.AS_USUAL)
#: The classes of the page, the most urgent first: a machine whose model does not fit, and one without numbers, stand
#: before what is as usual.
CLASSES: dict[str, Urgency] = {
    **{str(label): URGENCIES[label] for label in ATTENTION[:_USUAL]},
    UNEXPLAINED: DOES_NOT_FIT,
    WITHOUT_NUMBERS: NOT_IDENTIFIED,
    **{str(label): URGENCIES[label] for label in ATTENTION[_USUAL:]},
}


@dataclass(frozen=True)
class MachineRow:
    """A machine with its most urgent parameter; ``others`` are further parameters that need attention, the most urgent
    first; ``latest`` is the date of its latest run, empty where none is known. ``worst`` is None of a machine without
    numbers. ``unexplained`` is the latest campaign, where the model of the numbers does not explain it: numbers that
    ask for nothing do not make such a machine usual; ``residuals`` says how far its readings are from what is stated,
    where they contradict that. ``same_hours`` are campaigns that it cannot all have made, of
    which its numbers are mixed, ``left_out`` those without a part in them. ``topology`` and ``parameters`` name the
    parameters."""

    machine: str
    plant: str
    urgency: Urgency
    attention: str
    season_not_told: bool | None
    worst: FleetTableRow | None
    how_far: str
    since: str
    others: tuple[FleetTableRow, ...]
    latest: str
    unexplained: str = ""
    residuals: str = ""
    same_hours: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    topology: str = ""
    parameters: frozenset[str] = frozenset()

    @property
    def next_step(self) -> str:
        """What its class asks for; where its numbers are mixed only what cannot wait until the campaign is chosen."""
        if self.same_hours and self.urgency.colour != STOP:
            return ""
        is_doubted = self.urgency.adjusts and bool(self.unexplained)
        return adjusting(self.urgency.next_step, is_doubted=is_doubted)


def machine_rows(
    table: Iterable[FleetTableRow],
    described: Mapping[str, Mapping[str, Any]],
    unexplained: Mapping[str, str],
    same_hours: Mapping[str, tuple[tuple[str, ...], ...]],
    left_out: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
    contradicted: Mapping[str, ContradictedStatement] = MappingProxyType({}),
) -> list[MachineRow]:
    """Return a row a machine, in the order of the table, which has the most urgent first."""
    rows: dict[str, list[FleetTableRow]] = {}
    for row in table:
        rows.setdefault(row.machine, []).append(row)
    classes = {
        machine: UNEXPLAINED
        if machine in unexplained and ATTENTION.index(of_machine[0].attention) >= _USUAL
        else str(of_machine[0].attention)
        for machine, of_machine in rows.items()
    }
    return [
        MachineRow(
            machine=machine,
            plant=str(described.get(machine, {}).get("location") or ""),
            urgency=CLASSES[classes[machine]],
            attention=classes[machine],
            season_not_told=of_machine[0].season_not_told,
            worst=of_machine[0],
            how_far=how_far(of_machine[0]),
            since=since(of_machine[0]),
            others=tuple(row for row in of_machine[1:] if ATTENTION.index(row.attention) < _USUAL),
            latest=max((row.latest_at[:10] for row in of_machine if row.latest_at), default=""),
            unexplained=unexplained.get(machine, ""),
            residuals=times_stated(contradicted[machine].times) if machine in contradicted else "",
            same_hours=tuple(name for group in same_hours.get(machine, ()) for name in group),
            left_out=left_out.get(machine, ()),
            topology=str(described.get(machine, {}).get("topology") or ""),
            parameters=frozenset(row.parameter for row in of_machine),
        )
        for machine, of_machine in rows.items()
    ]


def unnumbered_rows(machines: TableAnswer, numbered: Container[str]) -> list[MachineRow]:
    """Return a row for every machine of which no number is known: not identified, or not measured at all."""
    rows = []
    for machine in _described(machines):
        if machine["machine"] in numbered:
            continue
        urgency = NOT_IDENTIFIED if machine["campaigns"] else NOT_MEASURED
        latest = str(machine["latest_run_at"] or "")[:10]
        rows.append(
            MachineRow(
                machine=str(machine["machine"]), plant=str(machine["location"] or ""), urgency=urgency,
                attention=WITHOUT_NUMBERS, season_not_told=None, worst=None,
                how_far="", since=f"{latest}, the latest run" if latest else "", others=(), latest=latest,
            )
        )  # fmt: skip
    return rows


def _described(machines: TableAnswer) -> list[dict[str, Any]]:
    return [dict(zip(machines.columns, row, strict=True)) for row in machines.rows]


@dataclass(frozen=True)
class _Sums:
    """What is known of the fleet: the latest ``answer`` (None: none yet), what the page is ``waiting`` for, and the
    ``moment`` of the answer where campaigns were imported since (UTC, empty: it is of now)."""

    answer: FleetAnswer | None = None
    waiting: Ticket | None = None
    moment: str = ""


def _summed(request: Request, machines: TableAnswer) -> _Sums:
    """The fleet's latest answer; where it is being computed anew the one before is shown until then."""
    desk: Desk = request.app.state.desk
    identifying = next((other for other in desk.under_way() if other.question == IDENTIFY), None)
    if not machines.rows:
        return _Sums(waiting=identifying)
    ticket, last = desk.ask_rested(request.state.user, *ASKED)
    try:
        answer = ticket.answer()
    except NotFoundError:
        # Nothing is identified any more, or not yet.
        return _Sums(waiting=identifying)
    shown = ticket if answer is not None else last
    waiting = identifying or (ticket if answer is None else None)
    if shown is None:
        return _Sums(waiting=waiting)
    is_of_now = desk.standing(*ASKED) is shown
    return _Sums(shown.answer(), waiting, "" if is_of_now else f"{shown.asked_on:%Y-%m-%d %H:%M:%S}")


def _with_unnumbered(sums: _Sums, machines: TableAnswer) -> list[MachineRow]:
    """Return the machines by their class, the most urgent first, each class in the order of the fleet.

    While the first sums are made, nothing is known of any but that it was measured.
    """
    if sums.answer is None and sums.waiting is not None:
        return [
            replace(row, urgency=BEING_COMPUTED) if row.urgency is NOT_IDENTIFIED else row
            for row in unnumbered_rows(machines, ())
        ]
    rows: list[MachineRow] = []
    if (answer := sums.answer) is not None:
        by_name = {str(row["machine"]): row for row in _described(machines)}
        rows = machine_rows(
            answer.table,
            by_name,
            answer.unexplained,
            answer.same_hours or {},
            answer.left_out or {},
            answer.statements_contradicted or {},
        )
    rows += unnumbered_rows(machines, {row.machine for row in rows})
    ranks = {label: rank for rank, label in enumerate(CLASSES)}
    return sorted(rows, key=lambda row: ranks[row.attention])


@dataclass(frozen=True)
class _Advises:
    """What would tell more of the machines: ``earlier_campaigns`` where one has too few days for a drift,
    ``tolerances`` where one has no parameter with a limit."""

    earlier_campaigns: bool = True
    tolerances: bool = True


def _advises(answer: FleetAnswer | None) -> _Advises:
    """What the fleet's table lacks; everything while there is none."""
    if answer is None:
        return _Advises()
    days: dict[str, int] = {}
    limited = {row.machine for row in answer.table if row.limit is not None}
    for row in answer.table:
        days[row.machine] = max(days.get(row.machine, 0), row.days)
    return _Advises(
        any(count < DAYS_OF_A_DRIFT for count in days.values()) or not days, set(days) != limited or not days
    )


def _older(answer: FleetAnswer | None) -> list[tuple[OlderVersion, list[str]]]:
    """Return the versions that numbers are of beside the newest one, each with its machines."""
    machines: dict[OlderVersion, list[str]] = {}
    for machine, versions in ({} if answer is None else answer.older_versions or {}).items():
        for version in versions:
            machines.setdefault(version, []).append(machine)
    return list(machines.items())


def _tally(rows: Iterable[MachineRow]) -> list[tuple[Urgency, int]]:
    """How many machines there are of each word, the most urgent first."""
    counts: dict[str, tuple[Urgency, int]] = {}
    for row in rows:
        urgency, count = counts.get(row.urgency.word, (row.urgency, 0))
        counts[row.urgency.word] = (urgency, count + 1)
    return list(counts.values())


def _within(latest: str, since: str, until: str) -> bool:
    """Whether a date lies in a period whose ends belong to it; an end that is not named is open."""
    return (not since or latest >= since) and (not until or (latest != "" and latest <= until))


def routes() -> APIRouter:
    """Return the routes of the page and of its small pictures."""
    router = APIRouter()

    @router.get("/")
    def fleet(
        request: Request, state: str = "", plant: str = "", since: str = "", until: str = "", first: int = 0
    ) -> Response:
        """Show the machines; of one state, of one plant, measured last in a period."""
        period, refusal = {"since": "", "until": ""}, ""
        try:
            period = as_iso(since=since, until=until)
        except InputError as error:
            # A day that is none takes away the period and not the fleet.
            refusal = str(error)
        machines: TableAnswer = request.app.state.asker(request.state.user, "machines")
        sums = _summed(request, machines)
        answer, waiting = sums.answer, sums.waiting
        rows = _with_unnumbered(sums, machines)
        counts = Counter(row.attention for row in rows)
        shown = [
            row
            for row in rows
            if state in ("", row.attention) and plant in ("", row.plant) and _within(row.latest, **period)
        ]
        first = min(max(first, 0), max(len(shown) - 1, 0))
        return page(
            request, "fleet.html", status=400 if refusal else 200,
            empty=not machines.rows, waiting=waiting, moment=sums.moment,
            rows=shown[first : first + PAGE_SIZE],
            count=len(shown), first=first, page_size=PAGE_SIZE,
            tally=_tally(rows), attention_words=attention_words,
            how_long_ago=how_long_ago, today=datetime.now(UTC).date(),
            states=[(label, urgency, counts[label]) for label, urgency in CLASSES.items() if counts[label]],
            refusal=refusal, state=state, plant=plant, since=period["since"], until=period["until"],
            plants=sorted({row.plant for row in rows if row.plant}), advises=_advises(answer),
            unlisted=[row.machine for row in rows if row.urgency is NOT_IDENTIFIED],
            not_identified=() if answer is None else answer.not_identified,
            older=_older(answer),
            simulated=() if answer is None else answer.simulated or (),
            without_parameter=() if answer is None else list((answer.limits_without_parameter or {}).items())[:10],
        )  # fmt: skip

    @router.post("/fleet/identify")
    async def identify(request: Request) -> Response:
        """Identify the errors of every campaign, in a thread of its own."""
        async with read_form(request):
            request.app.state.desk.ask(request.state.user, IDENTIFY, {}, anew=True)
        return RedirectResponse("/", status_code=303)

    @router.get("/machine/history.svg")
    def history(request: Request, name: str, parameter: str) -> Response:
        """Draw the latest runs of one parameter in one line of a table."""
        values: ValuesAnswer = request.app.state.asker(
            request.state.user, "values", {"machine": name, "parameter": parameter}
        )
        if parameter not in values.parameters:
            raise NotFoundError(f"machine {name} has no run with {parameter}")
        address = sparkline(_drawn(values, parameter), factor=2.0)
        picture = base64.b64decode(address.partition(",")[2])
        return Response(picture, media_type="image/svg+xml", headers={"Cache-Control": "no-cache"})

    return router


def _drawn(values: ValuesAnswer, parameter: str) -> ParameterHealth:
    """The runs of a parameter as the small picture takes them: the last day dark, the others grey."""
    series = values.parameters[parameter]
    rows = [row for row, value in enumerate(series.values) if value is not None][-MOST:]
    last = values.started_at[rows[-1]].date()
    numbers = [series.values[row] for row in rows]
    return ParameterHealth(
        name=parameter, description="", unit=series.unit, estimate=numbers[-1] or 0.0, u=series.u[rows[-1]] or 0.0,
        expanded=0.0, tolerance=series.tolerance, probability_out=None, out_since=None,
        history=History(
            times=tuple(values.started_at[row] for row in rows),
            values=tuple(number for number in numbers if number is not None),
            u=tuple(series.u[row] or 0.0 for row in rows),
            this_week=tuple(values.started_at[row].date() == last for row in rows),
        ),
        changed_at=(), drift=None, in_words="",
    )  # fmt: skip
