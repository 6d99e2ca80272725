"""Do two results of one quantity agree within their uncertainties? The normalised error E_n.

E_n = (x1 - x2) / sqrt(U1² + U2²), with expanded uncertainties U = k u, k = 2 (ISO/IEC 17043:2023, annex B, and
ISO 13528:2022, 9.7). The two agree where |E_n| <= 1. It holds for independent results: what both share (the same scale,
the same reference temperature) is counted twice in the denominator, so that E_n is then too small, never too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array

#: The coverage factor of U in E_n (ISO 13528:2022, 9.7).
K = 2.0


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
    first: npt.ArrayLike, u_first: npt.ArrayLike, second: npt.ArrayLike, u_second: npt.ArrayLike
) -> NormalisedErrors:
    """E_n of two sets of results (k,) with standard uncertainties (k,) in the same units.

    Raises ``DataError`` for shapes that differ, numbers that are not finite, or uncertainties that are negative or
    both zero. Of independent normal results with right uncertainties 4.6 % have |E_n| > 1.
    """
    columns = [
        np.atleast_1d(np.asarray(column, dtype=np.float64)) for column in (first, u_first, second, u_second)
    ]
    x1, u1, x2, u2 = columns
    if len({column.shape for column in columns}) != 1:
        raise DataError(
            f"values and uncertainties must be alike in number, not {[column.shape for column in columns]}"
        )
    if not all(np.isfinite(column).all() for column in columns):
        raise DataError("values and uncertainties must be finite")
    if np.any(u1 < 0.0) or np.any(u2 < 0.0) or np.any(np.hypot(u1, u2) == 0.0):
        raise DataError("a standard uncertainty must not be negative, and of two results one must have one")
    expanded = K * np.hypot(u1, u2)
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
