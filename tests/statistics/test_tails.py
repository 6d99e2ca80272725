"""Tails and quantiles without scipy.stats, against scipy.stats, at what tests meet: zero, infinity, NaN, no freedom."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import scipy.stats

from monitor.statistics import tails

STATISTICS = np.array([0.0, 1e-12, 0.3, 1.0, 7.5, 400.0, np.inf, np.nan])
FREEDOMS = np.array([0.0, 0.5, 1.0, 3.0, 17.1, 400.0])[:, np.newaxis]
TAILS = np.array([1e-6, 0.025, 0.5, 0.975])


def test_tails_are_those_of_scipy_stats() -> None:
    np.testing.assert_array_equal(
        tails.chi_square_tail(STATISTICS, FREEDOMS), scipy.stats.chi2.sf(STATISTICS, FREEDOMS)
    )
    np.testing.assert_array_equal(
        tails.f_tail(STATISTICS, FREEDOMS, 7.3), scipy.stats.f.sf(STATISTICS, FREEDOMS, 7.3)
    )
    np.testing.assert_array_equal(
        tails.student_tail(STATISTICS, FREEDOMS), scipy.stats.t.sf(STATISTICS, FREEDOMS)
    )


def test_quantiles_are_those_of_scipy_stats() -> None:
    np.testing.assert_array_equal(
        tails.chi_square_quantile(TAILS, FREEDOMS), scipy.stats.chi2.isf(TAILS, FREEDOMS)
    )
    np.testing.assert_array_equal(
        tails.f_quantile(TAILS, FREEDOMS, 7.3), scipy.stats.f.isf(TAILS, FREEDOMS, 7.3)
    )


def test_ranks_are_those_of_scipy_stats() -> None:
    values = np.random.default_rng(5).integers(0, 6, size=(25, 4)).astype(float)
    np.testing.assert_array_equal(tails.mean_ranks(values), scipy.stats.rankdata(values, axis=0))


def test_a_verb_that_reads_loads_no_library_of_distributions_or_drawing() -> None:
    asked = "import sys, monitor.cli.verbs.stats_, monitor.cli.verbs.fleet_, monitor.cli.verbs.certificate_; "
    heavy = "{'scipy.stats', 'matplotlib', 'weasyprint', 'pandas', 'monitor.discovery'} & set(sys.modules)"
    answer = subprocess.run(
        [sys.executable, "-c", f"{asked}print(sorted({heavy}))"], capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == "[]"
