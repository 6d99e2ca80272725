"""Import by upload: the folder of a campaign or a zip of it, all or nothing, every fault with file, line, column.

Files of instruments come with the mapping that explains their columns. What was understood can be looked at first.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from monitor.exceptions import InputError, MonitorError, NotFoundError
from monitor.readers import MAPPING as FILE
from monitor.readers.archive import UploadedFile, unpack, unpack_files
from monitor.web.asking import check_role
from monitor.web.desk import Desk
from monitor.web.faults import Refusal, refusal_of
from monitor.web.forms import Form, read_form
from monitor.web.rendering import link, page
from monitor.web.ticket import Ticket

if TYPE_CHECKING:
    from monitor.workflow.intake.importing import ImportAnswer

#: An upload is answered at once if its import takes no longer; else a page shows how far it is.
PATIENCE_S = 1.0
#: Imports that are over and still named.
LATEST = 5


def routes() -> APIRouter:
    """Return the routes of the form and of the upload."""
    router = APIRouter()

    @router.get("/import")
    def form(request: Request) -> Response:
        """Show the form."""
        return _shown(request, None)

    @router.post("/import")
    async def upload(request: Request) -> Response:
        """Import what was uploaded, or show what is wrong with it."""
        check_role(request.state.user, "import")
        async with read_form(request) as form:
            ticket = await run_in_threadpool(_begun, request, form)
        # A quick one is done when its page is asked for, which then need not load itself again.
        await ticket.settled(request.app.state.import_patience_s)
        return RedirectResponse(link("/import/under-way", number=ticket.number), status_code=303)

    @router.get("/import/under-way")
    def under_way(request: Request, number: int) -> Response:
        """Show how far an import is, and what it led to once it is done; loaded again it shows the same."""
        try:
            ticket = request.app.state.desk.begun(request.state.user, number)
        except NotFoundError as error:
            return _shown(request, refusal_of(error))
        return _shown(request, ticket.answer(), ticket)

    return router


def _shown(
    request: Request, outcome: ImportAnswer | Refusal | None, ticket: Ticket | None = None
) -> Response:
    """The form, below what an import led to or how far it is."""
    refusal = outcome if isinstance(outcome, Refusal) else None
    waiting = ticket if outcome is None else None
    stopped = None if waiting is None or not waiting.is_taken_back else _stopped(waiting)
    others = [other for other in request.app.state.desk.begun_by(request.state.user) if other is not ticket]
    return page(
        request, "import.html", status=refusal.status if refusal else 200,
        answer=stopped.answer if stopped else None if refusal else outcome, refusal=refusal,
        waiting=None if stopped else waiting, stopped=stopped,
        others=[*(other for other in others if not other.future.done()),
                *[other for other in others if other.future.done()][:LATEST]],
    )  # fmt: skip


@dataclass(frozen=True)
class _Stopped:
    """An import that was taken back by somebody: the ``answer`` of the folders before, and those ``not_imported``."""

    by: str
    answer: ImportAnswer | None
    not_imported: tuple[str, ...]


def _stopped(ticket: Ticket) -> _Stopped:
    """What an import did that was taken back; one that had not begun yet did nothing."""
    # Loaded where it is met: whoever opens the first page waits for what is loaded before.
    from monitor.workflow.intake.importing import StoppedImportError

    error = None if ticket.future.cancelled() else ticket.future.exception()
    if not isinstance(error, StoppedImportError):
        return _Stopped(ticket.taken_back_by, None, tuple(ticket.document["folders"]))
    names = tuple(Path(folder).name for folder in error.not_imported)
    return _Stopped(ticket.taken_back_by, error.answer, names)


def _begun(request: Request, form: Form) -> Ticket:
    """Begin to import what came with a form; the files are unpacked before, since they go with the form."""
    state, user = request.app.state, request.state.user
    desk: Desk = state.desk
    folder = Path(tempfile.mkdtemp(dir=state.working_folder))
    try:
        document = {"dry_run": True} if form.texts.get("button") == "look" else {}
        document |= form.filled("campaign")
        files = _sent_files(form, folder)
    except MonitorError as error:
        shutil.rmtree(folder)
        refusal = _refusal(error, folder)
        return desk.begin(user, "import", {"folders": []}, lambda tell: refusal)
    except BaseException:
        shutil.rmtree(folder)
        raise
    # Files with their mapping are one campaign.
    names = [FILE] if "mapping" in files else [Path(path).name for path in files["folders"]]

    def work(tell: Callable[[str], None]) -> ImportAnswer | Refusal:
        try:
            answer: ImportAnswer = state.asker(
                user, "import", document, files, progress=lambda path: tell(Path(path).name)
            )
            return answer
        except MonitorError as error:
            return _refusal(error, folder)
        finally:
            shutil.rmtree(folder)

    ticket = desk.begin(user, "import", {"folders": names}, work)
    # Taken back before it began, nobody else removes what was unpacked.
    ticket.future.add_done_callback(lambda future: shutil.rmtree(folder, ignore_errors=True))
    return ticket


def _refusal(error: MonitorError, folder: Path) -> Refusal:
    labels: dict[str, str] = {}
    for below in (f"{folder}/files", f"{folder}/mapping", str(folder)):
        labels |= {f"{below}/": "", below: "the upload"}
    return refusal_of(error, labels)


def _sent_files(form: Form, folder: Path) -> dict[str, Any]:
    """The files of a form where an import reads them. Raises InputError."""
    if form.mapping is None:
        return {"folders": list(unpack(form.files, folder / "files"))}
    if not form.files:
        raise InputError("choose the files of the instruments beside the mapping that explains them")
    mapping = unpack_files([UploadedFile(FILE, form.mapping.content)], folder / "mapping")[0]
    return {"folders": list(unpack_files(form.files, folder / "files")), "mapping": mapping}
