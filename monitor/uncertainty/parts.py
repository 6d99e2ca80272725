"""Parts of a covariance: what each source adds, how well that is known, and how it would scatter if measured again.

The one interface between what makes up a covariance of outputs (readings, calibrated quantities, linear axes, lack of
fit, any other source) and what follows from it (effective degrees of freedom, coverage factors): a list of parts that
add up, each with its degrees of freedom and with what these degrees are of.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from monitor.records import Array


class Estimated(StrEnum):
    """What the degrees of freedom of a part of a covariance are of; without meaning where they are infinite.

    ``MATRIX``: every element was estimated, from so many independent repetitions of all quantities together; a repeated
    estimate follows a Wishart distribution. ``SCALE``: the shape is known and only one common size was estimated (a
    relative uncertainty of an uncertainty, GUM G.4.2; a mean square of residuals): a chi-square distribution.
    """

    MATRIX = "matrix"
    SCALE = "scale"


@dataclass(frozen=True)
class BudgetLine:
    """What one source adds to the output covariance (m, m), and its degrees of freedom.

    A line named ``a × b`` is the covariance between two sources, which may be negative. A source whose
    degrees of freedom do not apply (a covariance between sources) has None. ``estimated_with`` is the source from
    whose estimate it follows, where that is another.
    """

    source: str
    covariance: Array
    dof: float | None
    estimated: Estimated = Estimated.MATRIX
    estimated_with: str | None = None

    @property
    def variance(self) -> Array:
        """What the source adds to each output's variance (m,)."""
        return np.asarray(np.diag(self.covariance))

    @property
    def known(self) -> bool:
        """Whether nothing of it was estimated."""
        return self.dof is None or math.isinf(self.dof)


@dataclass(frozen=True)
class OutputContribution:
    """A covariance (m, m) that acts on the outputs directly, such as what lack of fit leaves; ``estimated_with`` as in
    ``BudgetLine``."""

    source: str
    covariance: Array
    dof: float = math.inf
    estimated: Estimated = Estimated.SCALE
    estimated_with: str | None = None


def known(parts: Sequence[BudgetLine]) -> tuple[BudgetLine, ...]:
    """Return the parts as if nothing of them were estimated."""
    return tuple(replace(part, dof=math.inf) for part in parts)


def one_of_each_estimate(parts: Sequence[BudgetLine]) -> tuple[BudgetLine, ...]:
    """Return the parts with those that follow from one estimate as one: they are too small or too large together, and
    two of them say no more about the sum than one."""
    estimates: dict[str, BudgetLine] = {}
    for part in parts:
        name = part.estimated_with or part.source
        before = estimates.get(name)
        estimates[name] = (
            replace(part, source=name, estimated_with=None)
            if before is None
            else replace(before, covariance=before.covariance + part.covariance)
        )
    return tuple(estimates.values())
