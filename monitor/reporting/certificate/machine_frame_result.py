"""The location errors of a certificate in the frame of the machine, as numbers to be kept with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from monitor.records import Array


@dataclass(frozen=True, eq=False)
class MachineFrameResult:
    """Location errors in the machine frame: r sums of the parameters of a result, in its display units.

    ``estimate`` (r,), ``covariance`` (r, r); ``sums`` has of each its parameters with their factors. ``k`` is the
    coverage factor of one of them by itself for the probability ``p``.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    sums: Mapping[str, Mapping[str, float]]
    k: float
    p: float

    @property
    def u(self) -> Array:
        """Standard uncertainties (r,)."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))

    @property
    def moved(self) -> tuple[int, ...]:
        """The rows whose value is not the one that is stated relative to the axis before."""
        return tuple(index for index, name in enumerate(self.names) if self.sums[name] != {name: 1.0})
