"""False discovery rate over many tests: Benjamini-Hochberg and Benjamini-Yekutieli.

Hochberg's holds for tests that are independent or positively dependent (the coordinates of one campaign);
Yekutieli's under any dependence, at the price of the factor 1 + 1/2 + ... + 1/m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_probability

Method = Literal["benjamini-hochberg", "benjamini-yekutieli"]


@dataclass(frozen=True)
class FalseDiscoveries:
    """``q_value`` (m,): the smallest rate at which each test would be called; ``called`` (m,): q <= rate."""

    method: Method
    rate: float
    p_value: Array
    q_value: Array
    called: npt.NDArray[np.bool_]


def control_false_discoveries(
    p_values: npt.ArrayLike, *, rate: float = 0.05, method: Method = "benjamini-hochberg"
) -> FalseDiscoveries:
    """Return the q-values of ``p_values`` (m,) with the false discovery rate controlled at ``rate``.

    A NaN (a test that could not be made) stays NaN, is never called and is not counted among the tests.
    Raises ``DataError`` for a p-value outside 0 to 1, a rate outside 0 to 1 or an unknown method. Sources:
    Benjamini and Hochberg, J. R. Stat. Soc. B 57 (1995) 289; Benjamini and Yekutieli, Ann. Stat. 29 (2001)
    1165, Theorem 1.3.
    """
    p = np.asarray(p_values, dtype=np.float64)
    if p.ndim != 1:
        raise DataError(f"p_values has shape {p.shape}; one dimension is needed.")
    outside = np.flatnonzero((p < 0.0) | (p > 1.0))
    if outside.size:
        raise DataError(f"p_values[{outside[0]}] is {p[outside[0]]}; a probability lies from 0 to 1.")
    as_probability(rate, "rate")
    if method not in ("benjamini-hochberg", "benjamini-yekutieli"):
        raise DataError(f"method is {method!r}; there are 'benjamini-hochberg' and 'benjamini-yekutieli'.")
    q = np.full_like(p, np.nan)
    tested = np.flatnonzero(~np.isnan(p))
    m = tested.size
    if m:
        order = tested[np.argsort(p[tested], kind="stable")]
        rank = np.arange(1, m + 1)
        price = 1.0 if method == "benjamini-hochberg" else float((1.0 / rank).sum())
        step_up = np.minimum.accumulate((p[order] * m * price / rank)[::-1])[::-1]
        q[order] = np.minimum(step_up, 1.0)
    return FalseDiscoveries(method, rate, p, q, np.asarray(q <= rate))
