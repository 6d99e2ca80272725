"""Reads the form of a page: only with the proof that it is one of ours, and its texts stripped."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from starlette.datastructures import FormData, UploadFile
from starlette.requests import Request

from monitor.exceptions import InputError
from monitor.readers.archive import UploadedFile
from monitor.web.asking import ForbiddenError
from monitor.web.sessions import Sessions

PROOF = "proof"


@dataclass(frozen=True)
class Form:
    """The texts and files of a form."""

    texts: dict[str, str]
    files: tuple[UploadedFile, ...]

    def text(self, name: str) -> str:
        """Return a text that the form must have. Raises InputError."""
        value = self.texts.get(name, "")
        if not value:
            raise InputError(f"the form lacks '{name}'; fill it in")
        return value

    def filled(self, *names: str) -> dict[str, Any]:
        """Return the named texts that are not empty, as a document of a question."""
        return {name: self.texts[name] for name in names if self.texts.get(name)}


@asynccontextmanager
async def read_form(request: Request) -> AsyncIterator[Form]:
    """Yield the form of a request. Raises ForbiddenError without the proof of its session (CSRF)."""
    async with request.form(max_files=2000, max_fields=200) as form:
        yield _checked(request, form)


def _checked(request: Request, form: FormData) -> Form:
    sessions: Sessions = request.app.state.sessions
    session, proof = request.state.session, form.get(PROOF)
    if session is None or not isinstance(proof, str) or not sessions.is_proof(session, proof):
        raise ForbiddenError(
            "this form is too old, or not one of this server's pages; load the page again and repeat"
        )
    files = [
        UploadedFile(part.filename or "", part.file)
        for _, part in form.multi_items()
        if isinstance(part, UploadFile) and part.filename
    ]
    texts = {
        name: value.strip() for name, value in form.multi_items() if isinstance(value, str) and name != PROOF
    }
    return Form(texts, tuple(files))


def whole_number(name: str, text: str) -> int:
    """Return the number that a field of a form holds. Raises InputError for another text."""
    if not text.isdecimal() or len(text) > 9:
        raise InputError(f"'{name}' is a whole number, such as 20, not '{text}'")
    return int(text)


def own_address(address: str) -> str:
    """Return an address of this server, the first page for any other."""
    return address if address.startswith("/") and not address.startswith(("//", "/\\")) else "/"
