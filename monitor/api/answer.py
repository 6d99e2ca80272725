"""A typed answer of the contract as Python people want it: attributes, a table, a document, pictures."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from monitor.api.pictures import Pictures
from monitor.api.tables import as_html, as_text, facts, main_table
from monitor.documents import inlined_parts, to_document
from monitor.exceptions import InputError

if TYPE_CHECKING:
    import pandas as pd

Content = TypeVar("Content")
Draw = Callable[[Path], Any]


class Answer(Generic[Content]):
    """An answer: ``content`` is the frozen record of the contract, and its fields are attributes of the answer too."""

    def __init__(self, content: Content, draw: Draw | None = None) -> None:
        self.content = content
        self._draw = draw

    # Type checkers see the fields of each kind of answer in answers.pyi; through this every misspelt one passes.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            # Copying and pickling ask for attributes before there is a content.
            if name.startswith("_") or name == "content":
                raise AttributeError(name)
            for part in inlined_parts(self.content):
                if hasattr(part, name):
                    return getattr(part, name)
            raise AttributeError(
                f"{type(self.content).__name__} has no '{name}'; it has {', '.join(self._fields())}"
            )

    def _fields(self) -> list[str]:
        return [
            key for part in inlined_parts(self.content) for key in getattr(part, "__dataclass_fields__", {})
        ]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._fields()})

    def to_dict(self) -> dict[str, Any]:
        """Return the answer as the command line prints it with ``--json``."""
        return to_document(self.content)

    def table(self) -> pd.DataFrame:
        """Return the main rows of the answer; ``attrs["units"]`` has the unit of each column that has one.

        Raises InputError where the answer is no list of rows.
        """
        return main_table(self.content)

    def plot(self) -> Pictures:
        """Draw the pictures of the answer. Raises InputError where it has none."""
        if self._draw is None:
            raise InputError(f"{type(self.content).__name__} has no pictures")
        with tempfile.TemporaryDirectory() as folder:
            drawn = self._draw(Path(folder))
            return Pictures(Path(file) for file in drawn.figures or ())

    def __repr__(self) -> str:
        return f"{type(self.content).__name__}({self._summary() or '...'})\n{self._text()}"

    def _summary(self) -> str:
        values = {key: getattr(self, key, None) for key in ("machine", "campaign", "run", "model")}
        return ", ".join(f"{key}={value!r}" for key, value in values.items() if isinstance(value, str | int))

    def _sentence(self) -> str:
        for key in ("answer", "message", "verdict"):
            text = getattr(self, key, None)
            if isinstance(text, str):
                return text
        return ""

    def _text(self) -> str:
        try:
            rows = main_table(self.content)
        except InputError:
            return self._sentence() or "\n".join(
                f"{name}: {value}" for name, value in facts(self.content).items()
            )
        if rows.empty and self._sentence():
            return self._sentence()
        return f"{self._sentence()}\n{as_text(rows)}".strip()

    def _repr_html_(self) -> str:
        """Return the sentence, the table and the first picture, as a notebook shows them; ``plot()`` shows all."""
        from html import escape

        parts = [f"<p>{escape(self._sentence())}</p>"] if self._sentence() else []
        try:
            rows = main_table(self.content)
            if not (rows.empty and parts):
                parts.append(as_html(rows))
        except InputError:
            lines = [f"{name}: {value}" for name, value in facts(self.content).items()]
            parts += [] if parts else [f"<p>{escape(line)}</p>" for line in lines or [self._summary()]]
        if self._draw is not None:
            parts.append(self.plot().first())
        return "\n".join(parts)
