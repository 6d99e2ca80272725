"""Reads the form of a page: only with the proof that it is one of ours, and its texts stripped.

What a form held that comes too late (its session has ended) goes back to whoever filled it in, to be sent again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile
from starlette.requests import Request

from monitor.exceptions import InputError
from monitor.readers.archive import UploadedFile
from monitor.web.asking import ForbiddenError
from monitor.web.sessions import Sessions

PROOF = "proof"
#: Drawn anew for every page: by it the same form sent twice is known.
ONCE = "once"
#: The field of the file that says what the columns of the others are.
MAPPING = "mapping"
#: What a form carries besides what people fill in.
CARRIED = frozenset({PROOF, ONCE})


@dataclass(frozen=True)
class Typed:
    """What a form held that was not taken: where it was ``sent_to``, its texts, whether files came along."""

    sent_to: str
    texts: tuple[tuple[str, str], ...] = ()
    with_files: bool = False

    @property
    def filled(self) -> tuple[tuple[str, str], ...]:
        """Return the texts that are not empty."""
        return tuple((name, text) for name, text in self.texts if text.strip())

    def document(self) -> str:
        """Return it as a text that a form can carry."""
        return json.dumps([self.sent_to, self.texts, self.with_files])

    @classmethod
    def of_document(cls, text: str) -> Typed | None:
        """Return what ``document`` wrote; None for any other text."""
        try:
            sent_to, texts, with_files = json.loads(text)
            return cls(
                own_address(str(sent_to)),
                tuple((str(name), str(value)) for name, value in texts),
                bool(with_files),
            )
        except (ValueError, TypeError, RecursionError):
            return None


class StaleFormError(ForbiddenError):
    """A form without the proof of its session; ``typed`` is what it held."""

    def __init__(self, typed: Typed) -> None:
        super().__init__(
            "this form is too old, or not one of this server's pages: nothing was done; look at what it says and "
            "send it again"
        )
        self.typed = typed


@dataclass(frozen=True)
class Form:
    """The texts and files of a form, and a ``mapping`` of the files where one came along.

    ``press`` is the same where the same page was sent twice with the same texts.
    """

    texts: dict[str, str]
    files: tuple[UploadedFile, ...]
    press: str = ""
    mapping: UploadedFile | None = None

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
    """Yield the form of a request. Raises StaleFormError without the proof of its session (CSRF)."""
    async with request.form(max_files=2000, max_fields=200) as form:
        yield _checked(request, form)


def _checked(request: Request, form: FormData) -> Form:
    sessions: Sessions = request.app.state.sessions
    session, proof = request.state.session, form.get(PROOF)
    if session is None or not isinstance(proof, str) or not sessions.is_proof(session, proof):
        raise StaleFormError(typed_of(request.url.path, form))
    uploads = [
        (name, UploadedFile(part.filename or "", part.file))
        for name, part in form.multi_items()
        if isinstance(part, UploadFile) and part.filename
    ]
    files = tuple(file for name, file in uploads if name != MAPPING)
    mapping = next((file for name, file in uploads if name == MAPPING), None)
    texts = {
        name: value.strip()
        for name, value in form.multi_items()
        if isinstance(value, str) and name not in CARRIED
    }
    return Form(texts, files, _press(request, session, form.get(ONCE), texts), mapping)


async def asked_once(request: Request, form: Form, question: str, document: dict[str, Any]) -> Any:
    """Ask what a form asks for; the same form sent twice has the answer of the first time. Raises as the question."""

    def ask() -> Any:
        return request.app.state.asker(request.state.user, question, document)

    return await run_in_threadpool(request.app.state.presses.once, form.press, ask)


def typed_of(sent_to: str, form: FormData) -> Typed:
    """Return what a form holds that people filled in."""
    texts = tuple(
        (name, value) for name, value in form.multi_items() if isinstance(value, str) and name not in CARRIED
    )
    files = any(isinstance(part, UploadFile) and part.filename for _, part in form.multi_items())
    return Typed(sent_to, texts, files)


def _press(request: Request, session: str, once: object, texts: dict[str, str]) -> str:
    if not isinstance(once, str) or not once:
        return ""
    content = json.dumps([session, request.url.path, once, sorted(texts.items())])
    return hashlib.sha256(content.encode("utf-8", "surrogatepass")).hexdigest()


def whole_number(name: str, text: str, digits: int = 9) -> int:
    """Return the number that a field of a form holds. Raises InputError for another text."""
    if not text.isdecimal() or len(text) > digits:
        raise InputError(f"'{name}' is a whole number, such as 20, not '{text}'")
    return int(text)


def own_address(address: str) -> str:
    """Return an address of this server, the first page for any other.

    A browser leaves out tabs and ends of lines: "/<tab>/elsewhere" would be the address of another server.
    """
    is_own = address.startswith("/") and not address.startswith(("//", "/\\")) and address.isprintable()
    return address if is_own else "/"
