"""Ask a question of the contract by its name: the one door of the Python interface to the workflow."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from monitor.api.answer import Answer
from monitor.exceptions import InputError, did_you_mean
from monitor.store import Database
from monitor.workflow.contract import QUESTIONS


class Ask:
    """Asks questions of one open database; ``ask("trend", machine="HU40-T")``."""

    def __init__(self, db: Database) -> None:
        self.db = db

    def __call__(self, question: str, **values: Any) -> Any:
        """Return the typed answer. Raises InputError for an option that the question does not have."""
        asked = QUESTIONS[question]
        request = asked.request
        arguments = [] if request is None else [request_of(request, values)]
        self.db.forget_campaigns()
        return asked.load()(*([self.db] if asked.needs_database else []), *arguments)


def request_of(kind: Any, values: dict[str, Any]) -> Any:
    """Return a request of a type. Raises InputError for an option that it does not have."""
    names = [field.name for field in fields(kind) if field.init]
    for name in values:
        if name not in names:
            raise InputError(
                f"there is no option '{name}'; {did_you_mean(name, names)}there are {', '.join(names)}"
            )
    return kind(**values)


def drawn(ask: Ask, question: str, **values: Any) -> Answer[Any]:
    """Return an answer that can draw its pictures: the question is asked again with a folder for them."""

    def draw(folder: Path) -> Any:
        return ask(question, **values, figures=folder)

    return Answer(ask(question, **values), draw)
