"""Running mean and scatter of many trials, merged block by block without keeping them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.records import Array


@dataclass(frozen=True)
class Moments:
    """Count, mean (m,) and scatter (m, m), the sum of products of deviations from the mean."""

    count: int
    mean: Array
    scatter: Array

    @classmethod
    def of(cls, values: Array) -> Moments:
        """The moments of ``values`` (n, m)."""
        mean = values.mean(axis=0) if len(values) else np.zeros(values.shape[1])
        centred = values - mean
        return cls(len(values), mean, centred.T @ centred)

    def merged(self, other: Moments) -> Moments:
        """The moments of both samples together (Chan, Golub and LeVeque 1983, eq. 1.5)."""
        count = self.count + other.count
        if count == 0:
            return self
        step = other.mean - self.mean
        return Moments(
            count,
            self.mean + step * (other.count / count),
            self.scatter + other.scatter + np.outer(step, step) * (self.count * other.count / count),
        )

    @property
    def covariance(self) -> Array:
        """Covariance (m, m) with divisor n - 1."""
        return self.scatter / max(self.count - 1, 1)
