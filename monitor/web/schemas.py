"""Describes requests and answers of the contract as JSON Schema (2020-12), for OpenAPI.

The rules are those of ``monitor/documents.py``: a field under its key, None as null, inlined records in the document of
their owner, omitted fields not required.
"""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from datetime import date, datetime
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from monitor.documents import Sentence, data_key

Schema = dict[str, Any]

_SCALARS: Mapping[Any, Schema] = {
    str: {"type": "string"},
    int: {"type": "integer"},
    float: {"type": ["number", "null"]},  # what is not finite is null: JSON has no such number
    bool: {"type": "boolean"},
    datetime: {"type": "string"},  # a local time has no offset, so that it is no date-time of RFC 3339
    date: {"type": "string", "format": "date"},
    Path: {"type": "string"},
    type(None): {"type": "null"},
}


class Schemas:
    """Collects the records of types under ``definitions``, each once."""

    def __init__(self, prefix: str = "#/components/schemas/") -> None:
        self.definitions: dict[str, Schema] = {}
        self._kinds: dict[str, type] = {}
        self._prefix = prefix

    def of(self, hint: Any) -> Schema:
        """Return the schema of a type, a reference where it is a record."""
        origin, members = typing.get_origin(hint), typing.get_args(hint)
        if origin in (typing.Union, types.UnionType):
            return self._of_alternatives(members)
        if origin is typing.Literal:
            return {"enum": list(members)}
        if origin is np.ndarray:
            return {"type": "array", "items": {}}
        if origin is tuple and Ellipsis not in members:
            return self._of_fixed_length(members)
        if origin in (tuple, list, Sequence):
            return {"type": "array", "items": self.of(members[0])}
        if origin in (dict, Mapping):
            return {"type": "object", "additionalProperties": self.of(members[1])}
        if is_dataclass(hint) and isinstance(hint, type):
            return self._reference(hint)
        if isinstance(hint, type) and issubclass(hint, Enum):
            return {"enum": [member.value for member in hint]}
        return dict(_SCALARS.get(hint, {}))

    def _of_alternatives(self, members: tuple[Any, ...]) -> Schema:
        """The schema of a union; the document of a sentence is the text that stands beside it."""
        written = [self.of(member) for member in members if member is not Sentence]
        return {"anyOf": written} if len(written) > 1 else written[0]

    def _of_fixed_length(self, members: tuple[Any, ...]) -> Schema:
        """The schema of a pair or triple; tools that know no prefixItems understand one of members of one type."""
        if len(set(members)) == 1:
            count = len(members)
            return {"type": "array", "items": self.of(members[0]), "minItems": count, "maxItems": count}
        return {"type": "array", "prefixItems": [self.of(member) for member in members]}

    def request(self, kind: Any, taken: Sequence[str]) -> Schema:
        """Return the schema of a request of which only some fields are taken."""
        hints = typing.get_type_hints(kind)
        accepted = [field for field in fields(kind) if field.name in taken]
        return {
            "type": "object",
            "description": inspect.getdoc(kind) or "",
            "properties": {field.name: self.of(hints[field.name]) for field in accepted},
            "required": [field.name for field in accepted if _is_required(field)],
            "additionalProperties": False,
        }

    def _reference(self, kind: type) -> Schema:
        name = kind.__name__
        if self._kinds.setdefault(name, kind) is not kind:  # two records of one name, in different rooms
            name = f"{kind.__module__.rpartition('.')[2]}.{name}"
            self._kinds[name] = kind
        if name not in self.definitions:
            self.definitions[name] = {}
            self.definitions[name] |= self._record(kind)
        return {"$ref": f"{self._prefix}{name}"}

    def _record(self, kind: Any) -> Schema:
        hints = typing.get_type_hints(kind)
        properties: dict[str, Schema] = {}
        required, parts = [], []
        for field in fields(kind):
            if field.metadata.get("inlined"):
                part = self.of(hints[field.name])
                # A record that may be None is left out with all its keys.
                may_lack = {"type": "null"} in part.get("anyOf", [])
                parts.append({"anyOf": [*part["anyOf"][:-1], {}]} if may_lack else part)
                continue
            key = str(field.metadata.get("key", field.name))
            if field.metadata.get("worded"):
                properties[key] = self.of(str | None)
            properties[data_key(field)] = self.of(hints[field.name])
            if not field.metadata.get("omitted"):
                required.append(key)
        record = {"type": "object", "description": inspect.getdoc(kind) or "", "properties": properties}
        record |= {"required": required} if required else {}
        return {"allOf": [record, *parts]} if parts else record


def _is_required(field: Field[Any]) -> bool:
    return field.default is MISSING and field.default_factory is MISSING
