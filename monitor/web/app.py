"""Puts the server together: the gate before everything, the interface, the pages, and words for what goes wrong."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from monitor.exceptions import MonitorError
from monitor.store import Database
from monitor.web.access import ROOT
from monitor.web.asking import Asker
from monitor.web.desk import Desk
from monitor.web.faults import Refusal, refusal_of
from monitor.web.forms import StaleFormError
from monitor.web.gate import Gate
from monitor.web.interface import interface
from monitor.web.opening import Copies, host_user_name
from monitor.web.outcomes import Outcomes
from monitor.web.pages import (
    campaign as campaign_page,
    certificates,
    fleet as fleet_page,
    importing,
    issuing,
    keeping,
    machine as machine_page,
    model,
    plan,
    refused,
    reports,
    visiting,
    volumetric,
)
from monitor.web.presses import Presses
from monitor.web.previews import Previews
from monitor.web.rendering import again_page, refusal_page
from monitor.web.sessions import Sessions
from monitor.web.settings import ServerSettings
from monitor.web.static import static_routes
from monitor.web.users import Role, User, UserFile

_log = logging.getLogger("monitor.web")
_PAGES = (
    fleet_page,
    machine_page,
    campaign_page,
    model,
    volumetric,
    plan,
    importing,
    certificates,
    issuing,
    reports,
    keeping,
    visiting,
    refused,
)


def application(
    db: Database, settings: ServerSettings, working_folder: Path,
    copies: Copies | None = None,
) -> Gate:  # fmt: skip
    """Return the server of an open database; ``copies`` as in ``Served``. Raises InputError for a file of users that is
    wrong."""
    role = Role.VIEWER if settings.reading_only else Role.APPROVER
    users = None if settings.users is None else UserFile(settings.users, looking_only=settings.reading_only)
    # Documentation of FastAPI's own would load scripts from elsewhere; the interface describes itself.
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    db.type_tolerances = settings.tolerances
    asker = Asker(db, settings.trusted_signers, copies)
    app.state.settings = settings
    app.state.sessions = Sessions(users, User(host_user_name(), role))
    app.state.asker = asker
    desk = Desk(asker)
    app.state.desk = desk
    app.state.import_patience_s = importing.PATIENCE_S
    app.state.outcomes = Outcomes()
    app.state.previews = Previews()
    app.state.presses = Presses()
    app.state.working_folder = working_folder
    app.include_router(static_routes())
    app.include_router(interface(desk, working_folder))
    for room in _PAGES:
        app.include_router(room.routes())
    app.add_exception_handler(HTTPException, _of_http)
    app.add_exception_handler(RequestValidationError, _of_address)
    app.add_exception_handler(StaleFormError, _of_stale_form)
    app.add_exception_handler(MonitorError, _of_question)
    app.add_exception_handler(Exception, _of_question)
    # Around everything, what answers a fault of the software included.
    return Gate(app, settings, app.state.sessions, desk)


async def _of_http(request: Request, error: Exception) -> Response:
    """Answer what has no page, or not with this method."""
    assert isinstance(error, HTTPException)
    text = {
        404: f"there is no page {request.url.path}; the first page is /",
        405: f"{request.url.path} is not asked with {request.method}: a form is sent there; the first page is /",
    }.get(error.status_code, str(error.detail))
    return _refused(request, Refusal(error.status_code, text))


async def _of_address(request: Request, error: Exception) -> Response:
    """Answer an address that lacks a part, or has one of another kind."""
    assert isinstance(error, RequestValidationError)
    faults = "; ".join(_fault_of_address(fault) for fault in error.errors())
    return _refused(request, Refusal(400, f"the address {request.url.path} is not complete: {faults}"))


def _fault_of_address(fault: Any) -> str:
    name = fault["loc"][-1]
    if fault["type"] == "missing":
        return f"it lacks '{name}'; the first page leads to what there is"
    # What the address holds is not repeated: a link could make a page say anything.
    return f"'{name}': {str(fault['msg'])[:1].lower()}{str(fault['msg'])[1:]}"


async def _of_stale_form(request: Request, error: Exception) -> Response:
    """Show what a form held that is of another session, with the proof of this one, to be sent once more."""
    assert isinstance(error, StaleFormError)
    return again_page(request, error.typed, str(error), 403)


async def _of_question(request: Request, error: Exception) -> Response:
    """Answer what a question raised."""
    refusal = refusal_of(error)
    if refusal.status == 500:
        _log.error("a page failed", exc_info=error)
    if refused.leads_to_its_refusal(request, refusal):
        return refused.led_to_its_refusal(request, refusal)
    return _refused(request, refusal)


def _refused(request: Request, refusal: Refusal) -> Response:
    if request.url.path.startswith(ROOT):
        return JSONResponse({"error": refusal.error}, refusal.status)
    return refusal_page(request, refusal)
