"""Ask a question of the contract by its name: the one door of the Python interface to the workflow."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from monitor.api.answer import Answer
from monitor.api.arguments import argument, unknown_option
from monitor.exceptions import InputError
from monitor.store import Database
from monitor.workflow.contract import QUESTIONS

Typed = TypeVar("Typed")
#: An option of the command line in a message, such as ``--digits`` or ``-p``.
_OPTION = re.compile(r"(?<![\w-])--?([a-z][a-z-]*)(?![\w-])")


class Ask:
    """Asks questions of one open database; ``ask("trend", machine="HU40-T")``."""

    def __init__(self, db: Database) -> None:
        self.db = db
        self.is_closed = False

    def __call__(self, question: str, /, **values: Any) -> Any:
        """Return the typed answer. Raises InputError for an option that the question does not have, and once
        it is closed."""
        if self.is_closed:
            raise InputError(f"this database is closed; open it again: mm.open({str(self.db.path)!r})")
        asked = QUESTIONS[question]
        with options_as_arguments(asked.request):
            if asked.request is None and values:
                raise InputError(
                    f"'{question}' has no options; there is none to give as '{next(iter(values))}'"
                )
            arguments = [] if asked.request is None else [request_of(asked.request, values)]
            self.db.begin_question()
            return asked.load()(*([self.db] if asked.needs_database else []), *arguments)


@contextmanager
def options_as_arguments(request: Any) -> Iterator[None]:
    """Let messages of this block name the arguments of a request where they name options of the command line.

    ``--holds-for`` is ``holds_for``, ``--peak`` is ``peak_um``, ``--event``, typed once for each, ``events``; what is
    no field of the request stays as it is.
    """
    names = [] if request is None else [field.name for field in fields(request) if field.init]

    def argument(option: re.Match[str]) -> str:
        name = option[1].replace("-", "_")
        several = f"{name}s"
        return next(
            (field for field in names if field in (name, several) or field.startswith(f"{name}_")), option[0]
        )

    try:
        yield
    except InputError as fault:
        fault.args = tuple(
            _OPTION.sub(argument, part) if isinstance(part, str) else part for part in fault.args
        )
        raise


def request_of(kind: Any, values: dict[str, Any]) -> Any:
    """Return a request of a type. Raises InputError for an option that it does not have, or a value of another type."""
    names = [field.name for field in fields(kind) if field.init]
    for name in values:
        if name not in names:
            raise InputError(unknown_option(name, names))
    hints = get_type_hints(kind)
    for field in fields(kind):
        is_needed = field.init and field.default is MISSING and field.default_factory is MISSING
        if is_needed and field.name not in values:
            raise InputError(f"{field.name} is needed; there are {', '.join(names)}")
    return kind(**{name: argument(name, value, hints[name]) for name, value in values.items()})


# Of which answer it is says the annotation of the caller alone (``answers.pyi``), hence a variable in the result only.
def answered(content: Any) -> Typed:  # type: ignore[type-var]
    """Return an ``Answer`` of a content."""
    return Answer(content)  # type: ignore[return-value]


def drawn(ask: Ask, question: str, /, **values: Any) -> Typed:  # type: ignore[type-var]
    """Return an ``Answer`` that can draw its pictures: the question is asked again with a folder for them."""

    def draw(folder: Path) -> Any:
        return ask(question, **{**values, "figures": folder})

    return Answer(ask(question, **values), draw)  # type: ignore[return-value]
