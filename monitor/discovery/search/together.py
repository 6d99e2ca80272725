"""Many small arrays one below the other, without a copy of those that stand so in memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from monitor.records import Array

#: Fewer rows than these are copied beside their neighbours: many small products take longer than one large one.
WORTH_A_BLOCK = 64


def together(parts: Sequence[Array]) -> tuple[Array, ...]:
    """Return all rows of parts (k, M) in their order, in few blocks: parts that were cut from one array, one behind
    the other, are a part of that array again."""
    blocks: list[Array] = []
    small: list[Array] = []
    for first, last in _neighbours(parts):
        if sum(len(part) for part in parts[first:last]) < WORTH_A_BLOCK:
            small += parts[first:last]
            continue
        if small:
            blocks.append(np.concatenate(small))
            small = []
        blocks.append(_whole(parts[first:last]))
    if small:
        blocks.append(np.concatenate(small))
    return tuple(blocks)


def _neighbours(parts: Sequence[Array]) -> list[tuple[int, int]]:
    """The first and behind the last of the parts that stand one behind the other in one array."""
    places = [_place(part) for part in parts]
    edges = [0]
    for index in range(1, len(parts)):
        (owner, start), (before, begin) = places[index], places[index - 1]
        if owner is None or owner is not before or start != begin + parts[index - 1].nbytes:
            edges.append(index)
    return list(zip(edges, [*edges[1:], len(parts)], strict=True)) if len(parts) else []


def _place(part: Array) -> tuple[object | None, int]:
    """The array of which a part was cut, none where it was not or not in one piece, and where it begins."""
    owner, begin = part.base, part.__array_interface__["data"][0]
    if isinstance(owner, np.ndarray) and owner.dtype == part.dtype:
        return (owner if owner.flags.c_contiguous and part.flags.c_contiguous else None), begin
    return None, begin


def _whole(parts: Sequence[Array]) -> Array:
    """Parts that stand one behind the other, as a view of the array of which they were cut."""
    if len(parts) == 1:
        return parts[0]
    owner = parts[0].base
    assert isinstance(owner, np.ndarray)
    start = (_place(parts[0])[1] - _place(owner)[1]) // owner.itemsize
    count, numbers = sum(len(part) for part in parts), parts[0].shape[1]
    return np.asarray(owner.reshape(-1)[start : start + count * numbers].reshape(count, numbers))
