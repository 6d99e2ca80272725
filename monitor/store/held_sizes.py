"""How much memory an answer takes that is held for those who ask next: an estimate, quick beside making the answer."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from itertools import islice
from typing import Any

import numpy as np

#: Of a long sequence so many members are looked at, spread over it; the rest is taken to be like them.
_LOOKED_AT = 64


def held_bytes(answer: Any) -> int:
    """Return about how many bytes an answer holds: arrays, texts, mappings, sequences, dataclasses and what is in them.

    What several parts share is counted once where they are met; other objects count for themselves alone. Right to some
    ten per cent where the members of a sequence resemble each other; the rows of a table do.
    """
    return _bytes(answer, set())


def _bytes(value: Any, counted: set[int]) -> int:
    if id(value) in counted:
        return 0
    counted.add(id(value))
    if isinstance(value, np.ndarray):
        return _array_bytes(value, counted)
    size = sys.getsizeof(value)
    if isinstance(value, str | bytes | int | float | type) or value is None:
        return size
    if isinstance(value, Mapping):
        members = _spread(value.items(), len(value))
        return size + _scaled(
            [_bytes(key, counted) + _bytes(part, counted) for key, part in members], len(value)
        )
    if isinstance(value, list | tuple | set | frozenset):
        return size + _scaled([_bytes(part, counted) for part in _spread(value, len(value))], len(value))
    if is_dataclass(value):
        owned = sys.getsizeof(vars(value)) if hasattr(value, "__dict__") else 0
        return (
            size + owned + sum(_bytes(getattr(value, entry.name, None), counted) for entry in fields(value))
        )
    return size


def _array_bytes(value: np.ndarray, counted: set[int]) -> int:
    """An array with what it is a view of, with its mask, and with the objects in it."""
    size = int(value.nbytes) + sys.getsizeof(value.view(np.ndarray)[:0])
    if isinstance(value.base, np.ndarray):
        size += max(_bytes(value.base, counted) - int(value.nbytes), 0)
    if isinstance(value, np.ma.MaskedArray):
        size += int(np.asarray(value.mask).nbytes)
    if value.dtype == object:
        members = np.asarray(value).reshape(-1)
        size += _scaled([_bytes(part, counted) for part in _spread(members, len(members))], len(members))
    return size


def _spread(members: Any, count: int) -> list[Any]:
    return list(islice(members, 0, None, max(-(-count // _LOOKED_AT), 1)))


def _scaled(sizes: list[int], count: int) -> int:
    return sum(sizes) * count // len(sizes) if sizes else 0
