"""E_n after ISO/IEC 17043 and ISO 13528."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics.normalised_error import normalised_error, result_of_runs


def test_iso_13528_9_7_e_n_by_hand():
    # |10.3 - 10.0| = 0.3 against 2 sqrt(0.1² + 0.05²) = 0.2236
    found = normalised_error([10.0, 5.0], [0.1, 0.1], [10.3, 4.9], [0.05, 0.05])
    np.testing.assert_allclose(found.e_n, [1.341641, -0.447214], rtol=1e-6)
    assert found.agree.tolist() == [False, True]
    np.testing.assert_allclose(found.expanded, 0.2236068, rtol=1e-6)


def test_exactly_one_agrees():
    assert normalised_error(0.0, 0.3, 1.0, 0.4).agree[0]


def test_the_rate_of_false_disagreement_is_that_of_two_standard_deviations():
    rng = np.random.default_rng(17043)
    x1, x2 = rng.normal(0.0, 1.0, 40_000), rng.normal(0.0, 3.0, 40_000)
    found = normalised_error(x1, np.full(40_000, 1.0), x2, np.full(40_000, 3.0))
    assert np.mean(~found.agree) == pytest.approx(0.0455, abs=0.004)


def test_jcgm100_5_2_2_what_both_share_is_taken_out():
    """Of right results that share an error 4.6 % have |E_n| above 1 with its covariance, none without."""
    rng, count, common = np.random.default_rng(7), 40_000, 2.0
    shared = rng.normal(0.0, common, count)
    x1, x2 = (shared + rng.normal(0.0, own, count) for own in (0.5, 1.0))
    u1, u2 = np.full(count, np.hypot(0.5, common)), np.full(count, np.hypot(1.0, common))
    assert np.mean(~normalised_error(x1, u1, x2, u2, np.full(count, common**2)).agree) == pytest.approx(
        0.0455, abs=0.004
    )
    assert np.mean(~normalised_error(x1, u1, x2, u2).agree) < 1e-4


def test_a_mean_of_runs_keeps_what_they_share():
    mean, u = result_of_runs([1.0, 2.0, 3.0], [0.5, 0.5, 0.5])
    assert mean == 2.0
    assert u == pytest.approx(np.sqrt(1.0 / 3.0 + 0.25))
    assert result_of_runs([4.0], [0.2]) == (4.0, pytest.approx(0.2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0], [0.1], [1.0, 2.0], [0.1]), "alike in number"),
        (([np.nan], [0.1], [1.0], [0.1]), "must be finite"),
        (([1.0], [-0.1], [1.0], [0.1]), "must not be negative"),
        (([1.0], [0.0], [1.0], [0.0]), "of two results one must have one"),
        (([1.0], [0.1], [1.0], [0.1], [0.01]), "nothing is left that may differ"),
    ],
)
def test_bad_results_are_refused(arguments, message):
    with pytest.raises(DataError, match=message):
        normalised_error(*arguments)


def test_runs_without_numbers_are_refused():
    with pytest.raises(DataError, match="finite values and uncertainties"):
        result_of_runs([], [])
