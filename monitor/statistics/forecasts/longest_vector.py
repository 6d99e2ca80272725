"""The longest of many vectors that follow parameters linearly: its length, and which vectors can be it at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: A grid counts as straight along an axis where its second differences are below this share of the largest derivative
#: by their parameter, or of the length in question: dropping what lies between moves the longest vector by less than
#: 1e-8 of it.
STRAIGHT = 1e-10
#: Rows of parameters whose vectors are held at once: those of 200 points then stay in the cache of a core.
_BLOCK = 100


@dataclass(frozen=True)
class ErrorVectors:
    """Error vectors ``offset`` (k, 3) + ``sensitivity`` (k, 3, p) parameters at k points, in the unit of the limit.

    ``offset`` are the vectors with all p parameters at zero.
    """

    sensitivity: Array
    offset: Array

    def longest(self, parameters: Array) -> Array:
        """Return the length (m,) of the longest vector for each row (m, p) of parameters."""
        return longest(parameters, self.sensitivity, self.offset)

    def places(self, indices: Sequence[int]) -> ErrorVectors:
        """Return the vectors at some of the k places."""
        return ErrorVectors(self.sensitivity[indices], self.offset[indices])


def longest(parameters: Array, sensitivity: Array, offset: Array) -> Array:
    """Return the longest (m,) of the vectors ``offset`` (k, 3) + ``sensitivity`` (k, 3, p) for each row (m, p)."""
    turned = [np.ascontiguousarray(sensitivity[:, axis].T) for axis in range(3)]
    largest_squares = np.empty(len(parameters))
    for start in range(0, len(parameters), _BLOCK):
        rows = parameters[start : start + _BLOCK]
        squares = np.zeros((len(rows), len(offset)))
        for axis in range(3):
            along = rows @ turned[axis]
            along += offset[:, axis]
            along *= along
            squares += along
        largest_squares[start : start + _BLOCK] = squares.max(axis=1)
    return np.sqrt(largest_squares)


def may_be_longest(
    sensitivity: Array, offset: Array, shape: Sequence[int], length: float
) -> npt.NDArray[np.intp]:
    """Return the places (c,) of the vectors of a grid that can be the longest, whatever the parameters.

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
