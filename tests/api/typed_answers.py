"""Writes ``monitor/api/answers.pyi``: the answers of the Python interface with their attributes typed.

An ``Answer`` has the fields of its content, and of the records that are inlined in it, as attributes. No annotation can
say that of a type variable, so the stub names them; type checkers and editors read it, and nothing loads it. Where an
answer may be of several kinds (a machine's, a curve's), an attribute has the types of all. ``AnyAnswer`` is what a
question by its name gives, which has any attribute.

``python tests/api/typed_answers.py`` writes it; ``test_typed_answers.py`` holds it against the types.
"""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import sys
import types
import typing
from collections.abc import Iterator
from pathlib import Path

import monitor
from monitor.api.answer import Answer
from monitor.workflow.certificate.answer import CertificateFileAnswer
from monitor.workflow.explain.compare_answer import CompareAnswer
from monitor.workflow.explain.explain_answer import ExplainAnswer
from monitor.workflow.fleet.answer import FleetAnswer
from monitor.workflow.health.request import ReportAnswer
from monitor.workflow.intake.importing import ImportAnswer
from monitor.workflow.likeness import LikeAnswer
from monitor.workflow.model.answer import ChangeModelAnswer, ModelsAnswer
from monitor.workflow.run_statistics.answer import StatisticsAnswer
from monitor.workflow.simulation import SimulateAnswer, SimulateMachineAnswer
from monitor.workflow.trend.answer import TrendAnswer
from monitor.workflow.uncertainty.answer import UncertaintyAnswer
from monitor.workflow.volumetric.answer import VolumetricAnswer

STUB = Path(monitor.__file__).parent / "api/answers.pyi"
CONTENTS: tuple[type, ...] = (
    CertificateFileAnswer, ChangeModelAnswer, CompareAnswer, ExplainAnswer, FleetAnswer, ImportAnswer, LikeAnswer,
    ModelsAnswer, ReportAnswer, SimulateAnswer, SimulateMachineAnswer, StatisticsAnswer, TrendAnswer, UncertaintyAnswer,
    VolumetricAnswer,
)  # fmt: skip
HEAD = '''"""Answers with their attributes typed: for type checkers alone; ``tests/api/typed_answers.py`` writes it."""

# ruff: noqa: I001 -- written by a program
# fmt: off

'''


def records(kind: type) -> Iterator[type]:
    """Yield a kind of record and those whose fields an answer of it has too, as ``inlined_parts`` does."""
    yield kind
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        if "inlined" in field.metadata:
            for member in members(hints[field.name]):
                if dataclasses.is_dataclass(member) and isinstance(member, type):
                    yield from records(member)


def members(hint: object) -> tuple[object, ...]:
    """Return the types that a type may be."""
    union = isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union
    return typing.get_args(hint) if union else (hint,)


def annotations(kind: type) -> dict[str, tuple[str, str]]:
    """Return the public fields and properties of a record: annotation as written, and the module that it stands in."""
    written: dict[str, tuple[str, str]] = {}
    for owner in reversed(kind.__mro__):
        for name, annotation in inspect.get_annotations(owner).items():
            of_class = str(annotation).startswith("ClassVar[")
            written[name] = (
                str(annotation)[len("ClassVar[") : -1] if of_class else str(annotation),
                owner.__module__,
            )
        for name, member in vars(owner).items():
            if isinstance(member, property) and member.fget is not None:
                written[name] = str(member.fget.__annotations__["return"]), owner.__module__
    return {name: text for name, text in written.items() if not name.startswith("_")}


def attributes(content: type) -> dict[str, list[tuple[str, str]]]:
    """Return the annotations of every attribute of an answer, of each record that may have it."""
    named: dict[str, list[tuple[str, str]]] = {}
    for kind in records(content):
        for name, annotation in annotations(kind).items():
            if not hasattr(Answer, name) and name != "content":
                named.setdefault(name, []).append(annotation)
    return named


class Imports:
    """The names that the stub's annotations need, each from the module that defines it."""

    def __init__(self) -> None:
        self.names: set[tuple[str, str]] = set()

    def union(self, written: list[tuple[str, str]]) -> str:
        """Return the annotations of one attribute as one, its names noted."""
        parts: dict[str, None] = {}
        for text, module in written:
            tree = ast.parse(text, mode="eval").body
            for node in ast.walk(tree):
                if isinstance(node, ast.Name):
                    self._note(node.id, module)
            parts |= dict.fromkeys(_alternatives(tree))
        # None last, as a person writes it.
        return " | ".join(sorted(parts, key=lambda part: part == "None"))

    def _note(self, name: str, module: str) -> None:
        if name in vars(__import__("builtins")):
            return
        value = getattr(importlib.import_module(module), name)
        # Mapping says of itself that it is of typing; an alias is of no module, or of another name in its own.
        homes = (
            getattr(value, "__module__", module),
            "monitor.records",
            "monitor.documents",
            "collections.abc",
            module,
        )
        exact = (home for home in homes if getattr(importlib.import_module(home), name, None) is value)
        self.names.add((next(exact), name))

    def lines(self) -> str:
        """Return the import statements."""
        return "\n".join(f"from {module} import {name}" for module, name in sorted(self.names))


def _alternatives(tree: ast.expr) -> list[str]:
    if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.BitOr):
        return [*_alternatives(tree.left), *_alternatives(tree.right)]
    return [ast.unparse(tree)]


def stub() -> str:
    """Return the text of the stub."""
    imports = Imports()
    imports.names.add(("monitor.api.answer", "Answer"))
    classes = []
    for content in CONTENTS:
        imports.names.add((content.__module__, content.__name__))
        lines = [f"class Typed{content.__name__}(Answer[{content.__name__}]):"]
        for name, written in attributes(content).items():
            lines += ["    @property", f"    def {name}(self) -> {imports.union(written)}: ..."]
        classes.append("\n".join(lines))
    imports.names.add(("typing", "Any"))
    classes.append("class AnyAnswer(Answer[Any]):\n    def __getattr__(self, name: str) -> Any: ...")
    return HEAD + imports.lines() + "\n\n" + "\n\n".join(classes) + "\n"


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
    sys.exit(0)
