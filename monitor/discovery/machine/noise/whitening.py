"""One correlation taken out of many columns: the filter of Kalman along all touches, at a cost that grows with these.

The state that the filter predicts follows a recursion from touch to touch, a system of equations with one diagonal
beside the main one, which LAPACK solves for all columns at once. A triangle of weights for every run would cost the
square of its touches: 6 000 rows of a tracker were 300 MB.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from monitor.discovery.machine.noise.correlation import Correlation, Filters
from monitor.discovery.machine.noise.rows import Rows
from monitor.records import Array


@dataclass(frozen=True)
class Whitening:
    """The filter that takes a correlation out of numbers (..., R, N), run by run."""

    rows: Rows
    correlation: Correlation

    def __call__(self, numbers: Array) -> Array:
        """Independent numbers (..., R, N) of equal variance from correlated ones."""
        readings = self._readings(numbers)
        if self.rows.turned is not None:
            readings = (self.rows.turned @ readings[..., None])[..., 0]
        columns = self._columns(readings)
        gain, rho, reciprocal = self._recursion
        columns -= _followed(rho[1:] * (1.0 - gain[:-1]), columns, rho[1:] * gain[:-1])
        columns *= reciprocal
        return self._numbers(self._of_columns(columns), numbers)

    def undone(self, white: Array) -> Array:
        """The numbers (R, N) that were made independent; zero for touches without weight."""
        columns = self._columns(self._readings(white))
        gain, rho, reciprocal = self._recursion
        columns *= np.where(reciprocal > 0.0, 1.0 / np.where(reciprocal > 0.0, reciprocal, 1.0), 0.0)
        columns += _followed(rho[1:], columns, rho[1:] * gain[:-1])
        columns[:, reciprocal == 0.0] = 0.0
        return self._turned_back(columns, white)

    def transposed(self, white: Array) -> Array:
        """The transposed filter of numbers (k, R, N): their products with filtered ones are those of what it returns
        with the ones before the filter."""
        columns = self._columns(self._readings(white))
        gain, rho, reciprocal = self._recursion
        columns *= reciprocal
        columns -= _leading(rho[1:] * (1.0 - gain[:-1]), columns, rho[1:] * gain[:-1])
        return self._turned_back(columns, white)

    def _turned_back(self, columns: Array, like: Array) -> Array:
        """Numbers (..., R, N) of columns (k d, R T), in the directions of the readings."""
        readings = self._of_columns(columns)
        if self.rows.turned is not None:
            readings = (np.swapaxes(self.rows.turned, -1, -2) @ readings[..., None])[..., 0]
        return self._numbers(readings, like)

    @cached_property
    def _recursion(self) -> tuple[Array, Array, Array]:
        """Gains, what is left of the state of the touch before, and reciprocal standard deviations of the innovations
        (R T,) of all touches in the order of neighbours; nothing is left where a run begins."""
        rows = self.rows
        filters = Filters((self.correlation,), rows.by_neighbours(rows.weighted), rows.begins, rows.steps)
        gain, reciprocal, _ = filters.recursion
        rho = np.array(filters.rho[0])
        rho[:, 0] = 0.0
        return gain.reshape(-1), rho.reshape(-1), reciprocal.reshape(-1)

    def _readings(self, numbers: Array) -> Array:
        """The readings (k, R, T, d) among numbers (..., R, N)."""
        rows = self.rows
        return numbers[..., : rows.count].reshape(-1, *rows.weighted.shape, rows.numbers)

    def _numbers(self, readings: Array, like: Array) -> Array:
        """Numbers (..., R, N) with other readings (k, R, T, d)."""
        numbers = np.empty(like.shape)
        self._readings(numbers)[...] = readings
        numbers[..., self.rows.count :] = like[..., self.rows.count :]
        return numbers

    def _columns(self, readings: Array) -> Array:
        """Readings (k, R, T, d) as columns (k d, R T) of their own in the order of neighbours."""
        order = self.rows.order
        if order is not None:
            readings = np.take_along_axis(readings, order[None, :, :, None], axis=2)
        return np.array(np.moveaxis(readings, 3, 1), order="C").reshape(-1, self.rows.weighted.size)

    def _of_columns(self, columns: Array) -> Array:
        """Readings (k, R, T, d) of columns (k d, R T)."""
        rows = self.rows
        readings = np.moveaxis(columns.reshape(-1, rows.numbers, *rows.weighted.shape), 1, 3)
        if rows.order is None:
            return readings
        return np.take_along_axis(readings, np.argsort(rows.order, axis=1)[None, :, :, None], axis=2)


def _followed(retained: Array, columns: Array, taken: Array) -> Array:
    """States (k, M) that keep the parts ``retained`` (M - 1,) of what was before, and take the parts ``taken`` (M - 1,)
    of what stands before in columns (k, M)."""
    entered = np.zeros_like(columns)
    np.multiply(columns[:, :-1], taken, out=entered[:, 1:])
    return _recursed(retained, entered, "N")


def _leading(retained: Array, columns: Array, taken: Array) -> Array:
    """The transposed of ``_followed``, from the last of columns (k, M) to the first."""
    led = np.zeros_like(columns)
    np.multiply(_recursed(retained, np.array(columns), "T")[:, 1:], taken, out=led[:, :-1])
    return led


def _recursed(retained: Array, entered: Array, direction: str) -> Array:
    """What adds up to (k, M) where of each number the part ``retained`` (M - 1,) stays in its neighbour, the one behind
    it ("N") or before it ("T"); ``entered`` (k, M) is used up."""
    # With no column at all the wrapper of LAPACK writes outside of it.
    if not entered.size:
        return entered
    band = np.ones((2, entered.shape[1]), order="F")
    band[1, :-1] = -retained
    states, failed = scipy.linalg.lapack.dtbtrs(
        band, entered.T, uplo="L", trans=direction, diag="U", overwrite_b=1
    )
    assert failed == 0
    return np.asarray(states).T
