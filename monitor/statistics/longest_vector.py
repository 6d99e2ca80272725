"""The longest of many vectors that follow parameters linearly: its length, and which vectors can be it at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: A grid counts as straight along an axis where its second differences are below this share of the largest derivative
#: by their parameter, or of the length in question: dropping what lies between moves the longest vector by less than
#: 1e-8 of it.
STRAIGHT = 1e-10
#: Rows of parameters whose vectors are held at once: those of 200 points then stay in the cache of a core.
_BLOCK = 100


def longest(parameters: Array, sensitivity: Array, offset: Array) -> Array:
    """Longest of the vectors of each row (m, p) of parameters, (m,): ``offset`` (k, 3) + ``sensitivity`` (k, 3, p)."""
    turned = [np.ascontiguousarray(sensitivity[:, axis].T) for axis in range(3)]
    found = np.empty(len(parameters))
    for start in range(0, len(parameters), _BLOCK):
        rows = parameters[start : start + _BLOCK]
        squares = np.zeros((len(rows), len(offset)))
        for axis in range(3):
            along = rows @ turned[axis]
            along += offset[:, axis]
            along *= along
            squares += along
        found[start : start + _BLOCK] = squares.max(axis=1)
    return np.sqrt(found)


def may_be_longest(
    sensitivity: Array, offset: Array, shape: Sequence[int], length: float
) -> npt.NDArray[np.intp]:
    """Places (c,) of the vectors of a grid that can be the longest, whatever the parameters.

    The k vectors ``offset`` (k, 3) + ``sensitivity`` (k, 3, p) parameters stand on a grid of ``shape``, whose first
    axis counts the poses and whose others have equal steps; ``length`` is one that counts as long. Where they run
    straight along an axis, one between two others is a mean of these with weights that add up to one, and a mean is no
    longer than the longest of what it is the mean of: the ends remain.
    """
    largest = np.abs(sensitivity).max(axis=(0, 1))
    columns = (sensitivity / np.where(largest > 0.0, largest, 1.0), offset[:, :, np.newaxis] / length)
    grid = np.concatenate(columns, axis=2).reshape(*shape, -1)
    places = np.arange(len(offset)).reshape(shape)
    for axis, count in enumerate(shape):
        if axis and count > 2 and float(np.abs(np.diff(grid, 2, axis=axis)).max()) < STRAIGHT:
            ends = np.array([0, count - 1])
            grid = np.asarray(np.take(grid, ends, axis=axis), dtype=np.float64)
            places = np.asarray(np.take(places, ends, axis=axis), dtype=np.intp)
    return places.ravel()
