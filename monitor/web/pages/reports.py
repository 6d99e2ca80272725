"""The health reports by week: the state of every machine at the end of a week, as a table, as PDF and as HTML."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from monitor.exceptions import InputError
from monitor.store import CampaignRow
from monitor.web.rendering import link, page
from monitor.web.sending import attachment
from monitor.web.ticket import Ticket

if TYPE_CHECKING:
    from monitor.workflow.health.request import ReportAnswer

#: Weeks that are listed, the latest first.
MOST_WEEKS = 60


def routes() -> APIRouter:
    """Return the routes of the page and of its files."""
    router = APIRouter()

    @router.get("/reports")
    def reports(request: Request, week: str = "", machine: str = "") -> Response:
        """List the weeks with runs; show the report of one."""
        answer, refusal, waiting = None, "", None
        if week:
            answer, refusal, waiting = _asked(request, week, machine).outcome()
        campaigns = request.app.state.asker(request.state.user, "campaigns").campaigns
        return page(
            request, "reports.html",
            weeks=_weeks(campaigns), machines=sorted({row.machine for row in campaigns if row.rows is None}),
            week=week, machine=machine, answer=answer, refusal=refusal,
            waiting=waiting,
        )  # fmt: skip

    @router.get("/report")
    def report(
        request: Request, week: str, format: str = "pdf", machine: str = "", part: int = 0
    ) -> Response:
        """Send a file of a report; where it is not there yet, show the page that computes it."""
        if format not in ("pdf", "html"):
            raise InputError(f"a report comes as pdf or html, not as {format}")
        answer: ReportAnswer | None = _asked(request, week, machine).answer()
        if answer is None:
            return RedirectResponse(link("/reports", week=week, machine=machine or None), status_code=303)
        files = [Path(name) for name in answer.files if name.endswith(f".{format}")]
        if not 0 <= part < len(files):
            raise InputError(f"this report has {len(files)} files of this kind; there is no part {part}")
        return attachment(files[part].name, files[part].read_bytes())

    return router


def _asked(request: Request, week: str, machine: str) -> Ticket:
    """The ticket of a report; its files stay in a folder of the server's own as long as it runs."""
    document = {"week": week, **({"machine": machine} if machine else {})}
    desk = request.app.state.desk
    name = "".join(letter if letter.isalnum() else "_" for letter in f"{week} {machine}")
    stamp = "-".join(map(str, desk.asker.freshness.stamp("report", document)))
    folder = Path(request.app.state.working_folder, "reports", f"{stamp} {name}"[:120])
    ticket: Ticket = desk.ask(request.state.user, "report", document, {"out": folder, "workers": 1})
    return ticket


def _weeks(campaigns: Iterable[CampaignRow]) -> list[tuple[str, int]]:
    """The weeks in which campaigns were begun or ended, the latest first, and how many."""
    counts: Counter[str] = Counter()
    for row in campaigns:
        days = {str(moment)[:10] for moment in (row.first_run_at, row.last_run_at) if moment}
        counts.update({_week(date.fromisoformat(day)) for day in days})
    return sorted(counts.items(), reverse=True)[:MOST_WEEKS]


def _week(day: date) -> str:
    year, week, _ = day.isocalendar()
    return f"{year}-W{week:02d}"
