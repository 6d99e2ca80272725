"""A missing effect as a result: size, evidence, error before and after, and what it may be mistaken for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects.description import Description
from monitor.records import Array
from monitor.units import Unit


@dataclass(frozen=True)
class Rival:
    """An effect that is not ruled out; ``coincides`` says that no data of this plan could rule it out."""

    effect: str
    coincides: bool


@dataclass(frozen=True)
class Searched:
    """A value that was searched: name, best value and standard uncertainty (None where there is none) in ``unit``;
    ``frequency`` is the inverse of a searched period. Where the data do not determine it, ``u`` is None, and
    ``at_least`` what it exceeds at 95 %, if anything."""

    name: str
    value: float
    u: float | None
    unit: str
    frequency: float | None = None
    at_least: float | None = None


@dataclass(frozen=True)
class Missing:
    """A missing effect, in internal units (sizes) and in the unit of the residual (peak and errors).

    ``effect`` is written as it is to be added to the model. ``coefficients`` (k,) have the ``covariance`` (k, k), the
    names ``parameters`` and the ``units``. ``amplitude``, with standard uncertainty ``u``, is the coefficient, or the
    length of several (cosine and sine). Held-out errors are per degree of freedom, None where too few rows can be
    left out.
    """

    rank: int
    effect: str
    description: Description
    parameters: tuple[str, ...]
    units: tuple[Unit, ...]
    coefficients: Array
    covariance: Array
    amplitude: float
    u: float
    peak: float
    searched: Searched | None
    p_value: float
    q_value: float
    rms_before: float
    rms_after: float
    held_out_before: float | None
    held_out_after: float | None
    rivals: tuple[Rival, ...]

    @property
    def u_coefficients(self) -> Array:
        """Standard uncertainty (k,) of each coefficient."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))
