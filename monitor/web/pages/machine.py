"""The page of a machine: one parameter over time with all that is known of it, the others in a table, events."""

from __future__ import annotations

import csv
import io
from datetime import date, timedelta
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import JSONResponse, Response

from monitor.exceptions import InputError, MonitorError, NotFoundError
from monitor.reporting.messages import DRIFT_OR_SEASON, SEASON_NOT_TOLD
from monitor.web.charts.periods import periods_chart
from monitor.web.charts.trend import GROUPINGS, groups_without_legend, trend_chart
from monitor.web.days import as_iso, typed_moment
from monitor.web.desk import Desk
from monitor.web.faults import refusal_of
from monitor.web.forms import Form, asked_once, read_form, whole_number
from monitor.web.pages.fleet import ASKED as FLEET
from monitor.web.pages.refused import RefusedForm, led_back, led_back_to_the_form, refused_form
from monitor.web.pages.shown_runs import WARMTHS, ShownRuns
from monitor.web.rendering import page
from monitor.web.sending import attachment
from monitor.web.ticket import Ticket

if TYPE_CHECKING:
    from monitor.workflow.history.values import ValuesAnswer
    from monitor.workflow.trend.answer import TrendAnswer

#: So long the script's question for the table of all parameters is held before it has to ask again.
FETCH_S = 20.0
#: The ends of two periods as their boxes call them.
BOXES = {
    "since_1": "Earlier: from",
    "until_1": "Earlier: to, whole day",
    "since_2": "Later: from",
    "until_2": "Later: to, whole day",
}
#: Usual kinds of events; any word is one.
KINDS = ("crash", "repair", "compensation", "probe", "note")


def routes() -> APIRouter:
    """Return the routes of the page, its download and its form."""
    router = APIRouter()

    @router.get("/machine")
    def machine(
        request: Request, name: str, parameter: str = "", since: str = "", until: str = "",
        colour: str = GROUPINGS[0], campaign: str = "", method: str = "", warm_up: str = "", every: bool = False,
    ) -> Response:  # fmt: skip
        """Show a machine; one parameter, one period; with ``every`` the table of all parameters at once."""
        ask, user = request.app.state.asker, request.state.user
        if colour not in GROUPINGS:
            raise InputError(f"runs are coloured by {', '.join(GROUPINGS)}, not by '{colour}'")
        shown_runs = ShownRuns.typed(since, until, campaign, method, warm_up)
        trends = _Trends(request, shown_runs.trend_document(name), parameter)
        # The whole history, of which a period is cut: it is read once and held for every period that is looked at.
        values: ValuesAnswer = ask(user, "values", {"machine": name})
        is_unidentified = (
            not values.parameters
            or values.newer_versions is not None
            or (campaign and campaign not in values.campaign)
        )
        if is_unidentified and trends.of_all() is not None:
            # The trend has identified what nobody had identified before: both are then of one version.
            values = ask(user, "values", {"machine": name})
        methods = sorted(set(shown_runs.within(values).method))
        values = shown_runs.of(values)
        names = list(values.parameters)
        _check_names(values, parameter, campaign, may_lack=trends.waiting is not None)
        shown = (parameter or _most_urgent(request, name, names)) if names else ""
        listed = ask(user, "campaigns", {"machine": name})
        events = ask(user, "events", {"machine": name}).events
        trend = trends.shown(shown)
        all_trends = trends.of_all() if every else trends.of_all_already()
        form = refused_form(request, request.query_params.get("refused", ""))
        return page(
            request, "machine.html", status=form.refusal.status if form else 200,
            name=name, parameter=shown, parameters=names, topology=values.topology, values=values, trend=trend,
            statement=None if trend is None else trend.parameters.get(shown),
            every=all_trends if shown else None, waiting=trends.waiting,
            season_not_told=SEASON_NOT_TOLD, drift_or_season=DRIFT_OR_SEASON,
            chart=trend_chart(values, shown, trend, colour) if shown else None,
            unlisted=groups_without_legend(values, shown, colour), groupings=GROUPINGS,
            colour=colour, shown_runs=shown_runs, campaigns=listed.campaigns, copied=listed.copied,
            noted=listed.noted, events=events, kinds=KINDS, methods=methods, warmths=WARMTHS, refused=form,
        )  # fmt: skip

    router.get("/machine/values.csv")(_values_csv)
    router.get("/machine/parameters")(_table_of_all)
    router.get("/machine/periods")(_two_periods)
    router.post("/machine/event/withdraw")(_withdraw_event)

    @router.post("/machine/event")
    async def event(request: Request) -> Response:
        """Record what happened to a machine."""
        async with read_form(request) as form:
            machine = form.text("machine")
        try:
            document = {"machine": machine, **_event_document(form)}
            at = typed_moment("when it happened", form.text("at"))
            await asked_once(request, form, "event", {**document, "at": at.isoformat()})
        except NotFoundError:
            raise
        except InputError as error:
            # A time in the future, or of no calendar: what happened need not be written once more.
            refused = RefusedForm(refusal_of(error), form.texts)
            return led_back_to_the_form(request, refused, "/machine", {"name": machine}, "event")
        return led_back(request, "/machine", {"name": machine}, "events")

    return router


async def _withdraw_event(request: Request) -> Response:
    """Let an event count no longer."""
    async with read_form(request) as form:
        machine, number = form.text("machine"), whole_number("number", form.text("number"))
    document = {"machine": machine, "number": number, "reason": form.texts.get("reason", "")}
    await asked_once(request, form, "withdraw event", document)
    return led_back(request, "/machine", {"name": machine}, "events")


def _event_document(form: Form) -> dict[str, Any]:
    """What the form says of an event besides its moment. Raises InputError for one without words."""
    if not form.texts.get("text"):
        raise InputError("say in words what happened, for example 'B axis encoder changed'")
    confirmed = {"before_runs": True} if form.texts.get("before_runs") else {}
    return {"text": form.text("text"), **form.filled("kind"), **confirmed}


def _values_csv(
    request: Request, name: str,
    since: str = "", until: str = "", campaign: str = "", method: str = "", warm_up: str = "",
) -> Response:  # fmt: skip
    """Send the values of the runs that the page shows, a row a run, units in the column names."""
    shown_runs = ShownRuns.typed(since, until, campaign, method, warm_up)
    values: ValuesAnswer = request.app.state.asker(request.state.user, "values", {"machine": name})
    return attachment(f"{name}.csv", _csv(shown_runs.of(values)).encode("utf-8"))


async def _table_of_all(
    request: Request, name: str, parameter: str = "",
    since: str = "", until: str = "", campaign: str = "", method: str = "", warm_up: str = "",
) -> Response:  # fmt: skip
    """Send the table of all parameters, which the page asks for when it is scrolled to; 202 until it is there, 409
    where somebody took the question back."""
    desk: Desk = request.app.state.desk
    shown_runs = ShownRuns.typed(since, until, campaign, method, warm_up)
    ticket = await run_in_threadpool(desk.ask, request.state.user, "trend", shown_runs.trend_document(name))
    await ticket.settled(FETCH_S)
    if ticket.is_taken_back:
        return JSONResponse({}, 409)
    if not ticket.is_done:
        return JSONResponse({}, 202)
    values = await run_in_threadpool(request.app.state.asker, request.state.user, "values", {"machine": name})
    return page(
        request, "parameters.html",
        topology=values.topology, name=name, parameter=parameter, shown_runs=shown_runs, every=ticket.answer(),
    )  # fmt: skip


class _Trends:
    """The trends of a page: of its one parameter, and of all where they are answered already or asked for.

    All parameters take some five times as long as one, and share the processor with whoever asks next: they are
    computed for whoever scrolls to their table.
    """

    def __init__(self, request: Request, asked: dict[str, Any], parameter: str) -> None:
        self._user, self._desk, self._asked = request.state.user, request.app.state.desk, asked
        self.waiting: Ticket | None = None
        self._one: Ticket | None = None
        self._all: Ticket | None = self._desk.standing("trend", asked)
        if parameter and (self._all is None or not self._all.is_done):
            self._one = self._of_one(parameter)

    def _of_one(self, parameter: str) -> Ticket:
        ticket: Ticket = self._desk.ask(self._user, "trend", {**self._asked, "parameter": parameter})
        return ticket

    def of_all(self) -> TrendAnswer | None:
        """Return the trends of all parameters, None while they are computed."""
        if self._all is None:
            self._all = self._desk.ask(self._user, "trend", self._asked)
        return self._taken(self._all)

    def of_all_already(self) -> TrendAnswer | None:
        """Return the trends of all parameters where they need not be computed."""
        if self._all is None or not self._all.is_done:
            return None
        return self._taken(self._all)

    def shown(self, parameter: str) -> TrendAnswer | None:
        """Return what there is of a parameter (empty: the machine has none), None while it is computed."""
        if not parameter or (self._all is not None and self._all.is_done):
            return self.of_all()
        if self._one is None:
            self._one = self._of_one(parameter)
        return self._taken(self._one)

    def _taken(self, ticket: Ticket) -> TrendAnswer | None:
        """The answer of a ticket; None while it is computed, which is noted."""
        answer: TrendAnswer | None = ticket.answer()
        if answer is None:
            self.waiting = self.waiting or ticket
        return answer


def _two_periods(
    request: Request,
    name: str,
    since_1: str = "",
    until_1: str = "",
    since_2: str = "",
    until_2: str = "",
) -> Response:
    """Show two periods of a machine side by side; dates belong to the period whole."""
    typed = {"since_1": since_1, "until_1": until_1, "since_2": since_2, "until_2": until_2}
    ends, faults = _typed_ends(typed)
    answer, refusal, chart = None, "", None
    ask, user = request.app.state.asker, request.state.user
    if faults and any(typed.values()):
        refusal = "; ".join(faults)
    elif not faults:
        try:
            pair = {
                of: _whole_days(of, ends[f"since_{number}"], ends[f"until_{number}"])
                for number, of in ((1, "earlier"), (2, "later"))
            }
            answer = ask(user, "periods", {"machine": name, **pair})
        except MonitorError as error:
            refusal = str(error)
        chart = None if answer is None else periods_chart(answer)
    values: ValuesAnswer = ask(user, "values", {"machine": name})
    days = [f"{at:%Y-%m-%d}" for at in values.started_at]
    return page(
        request, "periods.html", status=400 if refusal else 200,
        name=name, topology=values.topology, boxes=BOXES, ends=ends, answer=answer, refusal=refusal, chart=chart,
        first=min(days, default=""), last=max(days, default=""),
    )  # fmt: skip


def _check_names(values: ValuesAnswer, parameter: str, campaign: str, *, may_lack: bool) -> None:
    """Raise NotFoundError for names that the period lacks; while it is being identified it ``may_lack`` a campaign."""
    machine, names = values.machine, list(values.parameters)
    if campaign and not values.run and not may_lack:
        raise NotFoundError(
            f"machine {machine} has no identified run of campaign '{campaign}' in this period"
        )
    if parameter and names and parameter not in names:
        raise NotFoundError(
            f"machine {machine} has no parameter '{parameter}' here; it has {', '.join(names)}"
        )


def _typed_ends(typed: dict[str, str]) -> tuple[dict[str, str], list[str]]:
    """The ends of two periods as ISO 8601 writes them, empty where none can be read; and what is wrong, by its box."""
    ends, faults = dict.fromkeys(typed, ""), []
    for field, text in typed.items():
        label = BOXES[field].lower()
        try:
            ends[field] = as_iso(**{field: text})[field]
            if not ends[field]:
                faults.append(f"'{label}' is empty: two periods need a first and a last day each")
        except InputError:
            faults.append(f"'{label}' is a day, such as 2026-03-02 or 02.03.2026, not '{text[:40]}'")
    return ends, faults


def _whole_days(of: str, since: str, until: str) -> dict[str, str]:
    """The period from the beginning of one day to the end of another. Raises InputError for one that ends before."""
    first, last = date.fromisoformat(since), date.fromisoformat(until)
    if last < first:
        raise InputError(
            f"the {of} period ends on {last}, before its first day {first}: change one of the two"
        )
    try:
        end = last + timedelta(days=1)
    except OverflowError as error:
        raise InputError(f"no calendar has a day after {last}") from error
    return {"since": f"{first}T00:00:00Z", "until": f"{end}T00:00:00Z"}


def _most_urgent(request: Request, name: str, names: list[str]) -> str:
    """The parameter that the fleet names first, where that is computed already; else the first by name."""
    # Not asked here: of a large fleet that is seconds of work, beside which everybody waits for the page of a machine.
    ticket = request.app.state.desk.answered_last(*FLEET)
    answer = None if ticket is None else ticket.answer()
    rows = () if answer is None else answer.table
    return next((row.parameter for row in rows if row.machine == name and row.parameter in names), names[0])


def _csv(values: ValuesAnswer) -> str:
    text = io.StringIO()
    writer = csv.writer(text)
    columns = [(name, series) for name, series in values.parameters.items()]
    writer.writerow(
        ["started_at", "campaign", "method", "run", "day", "warm_up"]
        + [
            title
            for name, series in columns
            for title in (f"{name} / {series.unit}", f"u({name}) / {series.unit}")
        ]
        + list(values.conditions)
    )
    for row, at in enumerate(values.started_at):
        cells = [_cell(value) for _, series in columns for value in (series.values[row], series.u[row])]
        cells += [_cell(column[row]) for column in values.conditions.values()]
        writer.writerow(
            [
                at.isoformat(),
                values.campaign[row],
                values.method[row],
                values.run[row],
                values.day[row],
                str(values.warm_up[row]).lower(),
                *cells,
            ]
        )
    return text.getvalue()


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value)
