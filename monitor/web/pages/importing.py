"""Import by upload: the folder of a campaign or a zip of it, all or nothing, every fault with file, line, column.

Files of instruments come with the mapping that explains their columns. What was understood can be looked at first.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from monitor.exceptions import InputError, MonitorError
from monitor.readers import MAPPING as FILE
from monitor.readers.archive import UploadedFile, unpack, unpack_files
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
            document = {"dry_run": True} if form.texts.get("button") == "look" else {}
            answer: ImportAnswer = asker(
                user, "import", document | form.filled("campaign"), _sent_files(form, Path(folder))
            )
        except MonitorError as error:
            labels: dict[str, str] = {}
            for below in (f"{folder}/files", f"{folder}/mapping", folder):
                labels |= {f"{below}/": "", below: "the upload"}
            return refusal_of(error, labels)
        return answer


def _sent_files(form: Form, folder: Path) -> dict[str, Any]:
    """The files of a form where an import reads them. Raises InputError."""
    if form.mapping is None:
        return {"folders": list(unpack(form.files, folder / "files"))}
    if not form.files:
        raise InputError("choose the files of the instruments beside the mapping that explains them")
    mapping = unpack_files([UploadedFile(FILE, form.mapping.content)], folder / "mapping")[0]
    return {"folders": list(unpack_files(form.files, folder / "files")), "mapping": mapping}
