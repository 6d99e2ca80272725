"""Distributions that one input quantity may have (JCGM 101:2008 6.4).

Each has ``mean``, ``std`` and ``quantile``; the copula in ``sampling`` joins them. Choose by what is known:
``Normal`` from a certificate with k = 2, ``StudentT`` from a few repeated readings, ``Rectangular`` from
limits, ``Triangular`` from the sum of two equal limits, ``Arcsine`` from a sinusoidal disturbance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy

from monitor.exceptions import DataError
from monitor.records import Array


class Marginal(Protocol):
    """One input's distribution."""

    @property
    def mean(self) -> float:
        """Expectation."""

    @property
    def std(self) -> float:
        """Return Standard deviation; infinite where it does not exist."""

    def quantile(self, probability: Array) -> Array:
        """The values that are exceeded with probability 1 - ``probability``, any shape."""


def _limits(kind: str, low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise DataError(f"a {kind} distribution needs finite low < high, but has low {low}, high {high}")


@dataclass(frozen=True)
class Normal:
    """Normal with expectation ``mean`` and standard deviation ``std`` >= 0 (JCGM 101 6.4.7)."""

    mean: float
    std: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and 0.0 <= self.std < math.inf):
            raise DataError(f"a normal distribution needs a finite std >= 0, but has {self.mean}, {self.std}")

    def quantile(self, probability: Array) -> Array:
        """Quantiles."""
        return np.asarray(self.mean + self.std * scipy.special.ndtri(probability))


@dataclass(frozen=True)
class StudentT:
    """Scaled and shifted t (JCGM 101 6.4.9); ``scale`` is not the standard deviation: that is larger."""

    mean: float
    scale: float
    dof: float

    def __post_init__(self) -> None:
        if not (self.scale >= 0.0 and self.dof > 0.0):
            raise DataError(f"a t distribution needs scale >= 0, dof > 0, but has {self.scale}, {self.dof}")

    @property
    def std(self) -> float:
        """Return scale sqrt(dof / (dof - 2)); infinite for dof <= 2."""
        return self.scale * math.sqrt(self.dof / (self.dof - 2.0)) if self.dof > 2.0 else math.inf

    def quantile(self, probability: Array) -> Array:
        """Quantiles."""
        return np.asarray(self.mean + self.scale * scipy.special.stdtrit(self.dof, probability))


@dataclass(frozen=True)
class _Limited:
    """A symmetric distribution between ``low`` and ``high``."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _limits(type(self).__name__.lower(), self.low, self.high)

    @property
    def mean(self) -> float:
        """The middle."""
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True)
class Rectangular(_Limited):
    """Equally likely between ``low`` and ``high`` (JCGM 101 6.4.2)."""

    @property
    def std(self) -> float:
        """Return Half-width over sqrt(3)."""
        return (self.high - self.low) / math.sqrt(12.0)

    def quantile(self, probability: Array) -> Array:
        """Quantiles."""
        return np.asarray(self.low + (self.high - self.low) * probability)


@dataclass(frozen=True)
class Triangular(_Limited):
    """Symmetric triangle between ``low`` and ``high`` (JCGM 101 6.4.5)."""

    @property
    def std(self) -> float:
        """Return Half-width over sqrt(6)."""
        return (self.high - self.low) / math.sqrt(24.0)

    def quantile(self, probability: Array) -> Array:
        """Quantiles."""
        width = self.high - self.low
        nearer = np.sqrt(0.5 * np.minimum(probability, 1.0 - probability))
        return np.asarray(np.where(probability <= 0.5, self.low + width * nearer, self.high - width * nearer))


@dataclass(frozen=True)
class Arcsine(_Limited):
    """U-shaped between ``low`` and ``high``: a sine of unknown phase (JCGM 101 6.4.6)."""

    @property
    def std(self) -> float:
        """Return Half-width over sqrt(2)."""
        return (self.high - self.low) / math.sqrt(8.0)

    def quantile(self, probability: Array) -> Array:
        """Quantiles."""
        half = 0.5 * (self.high - self.low)
        return np.asarray(self.mean + half * np.sin(math.pi * (probability - 0.5)))
