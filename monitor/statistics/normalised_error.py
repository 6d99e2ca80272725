"""Do two results of one quantity agree within their uncertainties? The normalised error E_n.

E_n = (x1 - x2) / sqrt(U1² + U2²), with expanded uncertainties U = k u, k = 2 (ISO/IEC 17043:2023, annex B, and
ISO 13528:2022, 9.7). The two agree where |E_n| <= 1. Where both share an error (the same scale, the same reference
temperature) its covariance u12 is taken out, E_n = (x1 - x2) / (2 sqrt(u1² + u2² - 2 u12)) (JCGM 100:2008, 5.2.2):
counted twice in the denominator it would make E_n too small, never too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array

#: The coverage factor of U in E_n (ISO 13528:2022, 9.7).
K = 2.0
#: Less than this part of both variances is rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class NormalisedErrors:
    """``difference`` and its expanded uncertainty ``expanded`` (k,), ``e_n`` (k,), all of the second less the first."""

    difference: Array
    expanded: Array
    e_n: Array

    @property
    def agree(self) -> npt.NDArray[np.bool_]:
        """Where the two results agree (k,)."""
        return np.asarray(np.abs(self.e_n) <= 1.0)


def normalised_error(
    first: npt.ArrayLike,
    u_first: npt.ArrayLike,
    second: npt.ArrayLike,
    u_second: npt.ArrayLike,
    covariance: npt.ArrayLike | None = None,
) -> NormalisedErrors:
    """E_n of two sets of results (k,) with standard uncertainties (k,) in the same units, and their covariances (k,).

    Without covariances they are independent. Raises ``DataError`` for shapes that differ, numbers that are not finite,
    uncertainties that are negative or both zero, or a covariance that leaves the difference none. Of independent normal
    results with right uncertainties 4.6 % have |E_n| > 1.
    """
    shared = np.zeros(np.shape(first)) if covariance is None else covariance
    columns = [
        np.atleast_1d(np.asarray(column, dtype=np.float64))
        for column in (first, u_first, second, u_second, shared)
    ]
    x1, u1, x2, u2, both = columns
    if len({column.shape for column in columns}) != 1:
        raise DataError(
            f"values and uncertainties must be alike in number, not {[column.shape for column in columns]}"
        )
    if not all(np.isfinite(column).all() for column in columns):
        raise DataError("values and uncertainties must be finite")
    if np.any(u1 < 0.0) or np.any(u2 < 0.0) or np.any(np.hypot(u1, u2) == 0.0):
        raise DataError("a standard uncertainty must not be negative, and of two results one must have one")
    variance = u1**2 + u2**2 - 2.0 * both
    if np.any(variance <= ROUNDING * (u1**2 + u2**2)):
        raise DataError("two results share more than they are uncertain by; nothing is left that may differ")
    expanded = K * np.sqrt(variance)
    return NormalisedErrors(x2 - x1, expanded, (x2 - x1) / expanded)


def result_of_runs(values: npt.ArrayLike, u: npt.ArrayLike) -> tuple[float, float]:
    """Mean of runs (n,) and its standard uncertainty: their scatter by n, and what the runs state, which they share.

    The stated uncertainty is not divided by n: nobody knows how much of it is common to the runs.
    """
    x, stated = np.asarray(values, dtype=np.float64), np.asarray(u, dtype=np.float64)
    if not len(x) or x.shape != stated.shape or not np.isfinite(x).all() or not np.isfinite(stated).all():
        raise DataError("the runs need finite values and uncertainties, alike in number")
    scatter = float(np.var(x, ddof=1)) / len(x) if len(x) > 1 else 0.0
    return float(x.mean()), float(np.sqrt(scatter + np.mean(stated**2)))
