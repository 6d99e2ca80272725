"""Model against measurement: the tests of lack of fit and of the excess over the stated uncertainty, and the verdict.

Lack of fit is tested against pure error (Draper and Smith, Applied regression analysis, section 2.1), the whole
residual against the stated standard uncertainty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array, Verdict

# Lack of fit is significant below this p-value: one false alarm in a thousand campaigns, so that it adds little to
# the scan's own one in a hundred.
LACK_OF_FIT_LEVEL = 1e-3
# A standard uncertainty from ten observations is itself known to 24 % (JCGM 100:2008, table E.1), and few probes
# were tested with more; what exceeds the statement by less than that is not significant.
STATEMENT_TOLERANCE = 1.25


@dataclass(frozen=True)
class LackOfFit:
    """F of lack of fit over pure error on (``degrees_of_freedom``, ``pure_error_degrees_of_freedom``)."""

    f: float
    p_value: float
    degrees_of_freedom: float
    pure_error_degrees_of_freedom: float


@dataclass(frozen=True)
class Part:
    """Root mean square and largest component of the residual over a part of the rows, in the unit of the residual."""

    rms: float
    largest: float
    count: int


@dataclass(frozen=True)
class Comparison:
    """A model against measurements, in the unit of the residual.

    ``expected_rms`` is what the stated standard uncertainty would leave after the fit; ``repeatability`` the standard
    deviation of repeated readings (None without); ``residual_deviation`` the root mean square per degree of freedom,
    comparable with both. ``excess_p_value`` tests the residual against the stated uncertainty. What needs a stated
    uncertainty is None without. ``by`` breaks the residual down.
    """

    rms: float
    expected_rms: float | None
    repeatability: float | None
    residual_deviation: float
    stated_uncertainty: float | None
    lack_of_fit: LackOfFit | None
    excess_p_value: float | None
    verdict: Verdict
    by: Mapping[str, Mapping[str, Part]]


def part_of(residual: Array) -> Part:
    """The part that residuals (n,) or (n, d) are."""
    return Part(float(np.sqrt(np.mean(residual**2))), float(np.abs(residual).max()), len(residual))


def split(
    residual: Array, cells: npt.NDArray[np.int64], read: npt.NDArray[np.bool_] | None = None
) -> tuple[float, float, int]:
    """Split the sum of squares of residuals (n, d) into that about the mean of their cell and that of these means.

    Return both, and how many numbers the first rests on: those that were ``read`` (n, d) less one a cell and column.
    What was not read has the residual 0. None: all were.
    """
    cell = np.unique(cells, return_inverse=True)[1].reshape(-1)
    present = np.ones(residual.shape) if read is None else read.astype(np.float64)
    total = np.stack([np.bincount(cell, weights=column) for column in residual.T], axis=1)
    count = np.stack([np.bincount(cell, weights=column) for column in present.T], axis=1)
    mean = total / np.maximum(count, 1.0)
    scatter = float(np.sum(present * (residual - mean[cell]) ** 2))
    return scatter, float(np.sum(count * mean**2)), int(present.sum()) - int(np.count_nonzero(count))


def lack_of_fit_test(
    lack: float,
    degrees_of_freedom: float,
    pure_error: float,
    pure_error_degrees_of_freedom: float,
    together: float = 1.0,
) -> LackOfFit | None:
    """Test the sum of squares of lack of fit against that of pure error; None where either has no freedom.

    Where so many readings were taken ``together`` they share what the machine did there, and the p-value counts them
    as one.
    """
    if degrees_of_freedom < 1 or pure_error_degrees_of_freedom < 1 or pure_error <= 0.0:
        return None
    f = (lack / degrees_of_freedom) / (pure_error / pure_error_degrees_of_freedom)
    p_value = float(
        scipy.special.fdtrc(degrees_of_freedom / together, pure_error_degrees_of_freedom / together, f)
    )
    return LackOfFit(float(f), p_value, float(degrees_of_freedom), float(pure_error_degrees_of_freedom))


def excess_p_value(chi_square: float, degrees_of_freedom: int) -> float:
    """Return p-value of a sum of squares in stated standard uncertainties."""
    return float(scipy.special.chdtrc(degrees_of_freedom, chi_square))


def verdict_of(
    test: LackOfFit | None, deviation: float, stated: float | None, excess: float | None
) -> Verdict:
    """The verdict of both tests; ``deviation`` and ``stated`` are standard deviations in the same unit."""
    missing = test is not None and test.p_value < LACK_OF_FIT_LEVEL
    if stated is not None and excess is not None:
        missing |= deviation > STATEMENT_TOLERANCE * stated and excess < LACK_OF_FIT_LEVEL
    return Verdict.SOMETHING_IS_MISSING if missing else Verdict.EXPLAINED
