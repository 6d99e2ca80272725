"""The HTTP interface: every question of the contract at ``POST /api/v1/QUESTION``, a document in, its answer out.

The document has the request's fields, the answer is what the command line prints with ``--json``. A question
that makes a file sends the file; one that reads a file takes it beside the document, as multipart/form-data. Question
and answer with all their files travel as a zip where the request is one (``parcel``): so asks the command line.
``GET /api/v1/openapi.json`` describes all of it, made from the same types.
"""

from __future__ import annotations

import logging
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import JSONResponse, Response

from monitor.documents import to_document
from monitor.exceptions import MonitorError
from monitor.stopping import StoppedError
from monitor.web.access import ROOT, address_of, offered, taken_fields
from monitor.web.asking import check_role
from monitor.web.desk import Desk
from monitor.web.faults import TakenBackError, by_field, refusal_of, relabelled
from monitor.web.openapi import openapi
from monitor.web.parcel import MEDIA_TYPE, packed
from monitor.web.received import Body, ReceivedQuestion, read_body, received
from monitor.web.sending import sent
from monitor.web.users import User

#: Bodies up to so many bytes stay in memory.
_SMALL = 2**20
_log = logging.getLogger("monitor.web")


def interface(desk: Desk, working_folder: Path) -> APIRouter:
    """Return the routes of every question that is offered."""
    router = APIRouter()

    @router.get(ROOT)
    def questions() -> JSONResponse:
        """List the questions."""
        return JSONResponse({"questions": {name: address_of(name) for name in offered()}})

    @router.get(f"{ROOT}/openapi.json")
    def description() -> JSONResponse:
        """Describe the interface (OpenAPI 3.1)."""
        return JSONResponse(openapi())

    for name in offered():
        router.add_api_route(address_of(name), _answering(desk, name, working_folder), methods=["POST"])
    return router


def _answering(desk: Desk, question: str, working_folder: Path) -> Any:
    async def answer(request: Request) -> Response:
        user: User = request.state.user
        try:
            check_role(user, question)
            with tempfile.SpooledTemporaryFile(max_size=_SMALL, dir=str(working_folder)) as content:
                body = await read_body(request, question, content)
                return await run_in_threadpool(_answered, desk, user, question, body, working_folder)
        except Exception as error:
            return _refused(question, error)
        finally:
            await request.close()

    return answer


def _answered(desk: Desk, user: User, question: str, body: Body, working_folder: Path) -> Response:
    with tempfile.TemporaryDirectory(dir=working_folder) as folder:
        asked = received(question, body, Path(folder))
        with desk.of_program(user, question, asked.subject) as ticket:
            try:
                answer = desk.asker(user, question, asked.document, asked.files, asked.tolerances)
            except MonitorError as error:
                return _refused(question, error, asked)
            except StoppedError as error:
                return _refused(question, TakenBackError(ticket.taken_back_by, error), asked)
        return _response(question, asked, relabelled(to_document(answer), asked.labels), working_folder)


def _refused(question: str, error: Exception, asked: ReceivedQuestion | None = None) -> JSONResponse:
    """Return a refusal as a document: ``error``, and the ``faults`` of a folder; without the server's own paths.

    The command line, which sends parcels, reads of its options; whoever sends a document reads of its fields.
    """
    refusal = refusal_of(error, {} if asked is None else asked.labels)
    if asked is None or not asked.is_parcel:
        refusal = replace(refusal, error=by_field(refusal.error, taken_fields(question)))
    if refusal.status == 500:
        _log.error("a question failed", exc_info=error)
    more = {"faults": refusal.faults, "in_full": refusal.in_full}
    return JSONResponse(
        {"error": refusal.error, **{key: text for key, text in more.items() if text}}, refusal.status
    )


def _response(question: str, asked: ReceivedQuestion, answer: Any, working_folder: Path) -> Response:
    """Return a parcel to whoever sent one; else the file that was written, a zip of several, or the document."""
    written = asked.written()
    if not written and not asked.is_parcel:
        return JSONResponse(answer)
    with tempfile.NamedTemporaryFile(dir=working_folder, delete=False) as target:
        path = Path(target.name)
        if asked.is_parcel or len(written) > 1:
            packed(written, asked.outgoing, target, answer if asked.is_parcel else None)
    if asked.is_parcel:
        return sent(path, media_type=MEDIA_TYPE)
    if len(written) > 1:
        return sent(path, f"{question.replace(' ', '-')}.zip")
    return sent(written[0].replace(path), written[0].name)
