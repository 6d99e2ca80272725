"""The reference of questions and answers, from the types of the contract (``monitor/workflow/contract.py``)."""

# ruff: noqa: E501 -- prose of pages
from __future__ import annotations

import dataclasses
import inspect
import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, datetime
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from markdown import code, of_docstring, table

from monitor.workflow.contract import QUESTIONS

NAMES: Mapping[Any, str] = {
    str: "text",
    int: "whole number",
    float: "number",
    bool: "true or false",
    datetime: "moment",
    date: "day",
    Path: "path",
    type(None): "null",
    Any: "any",
}
HEAD = """# Questions and documents

Everything that can be asked is a question with a typed request and a typed answer. The command line prints the answer with `--json`, the
HTTP interface takes the request and sends the answer as JSON (`POST /api/v1/QUESTION`; a space of the name is a hyphen there: `/api/v1/add-effect`), Python asks with `db.ask("question", ...)`. This page is made from the
types. Every field is a key of the document under the name in the table; a number that is not finite is `null`; days and moments are ISO 8601; arrays are lists.
Keys are kept from version to version, new ones may be added.

"""
HEAD_RECORDS = """## Records

The parts of which answers are made. A record in *italics* is written key by key into the document that holds it.
"""


def page() -> str:
    """Return the page."""
    records: dict[str, type] = {}
    parts = [HEAD, table(("question", "does"), ((_link(name), _does(name)) for name in QUESTIONS))]
    for name, question in QUESTIONS.items():
        parts.append(f"## {name}\n\n{of_docstring(inspect.getdoc(question.load()) or '')}\n")
        if question.request is not None:
            parts.append(f"Request: {of_docstring(inspect.getdoc(question.request) or '')}\n")
            parts.append(_fields(question.request, records, request=True))
        for answer in members(question.answer):
            parts.append(f"Answer: {of_docstring(inspect.getdoc(answer) or '')}\n")
            parts.append(_fields(answer, records))
    parts.append(HEAD_RECORDS)
    written: set[str] = set()
    while missing := [name for name in sorted(records) if name not in written]:
        for name in missing:
            written.add(name)
            described = of_docstring(inspect.getdoc(records[name]) or "")
            parts.append(f"### {name}\n\n{described}\n\n{_fields(records[name], records)}")
    return "\n".join(parts)


def _does(name: str) -> str:
    return of_docstring((inspect.getdoc(QUESTIONS[name].load()) or "").split("\n\n")[0])


def _link(name: str) -> str:
    return f"[{name}](#{name.replace(' ', '-')})"


def members(hint: Any) -> Iterator[Any]:
    """Yield the types that a type may be."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        yield from typing.get_args(hint)
    else:
        yield hint


def _fields(kind: Any, records: dict[str, type], *, request: bool = False) -> str:
    if not dataclasses.is_dataclass(kind):
        return ""
    hints = typing.get_type_hints(kind)
    rows = []
    for field in dataclasses.fields(kind):
        key = code(str(field.metadata.get("key", field.name)))
        if field.metadata.get("inlined"):
            key = f"*{field.name}*"
        note = "left out where there is none" if field.metadata.get("omitted") else ""
        rows.append((key, _type(hints[field.name], records), _default(field) if request else note))
    return table(("key", "type", "default" if request else ""), rows) if rows else "No fields.\n"


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default is dataclasses.MISSING:
        return "required" if field.default_factory is dataclasses.MISSING else ""
    if field.default is None or field.default == ():
        return ""
    value = field.default.value if isinstance(field.default, Enum) else field.default
    return code(re.sub(r" at 0x[0-9a-f]+", "", str(value).lower() if isinstance(value, bool) else str(value)))


def _type(hint: Any, records: dict[str, type]) -> str:
    origin, members = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(_type(member, records) for member in members))
    if origin is typing.Literal:
        return " or ".join(code(str(member)) for member in members)
    if origin is np.ndarray or hint is np.ndarray:
        return "list of numbers (an array; several dimensions are lists of lists)"
    if origin is tuple and members and Ellipsis not in members:
        return f"list of {len(members)}: " + ", ".join(_type(member, records) for member in members)
    if origin in (tuple, list, Sequence):
        return f"list of {_type(members[0], records)}" if members else "list"
    if origin in (dict, Mapping):
        return f"object: {_type(members[1], records)} by {_type(members[0], records)}"
    if isinstance(hint, type) and issubclass(hint, Enum):
        return " or ".join(code(str(member.value)) for member in hint)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _record(hint, records)
    return NAMES.get(hint, getattr(hint, "__name__", str(hint)))


def _record(kind: type, records: dict[str, type]) -> str:
    name = kind.__name__
    if records.setdefault(name, kind) is not kind:  # two records of one name, in different rooms
        name = f"{name} of {kind.__module__.rpartition('.')[2]}"
        records.setdefault(name, kind)
    return f"[{name}](#{re.sub(r'[^a-z0-9_]+', '-', name.lower())})"
