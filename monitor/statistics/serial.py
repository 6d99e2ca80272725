"""Runs that resemble each other: a first-order process in their order, or a component common to the runs of a day.

Each shape is a correlation matrix known up to one number. It makes rows independent (``whiten``) and gives
independent rows its correlation (``colour``), so that searches can be calibrated for runs that are not independent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from monitor.records import Array


class Shape(Protocol):
    """A correlation of n runs; all methods take rows (n, m) and leave them as they are."""

    @property
    def strength(self) -> float:
        """The one number of the shape; 0 where the runs are independent."""

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the covariance, for innovations (or runs) of unit variance."""

    def whiten(self, rows: Array) -> Array:
        """W rows with W V W' = 1."""

    def back(self, rows: Array) -> Array:
        """W' rows."""

    def colour(self, draws: Array) -> Array:
        """Independent rows with the correlation of the shape."""


@dataclass(frozen=True)
class FirstOrder:
    """Stationary process of first order with correlation ``strength`` of neighbours, whatever the time between."""

    strength: float

    @property
    def log_determinant(self) -> float:
        """That of innovations of unit variance."""
        return -float(np.log1p(-self.strength * self.strength))

    def whiten(self, rows: Array) -> Array:
        """Prais and Winsten, Cowles Commission Discussion Paper 383 (1954)."""
        r, result = self.strength, np.array(rows, dtype=np.float64)
        if r > 0.0:
            result[1:] -= r * rows[:-1]
            result[0] *= np.sqrt(1.0 - r * r)
        return result

    def back(self, rows: Array) -> Array:
        """The transpose of ``whiten``."""
        r, result = self.strength, np.array(rows, dtype=np.float64)
        if r > 0.0:
            result[0] *= np.sqrt(1.0 - r * r)
            result[:-1] -= r * rows[1:]
        return result

    def colour(self, draws: Array) -> Array:
        """A stationary series of each column."""
        r, result = self.strength, np.array(draws, dtype=np.float64)
        if r > 0.0:
            result[0] /= np.sqrt(1.0 - r * r)
            for i in range(1, len(result)):
                result[i] += r * result[i - 1]
        return result


class DayComponent:
    """A component common to the runs of each day, ``strength`` times the scatter of a run."""

    def __init__(self, strength: float, day: npt.NDArray[np.intp], root: Array) -> None:
        """``day`` (n,) indices from 0; ``root`` (n,) reciprocal uncertainties by which the rows are multiplied."""
        self.strength = strength
        loads = np.zeros((len(day), int(day.max()) + 1))
        loads[np.arange(len(day)), day] = root
        square = (loads**2).sum(axis=0)
        self._unit = loads / np.sqrt(square)
        self._swell = np.sqrt(1.0 + strength * strength * square)[:, np.newaxis]

    @property
    def log_determinant(self) -> float:
        """That of runs of unit variance within their day."""
        return 2.0 * float(np.log(self._swell).sum())

    def whiten(self, rows: Array) -> Array:
        """The symmetric square root of the inverse."""
        return np.asarray(rows - self._unit @ ((1.0 - 1.0 / self._swell) * (self._unit.T @ rows)))

    def back(self, rows: Array) -> Array:
        """As ``whiten``, which is symmetric."""
        return self.whiten(rows)

    def colour(self, draws: Array) -> Array:
        """The symmetric square root."""
        return np.asarray(draws + self._unit @ ((self._swell - 1.0) * (self._unit.T @ draws)))
