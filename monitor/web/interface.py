"""The HTTP interface: every question of the contract at ``POST /api/v1/QUESTION``, a document in, its answer out.

The document has the request's fields, the answer is what the command line prints with ``--json``. A question
that makes a file sends the file; one that reads a file takes it beside the document, as multipart/form-data. Question
and answer with all their files travel as a zip where the request is one (``parcel``): so asks the command line.
``GET /api/v1/openapi.json`` describes all of it, made from the same types.
"""

from __future__ import annotations

import json
import logging
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

from fastapi import APIRouter, Request
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.responses import FileResponse, JSONResponse, Response

from monitor import __version__
from monitor.documents import to_document
from monitor.exceptions import InputError, MonitorError
from monitor.readers.archive import UploadedFile, unpack
from monitor.web.access import ANSWERING_WITHOUT_FILE, FILES, offered, role_needed, taken_fields
from monitor.web.asking import Asker, check_role, download_path
from monitor.web.faults import refusal_of
from monitor.web.parcel import MEDIA_TYPE, Placed, packed_answer, placed
from monitor.web.schemas import Schemas
from monitor.web.users import User
from monitor.workflow.contract import QUESTIONS

ROOT = "/api/v1"
_REFUSALS = {
    "400": "the request is wrong; the sentence says what would be right",
    "401": "no token, or one that nobody has",
    "403": "the user's role may not ask this",
    "404": "there is no such thing in the database; the sentence names what there is",
    "413": "the body is too large",
    "422": "the folder, the reading or the result was refused, with every fault",
}
_log = logging.getLogger("monitor.web")


def address_of(question: str) -> str:
    """Return the path of a question: ``add effect`` is ``/api/v1/add-effect``."""
    return f"{ROOT}/{question.replace(' ', '-')}"


def interface(asker: Asker, working_folder: Path) -> APIRouter:
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
        router.add_api_route(address_of(name), _answering(asker, name, working_folder), methods=["POST"])
    return router


def _answering(asker: Asker, question: str, working_folder: Path) -> Any:
    async def answer(request: Request) -> Response:
        user: User = request.state.user
        try:
            check_role(user, question)
            if _media_type(request) == MEDIA_TYPE:
                with tempfile.TemporaryFile(dir=working_folder) as body:
                    async for chunk in request.stream():
                        body.write(chunk)
                    return await run_in_threadpool(
                        _answered_with_files, asker, user, question, body, working_folder
                    )
            document, upload = await _body(request, question)
            return await run_in_threadpool(_answered, asker, user, question, document, upload, working_folder)
        except Exception as error:
            return refused(error)
        finally:
            await request.close()

    return answer


def refused(error: Exception, folder: str | Placed = "") -> JSONResponse:
    """Return a refusal as a document: ``error``, and the ``faults`` of a folder; without the server's own."""
    refusal = refusal_of(error)
    if refusal.status == 500:
        _log.error("a question failed", exc_info=error)
    content: dict[str, Any] = {"error": refusal.error}
    if refusal.faults:
        content["faults"] = refusal.faults
    if refusal.in_full:
        content["in_full"] = refusal.in_full
    if isinstance(folder, Placed):
        return JSONResponse(folder.told(content), refusal.status)
    return JSONResponse(_without(content, folder) if folder else content, refusal.status)


def _media_type(request: Request) -> str:
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def _body(request: Request, question: str) -> tuple[dict[str, Any], list[UploadedFile]]:
    kind = _media_type(request)
    travelling = FILES.get(question)
    if travelling is None or travelling.upload is None:
        if kind != "application/json":
            raise InputError("send a JSON document with the header Content-Type: application/json")
        return _document(await request.body()), []
    if kind != "multipart/form-data":
        raise InputError(
            f"'{question}' reads a file: send multipart/form-data with the part file, "
            "and where it takes more the part document (JSON)"
        )
    form = await request.form()
    files = [
        UploadedFile(part.filename or "upload", part.file)
        for part in form.getlist("file")
        if isinstance(part, UploadFile)
    ]
    text = form.get("document", "{}")
    if not files or isinstance(text, UploadFile):
        raise InputError(f"'{question}' reads a file: send it as the part file of multipart/form-data")
    return _document(text.encode("utf-8", "replace")), files


def _document(body: bytes) -> dict[str, Any]:
    try:
        document = json.loads(body or b"{}")
        json.dumps(document, ensure_ascii=False).encode("utf-8")  # half a character is refused here
    except (ValueError, RecursionError) as error:
        raise InputError(f"the body is no JSON document in UTF-8: {error}") from error
    if not isinstance(document, dict):
        raise InputError('the body must be an object such as {"campaign": "five-days"}')
    return document


def _answered(
    asker: Asker,
    user: User,
    question: str,
    document: Mapping[str, Any],
    upload: list[UploadedFile],
    working_folder: Path,
) -> Response:
    with tempfile.TemporaryDirectory(dir=working_folder) as folder:
        incoming, outgoing = Path(folder, "in"), Path(folder, "out")
        incoming.mkdir()
        outgoing.mkdir()
        files = {**_uploaded(question, upload, incoming), **download_path(question, outgoing)}
        try:
            answer = asker(user, question, document, files)
        except MonitorError as error:
            return refused(error, folder)
        written = sorted(path for path in outgoing.rglob("*") if path.is_file())
        if written:
            return _file(question, written, outgoing, working_folder)
        return JSONResponse(_without(to_document(answer), folder))


def _answered_with_files(
    asker: Asker, user: User, question: str, body: IO[bytes], working_folder: Path
) -> Response:
    """Answer a question that came as a parcel with a parcel."""
    body.seek(0)
    with tempfile.TemporaryDirectory(dir=working_folder) as folder:
        incoming, outgoing = Path(folder, "in"), Path(folder, "out")
        incoming.mkdir()
        outgoing.mkdir()
        asked = None
        try:
            asked = placed(question, body, incoming, outgoing)
            answer = asker(user, question, asked.document, asked.files, asked.tolerances)
        except MonitorError as error:
            return refused(error, "" if asked is None else asked)
        with tempfile.NamedTemporaryFile(dir=working_folder, suffix=".zip", delete=False) as target:
            packed_answer(asked.told(to_document(answer)), outgoing, target)
    return _sent(Path(target.name), MEDIA_TYPE)


def _sent(path: Path, media_type: str, name: str = "") -> FileResponse:
    """Send a file piece by piece and remove it: a backup does not fit into the memory."""
    headers = {"Content-Disposition": f'attachment; filename="{_plain_name(name)}"'} if name else {}
    return FileResponse(path, media_type=media_type, headers=headers, background=BackgroundTask(path.unlink))


def _uploaded(question: str, upload: list[UploadedFile], folder: Path) -> dict[str, Any]:
    travelling = FILES.get(question)
    if travelling is None or travelling.upload is None:
        return {}
    if travelling.upload == "folders":
        return {"folders": list(unpack(upload, folder))}
    suffix = Path(upload[0].name).suffix.lower()
    path = folder / f"upload{suffix if suffix in ('.pdf', '.xml', '.toml') else ''}"
    path.write_bytes(upload[0].content.read())
    return {travelling.upload: path}


def _without(value: Any, folder: str) -> Any:
    """Return a document without the server's own folder in its texts: it is gone when the answer is read."""
    if isinstance(value, str):
        return value.replace(f"{folder}/in/", "").replace(f"{folder}/out/", "").replace(folder, "")
    if isinstance(value, dict):
        return {key: _without(element, folder) for key, element in value.items()}
    return [_without(element, folder) for element in value] if isinstance(value, list | tuple) else value


def _file(question: str, written: list[Path], folder: Path, working_folder: Path) -> Response:
    """Return the one file that was written, or a zip of all."""
    with tempfile.NamedTemporaryFile(dir=working_folder, delete=False) as target:
        if len(written) > 1:
            with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
                for path in written:
                    archive.write(path, path.relative_to(folder).as_posix())
    name = f"{question.replace(' ', '-')}.zip"
    if len(written) == 1:
        name = written[0].name
        written[0].replace(target.name)
    return _sent(Path(target.name), "application/octet-stream", name)


def attachment(name: str, content: bytes) -> Response:
    """Return a file that a browser saves under its name and never shows as a page."""
    return Response(
        content,
        media_type="application/octet-stream",
        headers={"Content-Disposition": f'attachment; filename="{_plain_name(name)}"'},
    )


def _plain_name(name: str) -> str:
    return "".join(
        letter if letter.isascii() and (letter.isalnum() or letter in "-_.") else "_" for letter in name
    )


def openapi() -> dict[str, Any]:
    """Return the description of the interface, made from the types of the contract."""
    schemas = Schemas()
    paths = {address_of(name): {"post": _operation(name, schemas)} for name in offered()}
    return {
        "openapi": "3.1.0",
        "info": {"title": "machine-health-monitor", "version": __version__},
        "paths": paths,
        "components": {
            "schemas": {
                **schemas.definitions,
                "Refusal": {
                    "type": "object",
                    "properties": {
                        "error": {"type": "string"},
                        "faults": {"type": "array", "items": {"type": "string"}},
                        "in_full": {"type": "string"},
                    },
                    "required": ["error"],
                },
            },
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
        "security": [{}, {"token": []}],
    }


def _operation(question: str, schemas: Schemas) -> dict[str, Any]:
    asked, travelling = QUESTIONS[question], FILES.get(question)
    taken = taken_fields(question)
    document = (
        {"type": "object", "additionalProperties": False}
        if asked.request is None
        else schemas.request(asked.request, taken)
    )
    body: dict[str, Any] = {"application/json": {"schema": document}}
    if travelling is not None and travelling.upload is not None:
        parts = {
            "file": {"type": "array", "items": {"type": "string", "format": "binary"}},
            "document": document,
        }
        body = {
            "multipart/form-data": {"schema": {"type": "object", "properties": parts, "required": ["file"]}}
        }
    content: dict[str, Any] = {"application/json": {"schema": schemas.of(asked.answer)}}
    if travelling is not None and travelling.download is not None:
        content["application/octet-stream"] = {"schema": {"type": "string", "format": "binary"}}
        if question not in ANSWERING_WITHOUT_FILE:
            del content["application/json"]
    if travelling is not None:
        parcel = {"type": "string", "format": "binary", "description": "request.json, and files by field"}
        body[MEDIA_TYPE] = {"schema": parcel}
        content[MEDIA_TYPE] = {"schema": parcel | {"description": "answer.json, and files by field"}}
    refusal = {"application/json": {"schema": {"$ref": "#/components/schemas/Refusal"}}}
    return {
        "operationId": question.replace(" ", "_"),
        "summary": (asked.load().__doc__ or question).strip().splitlines()[0],
        "description": f"Needs the role {role_needed(question).word}.",
        "requestBody": {"required": True, "content": body},
        "responses": {
            "200": {"description": "the answer", "content": content},
            **{status: {"description": text, "content": refusal} for status, text in _REFUSALS.items()},
        },
    }
