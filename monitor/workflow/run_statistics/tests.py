"""Tests of a campaign's runs beyond equal means and variances: normal scatter, components of variance, the vector.

Each returns a part of the document of `monitor stats`; what the runs do not suffice for is refused in words.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics import box_m, manova, normality, p_value_histogram, variance_components
from monitor.statistics.multivariate import VectorTest

Document = dict[str, Any]

# Seeds the null distribution of the normality test; stored with the result.
SEED = 20260302
TRIALS = 9999
BINS = 20


def number(value: float) -> float | None:
    """A finite number or None."""
    return float(value) if np.isfinite(value) else None


def normal_scatter(values: Array, groups: Sequence[str]) -> list[float | None]:
    """p-value of normal scatter within the groups, column by column (Shapiro-Francia, simulated)."""
    alone = len(set(groups)) == len(groups)
    try:
        found = normality(
            values, None if alone else np.array(groups), rng=np.random.default_rng(SEED), trials=TRIALS
        )
    except DataError:
        return [None] * values.shape[1]
    return [number(p) for p in found.p_value]


def components(values: Array, groups: Sequence[str]) -> list[Document]:
    """Standard deviations between and within the groups of each column, with 95 % intervals."""
    try:
        found = variance_components(values, np.array(groups))
    except DataError as error:
        return [{"why": f"no components of variance: {error}"}] * values.shape[1]
    return [
        {
            "why": None,
            "between": float(found.between[j]),
            "between_interval": [number(x) for x in found.between_interval[j]],
            # A negative estimate is given as zero; its interval still holds.
            "truncated": bool(found.truncated[j]),
            "within": float(found.within[j]),
            "within_interval": [number(x) for x in found.within_interval[j]],
            "u_run_on_a_day_of_its_own": float(found.u_run[j]),
            "degrees_of_freedom": number(found.dof_run[j]),
        }
        for j in range(values.shape[1])
    ]


def vector_tests(values: Array, groups: Sequence[str]) -> Document:
    """Box's M and MANOVA (Hotelling's T² for two groups) of all parameters together, or why not."""
    return {name: _vector(test, values, groups) for name, test in (("box_m", box_m), ("manova", manova))}


def _vector(test: Callable[[Array, Any], VectorTest], values: Array, groups: Sequence[str]) -> Document:
    try:
        found = test(values, np.array(groups))
    except DataError as error:
        return {"why": str(error), "p_value": None}
    return {
        "why": None,
        "name": found.name,
        "statistic": number(found.statistic),
        "f": number(found.f),
        "degrees_of_freedom": [number(found.dof), number(found.dof_denominator)],
        "p_value": number(found.p_value),
    }


def histogram(p_values: Sequence[float | None]) -> Document:
    """How many coordinates have a p-value in each twentieth from 0 to 1; flat where the groups are alike."""
    found = p_value_histogram([np.nan if p is None else p for p in p_values], bins=BINS)
    return {"edges": found.edges.tolist(), "counts": found.counts.tolist(), "expected": found.expected}
