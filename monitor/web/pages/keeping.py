"""What was done and by whom, what is computed now, and everything to take along."""

from __future__ import annotations

import io
import re
import tempfile
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, RedirectResponse, Response

from monitor.web.access import address_of, offered, role_needed
from monitor.web.desk import Desk
from monitor.web.forms import own_address, read_form, whole_number
from monitor.web.parcel import packed
from monitor.web.rendering import link, page
from monitor.web.sending import attachment
from monitor.web.words import importing, so_far
from monitor.workflow.contract import QUESTIONS

#: Entries of the audit on its page.
ENTRIES = 200
#: Digits of the number of what is being computed.
DIGITS = 15
#: So long the question whether work is still under way is held; then the page writes how long it took so far.
HELD_S = 2.0


def routes() -> APIRouter:
    """Return the routes of the audit, the work under way, the export and the interface's list."""
    router = APIRouter()

    @router.get("/audit")
    def audit(request: Request, containing: str = "", last: int = ENTRIES) -> Response:
        """List who changed what and when; only what holds all words of ``containing``."""
        answer = request.app.state.asker(
            request.state.user, "audit", {"last": last, "containing": containing}
        )
        # One full list may be followed by more.
        more = 5 * last if len(answer.entries) == last else None
        return page(request, "audit.html", entries=answer.entries, containing=containing, more=more)

    @router.get("/work")
    def work(request: Request) -> Response:
        """List what is being computed."""
        return page(request, "work.html", tickets=request.app.state.desk.under_way())

    router.get("/work/state")(_state)

    @router.post("/work/cancel")
    async def cancel(request: Request) -> Response:
        """Take back a question that waits or is being computed; an import has a page that says where it stopped."""
        async with read_form(request) as form:
            number = whole_number("number", form.text("number"), DIGITS)
        ticket = request.app.state.desk.take_back(request.state.user, number)
        address = link("/import/under-way", number=number) if ticket.has_page else "/work"
        return RedirectResponse(address, status_code=303)

    @router.post("/work/again")
    async def again(request: Request) -> Response:
        """Let a question that was taken back be asked again, by the page that needs it."""
        async with read_form(request) as form:
            number = whole_number("number", form.text("number"), DIGITS)
            page_of_it = form.text("then")
        request.app.state.desk.ask_again(number)
        return RedirectResponse(own_address(page_of_it), status_code=303)

    @router.get("/export")
    def export(request: Request, format: str = "csv", machine: str = "") -> Response:
        """Send every table as CSV or Parquet, packed, or as a workbook; of one machine alone where it is named."""
        with tempfile.TemporaryDirectory(dir=request.app.state.working_folder) as folder:
            target = Path(folder, "export")
            document = {"format": format, **({"machine": machine} if machine else {})}
            answer = request.app.state.asker(request.state.user, "export", document, {"folder": target})
            if format == "xlsx":
                return attachment(f"{machine or 'monitor'}.xlsx", answer.files[0].read_bytes())
            archive = io.BytesIO()
            packed(sorted(path for path in target.rglob("*") if path.is_file()), Path(folder), archive)
        return attachment(f"{machine or 'export'}-{format}.zip", archive.getvalue())

    @router.get("/interface")
    def interface_list(request: Request) -> Response:
        """List the questions of the HTTP interface."""
        questions = [
            (
                name,
                address_of(name),
                role_needed(name).word,
                _said(QUESTIONS[name].load().__doc__ or ""),
            )
            for name in offered()
        ]
        return page(request, "interface.html", questions=questions)

    return router


async def _state(request: Request, number: int) -> Response:
    """Say whether work is under way still (202) or not (200): a page that waits asks this and is not made anew."""
    desk: Desk = request.app.state.desk
    ticket = next((ticket for ticket in desk.under_way() if ticket.number == number), None)
    if ticket is not None:
        await ticket.settled(ticket.seconds + HELD_S)
    if ticket is None or ticket.future.done():
        return JSONResponse({}, 200)
    at_folder = {"at": importing(ticket), "done": len(ticket.said) - 1} if ticket.said else {}
    return JSONResponse({"so_far": so_far(ticket), **at_folder}, 202)


def _said(docstring: str) -> str:
    """The first line of a docstring as people read it: without its marks, and without what it raises."""
    line = docstring.strip().partition("\n")[0]
    return re.sub(r" ?Raises .*$", "", line).replace("``", "").replace("`", "")
