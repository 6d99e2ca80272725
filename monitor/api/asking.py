"""Ask a question of the contract by its name: the one door of the Python interface to the workflow."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from datetime import date, datetime, time
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from monitor.api.answer import Answer
from monitor.exceptions import InputError, did_you_mean
from monitor.store import Database
from monitor.workflow.contract import QUESTIONS

Typed = TypeVar("Typed")
#: How the fields of requests that are moments are annotated.
_MOMENTS = (datetime, datetime | None)
#: An option of the command line in a message, such as ``--digits`` or ``-p``.
_OPTION = re.compile(r"(?<![\w-])--?([a-z][a-z-]*)(?![\w-])")


class Ask:
    """Asks questions of one open database; ``ask("trend", machine="HU40-T")``."""

    def __init__(self, db: Database) -> None:
        self.db = db

    def __call__(self, question: str, **values: Any) -> Any:
        """Return the typed answer. Raises InputError for an option that the question does not have."""
        asked = QUESTIONS[question]
        with options_as_arguments(asked.request):
            arguments = [] if asked.request is None else [request_of(asked.request, values)]
            self.db.forget_campaigns()
            return asked.load()(*([self.db] if asked.needs_database else []), *arguments)


@contextmanager
def options_as_arguments(request: Any) -> Iterator[None]:
    """Let messages of this block name the arguments of a request where they name options of the command line.

    ``--holds-for`` is ``holds_for``, ``--peak`` is ``peak_um``; what is no field of the request stays as it is.
    """
    names = [] if request is None else [field.name for field in fields(request) if field.init]

    def argument(option: re.Match[str]) -> str:
        name = option[1].replace("-", "_")
        return next((field for field in names if field == name or field.startswith(f"{name}_")), option[0])

    try:
        yield
    except InputError as fault:
        fault.args = tuple(
            _OPTION.sub(argument, part) if isinstance(part, str) else part for part in fault.args
        )
        raise


def request_of(kind: Any, values: dict[str, Any]) -> Any:
    """Return a request of a type. Raises InputError for an option that it does not have."""
    names = [field.name for field in fields(kind) if field.init]
    for name in values:
        if name not in names:
            raise InputError(
                f"there is no option '{name}'; {did_you_mean(name, names)}there are {', '.join(names)}"
            )
    hints = get_type_hints(kind)
    return kind(
        **{name: _moment(name, value) if hints[name] in _MOMENTS else value for name, value in values.items()}
    )


def _moment(name: str, value: Any) -> Any:
    """Return a moment with its offset: of a text, a day or a time; without an offset the time of this computer.

    Raises InputError for what is none.
    """
    if isinstance(value, str):
        try:
            value = datetime.fromisoformat(value.strip())
        except ValueError as error:
            raise InputError(
                f"{name}='{value}': write a day or a time, such as '2026-03-05' or '2026-03-05T07:00:00-05:00'"
            ) from error
    elif isinstance(value, date) and not isinstance(value, datetime):
        value = datetime.combine(value, time())
    if value is not None and not isinstance(value, datetime):
        raise InputError(f"{name} is a day or a time, such as '2026-03-05', not {value!r}")
    return value if value is None or value.tzinfo is not None else value.astimezone()


# Of which answer it is says the annotation of the caller alone (``answers.pyi``), hence a variable in the result only.
def answered(content: Any) -> Typed:  # type: ignore[type-var]
    """Return an ``Answer`` of a content."""
    return Answer(content)  # type: ignore[return-value]


def drawn(ask: Ask, question: str, **values: Any) -> Typed:  # type: ignore[type-var]
    """Return an ``Answer`` that can draw its pictures: the question is asked again with a folder for them."""

    def draw(folder: Path) -> Any:
        return ask(question, **values, figures=folder)

    return Answer(ask(question, **values), draw)  # type: ignore[return-value]
