"""Tests of a campaign's runs beyond equal means and variances: normal scatter, components of variance, the vector.

Each gives a part of the answer of `monitor stats`; what the runs do not suffice for is refused in words.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Part, refused
from monitor.statistics import box_m, manova, p_value_histogram, variance_components
from monitor.statistics.multivariate import VectorTest
from monitor.statistics.normality import normality
from monitor.workflow.run_statistics.answer import (
    HistogramAnswer,
    NoVarianceComponents,
    NoVectorTest,
    VarianceComponents,
    VectorTestAnswer,
    VectorTests,
)

# Seeds the null distribution of the normality test; stored with the result.
SEED = 20260302
TRIALS = 9999
BINS = 20


def finite(value: float) -> float | None:
    """A finite number or None."""
    return float(value) if np.isfinite(value) else None


def normal_scatter(values: Array, groups: Sequence[str]) -> tuple[float | None, ...]:
    """Return p-value of normal scatter within the groups, column by column (Shapiro-Francia, simulated)."""
    single = len(set(groups)) == len(groups)
    labels = None if single else np.array(groups)
    try:
        test = normality(values, labels, rng=np.random.default_rng(SEED), trials=TRIALS)
    except DataError:
        return tuple(None for _ in range(values.shape[1]))
    return tuple(finite(p) for p in test.p_value.tolist())


def components(values: Array, groups: Sequence[str]) -> Sequence[VarianceComponents | NoVarianceComponents]:
    """Standard deviations between and within the groups of each column, with 95 % intervals."""
    try:
        estimates = variance_components(values, np.array(groups))
    except DataError as error:
        return [NoVarianceComponents(refused(Part.COMPONENTS, error))] * values.shape[1]
    return [
        VarianceComponents(
            why=None,
            between=float(estimates.between[j]),
            between_interval=tuple(finite(end) for end in estimates.between_interval[j]),
            truncated=bool(estimates.truncated[j]),
            within=float(estimates.within[j]),
            within_interval=tuple(finite(end) for end in estimates.within_interval[j]),
            u_run_on_a_day_of_its_own=float(estimates.u_run[j]),
            degrees_of_freedom=finite(estimates.dof_run[j]),
        )
        for j in range(values.shape[1])
    ]


def vector_tests(values: Array, groups: Sequence[str]) -> VectorTests:
    """Box's M and MANOVA (Hotelling's T² for two groups) of all parameters together, or why not."""
    return VectorTests(_vector(box_m, values, groups), _vector(manova, values, groups))


def _vector(
    test: Callable[[Array, np.ndarray], VectorTest], values: Array, groups: Sequence[str]
) -> VectorTestAnswer | NoVectorTest:
    try:
        result = test(values, np.array(groups))
    except DataError as error:
        return NoVectorTest(str(error))
    return VectorTestAnswer(
        why=None,
        name=result.name,
        statistic=finite(result.statistic),
        f=finite(result.f),
        degrees_of_freedom=(finite(result.dof), finite(result.dof_denominator)),
        p_value=finite(result.p_value),
    )


def histogram(p_values: Sequence[float | None]) -> HistogramAnswer:
    """How many coordinates have a p-value in each twentieth from 0 to 1; flat where the groups are alike."""
    result = p_value_histogram([np.nan if p is None else p for p in p_values], bins=BINS)
    return HistogramAnswer(tuple(result.edges.tolist()), tuple(result.counts.tolist()), result.expected)
