"""Converts a frozen dataclass to a JSON document and back, without loss: the one edge between types and JSON.

Every field is written under its name. A date is written in ISO 8601, an array as a list, an enumeration as its value,
and a number that is not finite as null, because JSON has none. ``from_document`` reads the types of the fields, so that
the same record is restored to the last bit of every number. Four marks of a field change how it is written: ``named``
gives it a key that is no Python name, ``OMITTED`` leaves it out where it is None, ``INLINED`` writes the fields of a
record into the document of its owner, and ``WORDED`` writes a kind as the sentence that people read and, beside it, as
the data from which it is restored. Of several kinds of record that may be inlined, the first is restored whose
keys the document has: name the one with most keys first. A ``Sentence`` is written as its words alone.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping, Sequence
from datetime import date, datetime
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np

from monitor.exceptions import StoreError

Record = TypeVar("Record")


class Sentence:
    """A kind with its numbers that a document holds as the sentence (``str``) that people read.

    The document restores the sentence: what may hold either is ``Said``.
    """


#: A sentence as data, or as a document of before has it.
Said: TypeAlias = Sentence | str

#: Metadata of a field that is left out of the document where it is None: ``field(default=None, metadata=OMITTED)``.
OMITTED: Mapping[str, Any] = {"omitted": True}
#: Metadata of a field whose record, or mapping, is written key by key into the document of its owner.
INLINED: Mapping[str, Any] = {"inlined": True}
#: Metadata of a field that is written as its sentence (``str``) and, under a key that ends in ``_kind``, as its data.
WORDED: Mapping[str, Any] = {"worded": True}
#: Metadata of a field whose datetime is in UTC without its zone, as the store has it: it is written with Z.
IN_UTC: Mapping[str, Any] = {"utc": True}


def named(key: str) -> Mapping[str, Any]:
    """Metadata of a field that is written under ``key``: ``field(metadata=named("from"))``."""
    return {"key": key}


#: What JSON has as Python has it.
_AS_THEY_ARE = frozenset({str, int, bool, type(None)})


def to_document(record: object) -> dict[str, Any]:
    """Convert a frozen dataclass to what JSON has: dict, list, str, int, float, bool and None."""
    document = _plain(record)
    assert isinstance(document, dict)
    return document


def from_document(kind: type[Record], document: Mapping[str, Any]) -> Record:
    """Restore the record of a kind. Raises StoreError where the document lacks a field that has no default."""
    record = _typed(kind, document, kind.__name__)
    assert isinstance(record, kind)
    return record


def answer_from_document(kind: Any, document: object) -> Any:
    """Restore an answer of the contract, which may be of several kinds. Raises StoreError where it is of none."""
    return _typed(kind, document, "answer")


def inlined_parts(record: object) -> tuple[object, ...]:
    """Return a record and the records that are written into its document, at any depth."""
    if not dataclasses.is_dataclass(record):
        return (record,)
    inlined = (
        getattr(record, field.name) for field in dataclasses.fields(record) if "inlined" in field.metadata
    )
    return (record, *(part for value in inlined if value is not None for part in inlined_parts(value)))


def _key(field: dataclasses.Field[Any]) -> str:
    return str(field.metadata.get("key", field.name))


def data_key(field: dataclasses.Field[Any]) -> str:
    """The key under which the data of a field stand."""
    return f"{_key(field)}_kind" if field.metadata.get("worded") else _key(field)


def _plain(value: object) -> Any:
    # Most of an answer: asked for last, each of them was asked first whether it is a dataclass.
    if type(value) is float:
        return value if math.isfinite(value) else None
    return value if type(value) in _AS_THEY_ARE else _taken_apart(value)


def _taken_apart(value: object) -> Any:
    if isinstance(value, (Sentence, Path)):
        return str(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _plain_record(value)
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.ndarray):
        return [_plain(element) for element in value.tolist()]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, Mapping):
        return {str(key): _plain(element) for key, element in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(element) for element in value]
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _plain_record(record: Any) -> dict[str, Any]:
    document: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if value is not None and field.metadata.get("worded"):
            document |= {_key(field): str(value), data_key(field): _plain(value)}
            continue
        if value is None and (field.metadata.get("omitted") or field.metadata.get("inlined")):
            continue
        if field.metadata.get("inlined"):
            document |= _plain(value)
        elif field.metadata.get("utc") and value is not None:
            document[_key(field)] = f"{value.isoformat()}Z"
        else:
            document[_key(field)] = _plain(value)
    return document


@cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _typed(kind: Any, value: Any, path: str) -> Any:
    """Return ``value`` as the type ``kind`` asks for; ``path`` says where it stands, for messages."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return _one_of([member for member in typing.get_args(kind) if member is not type(None)], value, path)
    if origin is np.ndarray:
        return np.array(_numbers(value), dtype=_dtype(kind))
    if origin is tuple:
        inner = typing.get_args(kind)
        each = [inner[0]] * len(value) if inner[-1] is Ellipsis else inner
        return tuple(_typed(member, element, path) for member, element in zip(each, value, strict=True))
    if origin in (list, Sequence):
        (member,) = typing.get_args(kind)
        return [_typed(member, element, path) for element in value]
    if origin in (dict, Mapping):
        _, member = typing.get_args(kind)
        return {key: _typed(member, element, f"{path}.{key}") for key, element in value.items()}
    if dataclasses.is_dataclass(kind):
        return _record(kind, value, path)
    return _scalar(kind, value)


def _scalar(kind: Any, value: Any) -> Any:
    if kind in (datetime, date):
        return kind.fromisoformat(value)
    if kind is float:
        return math.nan if value is None else float(value)
    if kind is Path or (isinstance(kind, type) and issubclass(kind, Enum)):
        return kind(value)
    return value


def _dtype(kind: Any) -> Any:
    """Return the type of an array's elements: that of its annotation, a double where it names none."""
    element = typing.get_args(typing.get_args(kind)[-1])
    return element[0] if element and isinstance(element[0], type) else np.float64


def _numbers(value: Any) -> Any:
    if isinstance(value, list):
        return [_numbers(element) for element in value]
    return math.nan if value is None else value


def _one_of(kinds: list[Any], value: Any, path: str) -> Any:
    """Choose among alternatives: a mapping is its record, a text a date where no text is allowed."""
    if value is None:
        return None
    if isinstance(value, dict) and any(dataclasses.is_dataclass(kind) for kind in kinds):
        return _typed(_fitting(kinds, value, path), value, path)
    others = [kind for kind in kinds if not dataclasses.is_dataclass(kind)]
    if isinstance(value, str) and str in others:
        return value
    return _typed(others[0], value, path)


def _keys(kind: Any) -> tuple[set[str], set[str]]:
    """Return the keys that a record of this kind must have in its document, and those that it may have."""
    hints = _hints(kind)
    required: set[str] = set()
    allowed: set[str] = set()
    for field in dataclasses.fields(kind):
        if field.metadata.get("inlined"):
            members = [kind for kind in _record_kinds(hints[field.name]) if dataclasses.is_dataclass(kind)]
            if not members:
                continue
            inlined = [_keys(member) for member in members]
            allowed |= set().union(*(keys for _, keys in inlined))
            if field.default is dataclasses.MISSING:
                required |= set.intersection(*(keys for keys, _ in inlined))
            continue
        allowed |= {_key(field), data_key(field)}
        if not field.metadata.get("omitted"):
            required.add(_key(field))
    return required, allowed


def _record_kinds(hint: Any) -> list[Any]:
    """Return the dataclasses of a hint, which may also allow None."""
    return [member for member in typing.get_args(hint) if dataclasses.is_dataclass(member)] or [hint]


def _fitting(kinds: list[Any], value: Mapping[str, Any], path: str) -> Any:
    """Return the kind of record whose fields a mapping has."""
    for kind in kinds:
        if dataclasses.is_dataclass(kind):
            required, allowed = _keys(kind)
            if required <= set(value) <= allowed:
                return kind
    raise StoreError(
        f"the stored {path} has {', '.join(value)}: it was written by another version or altered"
    )


def _record(kind: Any, value: Mapping[str, Any], path: str) -> Any:
    hints = _hints(kind)
    arguments: dict[str, Any] = {}
    missing = []
    for field in dataclasses.fields(kind):
        if field.metadata.get("inlined"):
            if typing.get_origin(hints[field.name]) in (dict, Mapping):
                rest = {key: element for key, element in value.items() if key not in _keys(kind)[1]}
                arguments[field.name] = _typed(hints[field.name], rest, path)
                continue
            kinds = _record_kinds(hints[field.name])
            inlined = next((member for member in kinds if _keys(member)[0] <= set(value)), None)
            if inlined is not None or field.default is dataclasses.MISSING:
                arguments[field.name] = _record(inlined or kinds[0], value, path)
        elif _key(field) in value:
            element = _typed(hints[field.name], value.get(data_key(field)), f"{path}.{field.name}")
            zoned = field.metadata.get("utc") and element is not None
            arguments[field.name] = element.replace(tzinfo=None) if zoned else element
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            missing.append(_key(field))
    if missing:
        raise StoreError(
            f"the stored {path} lacks {', '.join(missing)}: it was written by another version or altered"
        )
    return kind(**arguments)
