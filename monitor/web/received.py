"""A question as it came over HTTP, in any form of body, with its files in folders of the server's own.

A body is a JSON document; multipart/form-data with the files of one field beside the document; or a parcel of the
document and the files of every field (``parcel``). All of them become one ``ReceivedQuestion``, which is answered in
one way. Its ``labels`` are what texts say in the place of the server's own paths, which are gone when they are read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Annotated, Any

from fastapi import Request
from pydantic import Field, TypeAdapter, ValidationError
from starlette.datastructures import UploadFile

from monitor.exceptions import InputError
from monitor.readers.archive import LONGEST_NAME, UploadedFile, unpack, unpack_zip
from monitor.web.parcel import MEDIA_TYPE, QUESTION_FILE, last_part, travelling

_JSON, _FORM = "application/json", "multipart/form-data"
_Limit = Annotated[float, Field(gt=0.0, allow_inf_nan=False, strict=True)]
_LIMITS = TypeAdapter[Mapping[str, Mapping[str, float]] | None](dict[str, dict[str, _Limit]] | None)


@dataclass(frozen=True)
class Body:
    """A body as it came: the document or parcel as ``content``, and the ``files`` of a form."""

    media_type: str
    content: IO[bytes]
    files: tuple[UploadedFile, ...] = ()


@dataclass
class ReceivedQuestion:
    """A question with its files below ``incoming``; what it writes goes below ``outgoing``.

    ``files`` are paths by field, ``tolerances`` limits by machine type of whoever asks; an answer to a parcel
    ``is_parcel`` too.
    """

    incoming: Path
    outgoing: Path
    is_parcel: bool = False
    document: dict[str, Any] = field(default_factory=dict)
    tolerances: Mapping[str, Mapping[str, float]] | None = None
    files: dict[str, Any] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)

    def label(self, path: Path, label: str) -> None:
        """Let texts say ``label`` instead of a path, joined as pathlib does: what is in "." is named without it."""
        # Whoever sends files has no folder of that name, and reads who was refused.
        itself = "the upload" if path == self.incoming and not self.is_parcel else label
        self.labels |= {f"{path}/": "" if label == "." else f"{label.rstrip('/')}/", str(path): itself}

    @property
    def subject(self) -> Mapping[str, Any]:
        """What it is about: its document, of an import with the names of its folders."""
        folders = self.files.get("folders")
        return (
            self.document
            if folders is None
            else {**self.document, "folders": [path.name for path in folders]}
        )

    def written(self) -> list[Path]:
        """Return the files that the question wrote."""
        return sorted(path for path in self.outgoing.rglob("*") if path.is_file())


async def read_body(request: Request, question: str, content: IO[bytes]) -> Body:
    """Write the body of a request into ``content``. Raises InputError for a form that the question does not take."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    usual_type = _JSON if travelling(question).upload is None else _FORM
    if media_type not in (usual_type, MEDIA_TYPE):
        raise InputError(
            "send a JSON document with the header Content-Type: application/json"
            if usual_type == _JSON
            else f"'{question}' reads a file: send multipart/form-data with the part file, "
            "and where it takes more the part document (JSON)"
        )
    if media_type != _FORM:
        async for chunk in request.stream():
            content.write(chunk)
        return Body(media_type, content)
    form = await request.form()
    files = [
        UploadedFile(part.filename or "upload", part.file)
        for part in form.getlist("file")
        if isinstance(part, UploadFile)
    ]
    text = form.get("document", "")
    if not files or isinstance(text, UploadFile):
        raise InputError(f"'{question}' reads a file: send it as the part file of multipart/form-data")
    content.write(text.encode("utf-8", "replace"))
    return Body(media_type, content, tuple(files))


def received(question: str, body: Body, folder: Path) -> ReceivedQuestion:
    """Unpack a question below an empty folder. Raises InputError for what cannot be trusted, read or understood."""
    asked = ReceivedQuestion(folder / "in", folder / "out", body.media_type == MEDIA_TYPE)
    for room in (asked.incoming, asked.outgoing):
        room.mkdir()
        asked.label(room, ".")
    body.content.seek(0)
    if asked.is_parcel:
        unpack_zip("the parcel", body.content, asked.incoming)
        file = asked.incoming / QUESTION_FILE
        content = _parsed(f"{QUESTION_FILE} of the parcel", file.read_bytes() if file.is_file() else b"null")
        asked.tolerances = _limits(content.get("tolerances")) if isinstance(content, dict) else None
        document = content.get("document") if isinstance(content, dict) else None
    else:
        document = _parsed("the body", body.content.read() or b"{}")
    if not isinstance(document, dict):
        name = f'"document" in the {QUESTION_FILE} of the parcel' if asked.is_parcel else "the body"
        raise InputError(f'{name} must be an object such as {{"campaign": "five-days"}}')
    asked.document = document
    fields = travelling(question)
    if asked.is_parcel:
        for name in fields.incoming:
            _place(asked, name, asked.incoming / name, one_each=True)
        for name in fields.outgoing:
            (asked.outgoing / name).mkdir(parents=True, exist_ok=True)
            _place(asked, name, asked.outgoing / name, one_each=False)
    else:
        if fields.upload is not None:
            asked.files[fields.upload] = _uploaded(fields.upload, body.files, asked.incoming)
        if fields.download is not None:
            asked.files[fields.download] = asked.outgoing / (fields.file_name or "")
    return asked


def _parsed(name: str, text: bytes) -> Any:
    """Return what a text in JSON holds. Raises InputError that names it."""
    try:
        value = json.loads(text)
        json.dumps(value, ensure_ascii=False).encode("utf-8")  # half a character is refused here
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name} is no JSON document in UTF-8: {error}") from error
    return value


def _uploaded(field: str, files: Sequence[UploadedFile], folder: Path) -> Any:
    """Write the files of a form and return the paths that they are for the field: folders, or one file."""
    if field == "folders":
        return list(unpack(files, folder))
    suffix = Path(files[0].name).suffix.lower()
    path = folder / f"upload{suffix if suffix in ('.pdf', '.xml', '.toml') else ''}"
    path.write_bytes(files[0].content.read())
    return path


def _place(asked: ReceivedQuestion, name: str, folder: Path, *, one_each: bool) -> None:
    """Put paths below a folder of the server in the place of the labels of a field, in a folder each or all in one."""
    value = asked.document.pop(name, None)
    labels = value if isinstance(value, list) else [] if value is None else [value]
    for label in labels:
        if not isinstance(label, str) or len(label) > 20 * LONGEST_NAME or "\0" in label:
            raise InputError(f"'{name}' must be the path of a file, as text")
    paths = [
        (folder / str(index) if one_each else folder) / last_part(label) for index, label in enumerate(labels)
    ]
    for path, label in zip(paths, labels, strict=True):
        asked.label(path, label)
    if value is not None:
        asked.files[name] = paths if isinstance(value, list) else paths[0]


def _limits(tolerances: Any) -> Mapping[str, Mapping[str, float]] | None:
    try:
        return _LIMITS.validate_python(tolerances)
    except ValidationError as error:
        raise InputError(
            '"tolerances" must be limits by machine type, such as {"HU40-T": {"EC0Y": 20.0}}'
        ) from error
