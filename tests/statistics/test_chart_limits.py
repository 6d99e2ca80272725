"""The tables of limits hold what would be computed."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from monitor.statistics import ewma_chart, mewma_chart, reference_period
from monitor.statistics.charts.chart_limits import (
    ARL,
    ARL_VECTOR,
    LAM,
    REFERENCE,
    K,
    tabulated_limit,
    tabulated_vector_limit,
)
from monitor.statistics.charts.run_length import cusum_run_length, ewma_run_length, run_length
from monitor.statistics.charts.vector_control import mewma_limit


@pytest.mark.parametrize("n", [5, 8, 17, 30, 60])
def test_tabulated_limits_have_the_run_length_by_markov_chain(n: int) -> None:
    for name, chart, constant in (
        ("ewma", partial(ewma_run_length, lam=LAM), LAM),
        ("cusum", partial(cusum_run_length, k=K), K),
    ):
        limit = tabulated_limit(name, constant, ARL, n, n - 1.0)
        assert limit is not None
        # The limits were found to 1e-4.
        assert run_length(chart, limit, n, n - 1.0) == pytest.approx(ARL, rel=3e-3)


@pytest.mark.parametrize("p", [1, 6, 15])
def test_tabulated_vector_limits_agree_with_another_simulation(p: int) -> None:
    table = tabulated_vector_limit(p, REFERENCE, LAM, ARL_VECTOR)
    ours = mewma_limit(p, REFERENCE, LAM, ARL_VECTOR, np.random.default_rng(p), 1000)
    assert ours == pytest.approx(table, rel=0.05)  # four standard deviations of 1000 charts


def test_only_what_was_tabulated_comes_from_the_table() -> None:
    rng = np.random.default_rng(1)
    assert tabulated_limit("ewma", LAM, ARL, 61, 60.0) is None
    assert tabulated_limit("ewma", 0.1, ARL, 30, 29.0) is None
    assert tabulated_limit("cusum", K, 500.0, 30, 29.0) is None
    assert tabulated_limit("cusum", K, ARL, 30, 18.0) is None
    assert tabulated_vector_limit(29, REFERENCE, LAM, ARL_VECTOR) is None
    assert tabulated_vector_limit(3, 29, LAM, ARL_VECTOR) is None
    assert tabulated_vector_limit(3, REFERENCE, LAM, 100.0) is None
    known = reference_period(rng.standard_normal(30))
    assert ewma_chart(rng.standard_normal(4), known, arl=ARL).limit == tabulated_limit(
        "ewma", LAM, ARL, 30, 29.0
    )
    chart = mewma_chart(rng.standard_normal((4, 3)), rng.standard_normal((30, 3)), rng=rng)
    assert chart.limit == tabulated_vector_limit(3, 30, LAM, ARL_VECTOR)
