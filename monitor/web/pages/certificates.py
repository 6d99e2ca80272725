"""Certificates: listed, shown, sent as they were issued, and verified."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from monitor.exceptions import InputError, MonitorError
from monitor.web.asking import Asker, check_role
from monitor.web.faults import Refusal, refusal_of
from monitor.web.forms import Form, asked_once, read_form
from monitor.web.rendering import link, page
from monitor.web.users import User

if TYPE_CHECKING:
    from monitor.workflow.certificate.answer import VerificationAnswer


#: Letters of the name of a file that is checked: file systems take 255 bytes.
NAME_LETTERS = 60
#: Campaigns that the form offers to issue a certificate of: the latest.
OFFERED = 200


def routes() -> APIRouter:
    """Return the routes of the list, the documents and the check."""
    router = APIRouter()

    @router.get("/certificates")
    def certificates(request: Request, checked: str = "") -> Response:
        """List the certificates; below the outcome of a check where one was made."""
        if not checked:
            return _listed(request)
        outcome = request.app.state.outcomes.outcome_of(request.state.user.name, checked)
        if outcome is None:
            outcome = Refusal(404, "what this check led to is not held any more: choose the file again")
        if isinstance(outcome, Refusal):
            return _listed(request, outcome.status, refusal=outcome)
        return _listed(request, verification=outcome)

    @router.get("/certificate.pdf")
    def document(request: Request, number: str) -> Response:
        """Send the document of a certificate, as it was issued, to be looked at."""
        return _sent(request, "issued certificate", number, "application/pdf")

    @router.get("/certificate.xml")
    def digital(request: Request, number: str) -> Response:
        """Send the digital calibration certificate."""
        return _sent(request, "digital certificate", number, "application/xml")

    @router.post("/certificates/verify")
    async def verify(request: Request) -> Response:
        """Check a file: is it what was issued, and does it hold?"""
        async with read_form(request) as form:
            outcome = await run_in_threadpool(
                _verified, request.app.state.asker, request.state.user, form, request.app.state.working_folder
            )
        key = request.app.state.outcomes.hold(request.state.user.name, outcome)
        return RedirectResponse(link("/certificates", checked=key), status_code=303)

    @router.post("/certificates/withdraw")
    async def withdraw(request: Request) -> Response:
        """Mark a certificate as withdrawn."""
        async with read_form(request) as form:
            document = {"number": form.text("number"), "reason": form.text("reason")}
        await asked_once(request, form, "withdraw certificate", document)
        return RedirectResponse("/certificates", status_code=303)

    return router


def _listed(request: Request, status: int = 200, **outcome: Any) -> Response:
    ask, user = request.app.state.asker, request.state.user
    answer = ask(user, "certificates")
    # Names to choose from, not all: any other can be typed.
    latest = ask(user, "campaigns", {"latest": OFFERED}).campaigns
    campaigns = [row for row in reversed(latest) if row.rows is None]
    context = {"verification": None, "refusal": None, **outcome}
    return page(
        request,
        "certificates.html",
        status=status,
        certificates=answer.certificates,
        campaigns=campaigns,
        **context,
    )


def _sent(request: Request, question: str, number: str, media_type: str) -> Response:
    with tempfile.TemporaryDirectory(dir=request.app.state.working_folder) as folder:
        answer = request.app.state.asker(
            request.state.user, question, {"number": number}, {"path": Path(folder)}
        )
        path = Path(answer.file)
        return Response(
            path.read_bytes(),
            media_type=media_type,
            headers={"Content-Disposition": f'inline; filename="{path.name}"'},
        )


def _verified(asker: Asker, user: User, form: Form, working_folder: Path) -> VerificationAnswer | Refusal:
    check_role(user, "verify certificate")
    if not form.files:
        raise InputError("choose the PDF of a certificate")
    with tempfile.TemporaryDirectory(dir=working_folder) as folder:
        # Its own name stands in what the check says of it.
        path = Path(folder, _file_name(form.files[0].name))
        path.write_bytes(form.files[0].content.read())
        try:
            answer: VerificationAnswer = asker(user, "verify certificate", {}, {"file": path})
        except MonitorError as error:
            return refusal_of(error, {f"{folder}/": ""})
        return answer


def _file_name(sent: str) -> str:
    """The name of a file that was sent, as a name within a folder of ours: of letters, digits, blanks and ``-._()``."""
    name = re.sub(r"[^\w .()-]", "_", Path(sent).name).strip(". ")[-NAME_LETTERS:]
    return name or "certificate"
