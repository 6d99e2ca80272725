"""Import by upload: the folder of a campaign or a zip of it, all or nothing, every fault with file, line, column."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from monitor.exceptions import MonitorError
from monitor.readers.archive import unpack
from monitor.web.asking import Asker, check_role
from monitor.web.faults import Refusal, refusal_of
from monitor.web.forms import Form, read_form
from monitor.web.rendering import page
from monitor.web.users import User

if TYPE_CHECKING:
    from monitor.workflow.intake.importing import ImportAnswer


def routes() -> APIRouter:
    """Return the routes of the form and of the upload."""
    router = APIRouter()

    @router.get("/import")
    def form(request: Request) -> Response:
        """Show the form."""
        return page(request, "import.html", answer=None, refusal=None)

    @router.post("/import")
    async def upload(request: Request) -> Response:
        """Import what was uploaded, or show what is wrong with it."""
        async with read_form(request) as form:
            outcome = await run_in_threadpool(
                _imported, request.app.state.asker, request.state.user, form, request.app.state.working_folder
            )
        if isinstance(outcome, Refusal):
            return page(request, "import.html", status=outcome.status, answer=None, refusal=outcome)
        return page(request, "import.html", answer=outcome, refusal=None)

    return router


def _imported(asker: Asker, user: User, form: Form, working_folder: Path) -> ImportAnswer | Refusal:
    check_role(user, "import")
    with tempfile.TemporaryDirectory(dir=working_folder) as folder:
        try:
            folders = list(unpack(form.files, Path(folder)))
            answer: ImportAnswer = asker(user, "import", {}, {"folders": folders})
        except MonitorError as error:
            return refusal_of(error, {f"{folder}/": "", folder: "the upload"})
        return answer
