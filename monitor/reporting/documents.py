"""A typed record as JSON and back again, without loss: what is stored of a certificate or a health report.

Every field is written; a date in ISO 8601, an array as a list, NaN as null (JSON has none). ``from_document``
reads the types of the fields, so that the same record comes out, to the last bit of every number.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from datetime import date, datetime
from functools import cache
from typing import Any, TypeVar

import numpy as np

from monitor.exceptions import StoreError

Record = TypeVar("Record")


def to_document(record: object) -> dict[str, Any]:
    """A frozen dataclass as JSON knows it."""
    plain = _plain(record)
    assert isinstance(plain, dict)
    return plain


def from_document(kind: type[Record], document: Mapping[str, Any]) -> Record:
    """The record of that kind. Raises StoreError where the document lacks a field that has no default."""
    made = _made(kind, document, kind.__name__)
    assert isinstance(made, kind)
    return made


def _plain(value: object) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return [_plain(one) for one in value.tolist()]
    if isinstance(value, (tuple, list)):
        return [_plain(one) for one in value]
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


@cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _made(kind: Any, value: Any, where: str) -> Any:
    """``value`` as the type ``kind`` asks for."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return _one_of([one for one in typing.get_args(kind) if one is not type(None)], value, where)
    if origin is np.ndarray:
        return np.array(_numbers(value), dtype=np.float64)
    if origin is tuple:
        inner = typing.get_args(kind)
        each = [inner[0]] * len(value) if inner[-1] is Ellipsis else inner
        return tuple(_made(one, part, where) for one, part in zip(each, value, strict=True))
    if dataclasses.is_dataclass(kind):
        return _record(kind, value, where)
    if kind is datetime:
        return datetime.fromisoformat(value)
    if kind is date:
        return date.fromisoformat(value)
    if kind is float:
        return math.nan if value is None else float(value)
    return value


def _numbers(value: Any) -> Any:
    if isinstance(value, list):
        return [_numbers(one) for one in value]
    return math.nan if value is None else value


def _one_of(kinds: list[Any], value: Any, where: str) -> Any:
    """Of an alternative: a mapping is its record, a text a date where no text is allowed."""
    if value is None:
        return None
    if isinstance(value, dict):
        return _made(_fitting(kinds, value, where), value, where)
    others = [kind for kind in kinds if not dataclasses.is_dataclass(kind)]
    if isinstance(value, str) and str in others:
        return value
    return _made(others[0], value, where)


def _fitting(kinds: list[Any], value: Mapping[str, Any], where: str) -> Any:
    """Which of several records a mapping is: the one with its fields."""
    for kind in kinds:
        if dataclasses.is_dataclass(kind) and {field.name for field in dataclasses.fields(kind)} == set(
            value
        ):
            return kind
    raise StoreError(
        f"the stored {where} has {', '.join(value)}: it was written by another version or altered"
    )


def _record(kind: Any, value: Any, where: str) -> Any:
    hints = _hints(kind)
    fields = {field.name: field for field in dataclasses.fields(kind)}
    missing = [
        name
        for name, field in fields.items()
        if name not in value
        and field.default is dataclasses.MISSING
        and field.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise StoreError(
            f"the stored {where} lacks {', '.join(missing)}: it was written by another version or altered"
        )
    return kind(
        **{
            name: _made(hints[name], part, f"{where}.{name}")
            for name, part in value.items()
            if name in fields
        }
    )
