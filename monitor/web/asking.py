"""Asks a question of the contract for a user: a document in, checked against the request's type, the answer out."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from monitor.exceptions import InputError, MonitorError
from monitor.stopping import Stop, is_stoppable, stoppable
from monitor.store import Database, last_identification, list_campaigns
from monitor.web.access import NOT_OFFERED, offered, role_needed, taken_fields, writes
from monitor.web.days import with_moments
from monitor.web.freshness import IDENTIFYING, REMEMBERED, Freshness
from monitor.web.opening import Copies
from monitor.web.users import User
from monitor.workflow.contract import QUESTIONS

#: Questions that take a file of trusted signers.
_OF_SIGNERS = ("verify", "verify certificate")


class ForbiddenError(MonitorError):
    """A question that the user's role may not ask."""


class ReplacedError(MonitorError):
    """The file that is served is not the one at its path any more."""


class _AnsweredError(Exception):
    """Ends a transaction of which nothing is to be stored; ``answer`` is that of its question."""

    def __init__(self, answer: Any) -> None:
        self.answer = answer


class Asker:
    """Asks questions of the served database; ``freshness`` says which answers still hold.

    ``trusted_signers`` is the server's own file of them, for whoever sends none. ``copies`` are asked instead of
    ``db``, the first of them; without them the file must stay the one that it was.
    """

    def __init__(
        self,
        db: Database,
        trusted_signers: Path | None = None,
        copies: Copies | None = None,
    ) -> None:
        self._db = db
        self._copies = copies
        self.freshness = Freshness()
        #: Set where the server ends: it stops what nobody else can take back.
        self.ending = Stop()
        self._path = os.path.abspath(db.path)
        self._file = _identity(self._path)
        self._own_files = {question: {"trusted": trusted_signers} for question in _OF_SIGNERS}

    def __call__(
        self, user: User, question: str, document: Mapping[str, Any] | None = None,
        files: Mapping[str, Any] | None = None, tolerances: Mapping[str, Mapping[str, float]] | None = None,
        *, storing: bool = True, progress: Callable[[str], None] | None = None,
    ) -> Any:  # fmt: skip
        """Return the typed answer; ``files`` are paths that the server itself fills in.

        ``tolerances`` are limits by machine type of whoever asks (None: those of the server's configuration).
        Without ``storing`` all that the question stores is undone once it is answered. ``progress`` is told what an
        import begins with.

        Raises ForbiddenError, InputError for what the request does not take, and whatever the question raises;
        StoppedError where it is taken back, or the server ends.
        """
        check_role(user, question)
        with nullcontext() if is_stoppable() else stoppable(self.ending):
            return self._answered(
                user, question, document or {}, files or {}, tolerances, storing=storing, progress=progress
            )

    def _answered(
        self, user: User, question: str, document: Mapping[str, Any], files: Mapping[str, Any],
        tolerances: Mapping[str, Mapping[str, float]] | None, *, storing: bool, progress: Callable[[str], None] | None,
    ) -> Any:  # fmt: skip
        self.follow()
        if self._copies is None and _identity(self._path) != self._file:
            # What is written from now on would go with the old file.
            raise ReplacedError(
                f"{Path(self._path).name} was replaced or removed while it is served: nothing is shown or stored "
                "until the server is stopped and started again"
            )
        if not storing:
            return self._tried(user, question, document, files)
        if question not in REMEMBERED or files or tolerances is not None:
            return self._asked(user, question, document, files, tolerances, progress)
        # The key before the copy that is asked: an older copy's answer would be remembered as that of a newer.
        key, answer = self.freshness.recall(question, document)
        if answer is None:
            answer = self._asked(user, question, document, {}, None)
            self.freshness.remember(key, answer)
        return answer

    def follow(self) -> None:
        """Answer from now on from the file as it is, where copies of it are asked; no answer of before holds then."""
        if self._copies is not None:
            self._copies.follow(lambda: self.freshness.wrote(None))

    @contextmanager
    def _session(self, user: User) -> Iterator[Database]:
        """Yield a session of the database that is served now, which stays open for the block."""
        with ExitStack() as asked:
            db = self._db if self._copies is None else asked.enter_context(self._copies.asked())
            yield asked.enter_context(closing(db.session(user.name)))

    def _tried(self, user: User, question: str, document: Mapping[str, Any], files: Mapping[str, Any]) -> Any:
        """Ask in a transaction that is taken back: who writes meanwhile waits."""
        request = request_of(question, document, files)
        with self._session(user) as session:
            try:
                with session.transaction():
                    raise _AnsweredError(QUESTIONS[question].load()(session, request))
            except _AnsweredError as answered:
                return answered.answer

    def _asked(
        self, user: User, question: str, document: Mapping[str, Any], files: Mapping[str, Any],
        tolerances: Mapping[str, Mapping[str, float]] | None, progress: Callable[[str], None] | None = None,
    ) -> Any:  # fmt: skip
        own_files: Mapping[str, Any] = self._own_files.get(question, {})
        sent = {name: file for name, file in files.items() if file is not None}
        request = request_of(question, document, {**own_files, **sent})
        asked = QUESTIONS[question]
        arguments = [] if request is None else [request]
        if not asked.needs_database:
            return asked.load()(*arguments)
        with self._session(user) as session:
            if tolerances is not None:
                session.type_tolerances = tolerances
            before = last_identification(session) if question in IDENTIFYING else None
            machines: set[str] | None = None
            try:
                if progress is None:
                    answer = asked.load()(session, *arguments)
                else:
                    answer = asked.load()(session, *arguments, progress=progress)
                machines = _touched_machines(session, question, request, answer)
                return answer
            finally:
                if writes(question):
                    self.freshness.wrote(machines)
                elif before is not None and last_identification(session) != before:
                    self.freshness.identified()


def _identity(path: str) -> tuple[int, int] | None:
    """What tells the file of a path from every other; None where there is none."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_dev, status.st_ino


def _touched_machines(db: Database, question: str, request: Any, answer: Any) -> set[str] | None:
    """Return the machines whose answers a write changes; None: it may be any."""
    if question in ("event", "withdraw event"):
        return {request.machine}
    if question != "import":
        return None
    return {row.machine for folder in answer.imported for row in list_campaigns(db, campaign=folder.campaign)}


def check_role(user: User, question: str) -> None:
    """Raise ForbiddenError where a question needs a higher role, InputError where it is not offered."""
    if question in NOT_OFFERED:
        raise InputError(f"'{question}' is not asked over HTTP: {NOT_OFFERED[question]}")
    if question not in QUESTIONS:
        raise InputError(f"there is no question '{question}'; there are {', '.join(offered())}")
    role = role_needed(question)
    if user.role < role:
        raise ForbiddenError(
            f"{user.name} has the role {user.role.word}; '{question}' needs the role {role.word}: ask whoever keeps "
            "the users"
        )


def request_of(question: str, document: Mapping[str, Any], files: Mapping[str, Any]) -> Any:
    """Return the typed request of a document. Raises InputError that names the key and the rule."""
    kind = QUESTIONS[question].request
    taken = taken_fields(question)
    for key in document:
        if key not in taken:
            raise InputError(_unknown(question, str(key), taken))
    if kind is None:
        return None
    try:
        request = _adapter(kind).validate_python({**with_moments(kind, document), **files})
    except ValidationError as error:
        raise InputError("; ".join(_fault(fault) for fault in error.errors())) from error
    for path, number in _endless(request):
        raise InputError(f"{path} is {number:g}: write a finite number")
    return request


def _endless(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield where a request holds a number that is none, or beyond all: no question means one."""
    if isinstance(value, float) and not math.isfinite(value):
        yield f"'{path}'", value
    elif isinstance(value, Mapping):
        for key, element in value.items():
            yield from _endless(element, f"{path}.{key}")
    elif isinstance(value, tuple | list):
        for index, element in enumerate(value):
            yield from _endless(element, f"{path}.{index}")
    elif is_dataclass(value):
        for part in fields(value):
            yield from _endless(getattr(value, part.name), f"{path}.{part.name}".removeprefix("."))


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _fault(fault: Any) -> str:
    """A fault of a document as a sentence; pydantic counts a missing field as one."""
    path = ".".join(str(part) for part in fault["loc"]) or "the document"
    if fault["type"] == "missing":
        return f"'{path}' is missing"
    return f"'{path}': {str(fault['msg'])[:1].lower()}{str(fault['msg'])[1:]}"


def _unknown(question: str, key: str, taken: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(key, taken, n=1)
    if near:
        return f"'{question}' takes no '{key}'; did you mean '{near[0]}'?"
    listed = f"it takes {', '.join(taken)}" if taken else "it takes nothing"
    return f"'{question}' takes no '{key}'; {listed}"
