"""Control charts: the e-Handbook's individuals, EWMA and CUSUM; published run lengths; simulated ones."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics import (
    cusum_chart,
    ewma_chart,
    individuals_chart,
    known_reference,
    mewma_chart,
    mewma_limit,
    reference_period,
    t_squared_chart,
)


def test_handbook_6_3_2_2_individuals(certified):
    right = certified("nist-handbook/individuals_6_3_2_2.json")
    reference = reference_period(right["x"], by_moving_range=True)
    assert reference.centre == pytest.approx(right["published"]["centre"], abs=5e-3)
    chart = individuals_chart(right["x"], known_reference(reference.centre, reference.sd), limit=3.0)
    # The handbook divides by 1.128 for 2/sqrt(pi) = 1.12838: 2e-3 in the limit.
    assert chart.upper[0] == pytest.approx(right["published"]["UCL"], abs=2e-3)
    assert chart.lower[0] == pytest.approx(right["published"]["LCL"], abs=2e-3)
    assert chart.alarms.size == 0
    assert chart.arl == pytest.approx(370.398, abs=1e-3)


def test_handbook_6_3_2_4_ewma(certified):
    right = certified("nist-handbook/ewma_6_3_2_4.json")
    chart = ewma_chart(
        right["x"], known_reference(right["EWMA0"], right["s"]), lam=right["lam"], limit=right["k"]
    )
    np.testing.assert_allclose(chart.statistic, right["recomputed"]["ewma"][1:], rtol=1e-13)
    np.testing.assert_allclose(chart.statistic, right["published"]["ewma"][1:], atol=5.001e-3)
    assert chart.upper[0] == pytest.approx(right["recomputed"]["UCL"], rel=1e-12)
    assert chart.lower[0] == pytest.approx(right["published"]["LCL"], abs=1e-4)
    assert chart.alarms.tolist() == right["published"]["out_of_control"]


def test_handbook_6_3_2_3_cusum_first_alarm_at_group_14(certified):
    right = certified("nist-handbook/cusum_6_3_2_3.json")
    sigma = right["sigma"] / np.sqrt(right["group_size"])
    chart = cusum_chart(
        right["group_means"],
        known_reference(right["target"], sigma),
        k=right["k"] / sigma,
        h=right["h"] / sigma,
    )
    columns = np.array(right["recomputed"])
    np.testing.assert_allclose(chart.high, columns[:, 1], atol=1e-10)
    np.testing.assert_allclose(chart.low, columns[:, 2], atol=1e-10)
    np.testing.assert_allclose(
        np.column_stack([chart.high, chart.low]), np.array(right["published"])[:, 1:3], atol=6e-3
    )
    assert chart.alarms[0] + 1 == right["published_first_signal_group"] == 14
    assert chart.started + 1 == 13


@pytest.mark.parametrize(
    ("lam", "limit"), [(0.4, 3.054), (0.25, 2.998), (0.2, 2.962), (0.1, 2.814), (0.05, 2.615)]
)
def test_lucas_saccucci_1990_ewma_run_length_500(lam, limit):
    assert ewma_chart([0.0], known_reference(0.0, 1.0), lam=lam, limit=limit).arl == pytest.approx(
        500.0, rel=7e-3
    )


@pytest.mark.parametrize(("h", "run_length"), [(4.0, 168.0), (5.0, 465.0)])
def test_montgomery_cusum_run_length(h, run_length):
    assert cusum_chart([0.0], known_reference(0.0, 1.0), h=h).arl == pytest.approx(run_length, rel=3e-3)


@pytest.mark.parametrize(("p", "limit"), [(2, 8.64), (4, 12.73)])
def test_prabhu_runger_1997_mewma_limits_for_200(p, limit):
    ours = mewma_limit(p, np.inf, 0.1, 200.0, np.random.default_rng(p), trials=6000)
    assert ours == pytest.approx(limit, rel=0.02)


@pytest.mark.parametrize("n", [20, 100])
def test_rate_of_false_alarms_with_the_size_of_the_reference_allowed_for(n, rate_agrees):
    rng = np.random.default_rng(n)
    alarms = {"individuals": 0, "ewma": 0, "cusum": 0}
    naive = 0
    trials, runs = 150, 400
    template = reference_period(rng.normal(size=n))
    of_ewma = ewma_chart([0.0], template, arl=100.0).limit
    of_cusum = cusum_chart([0.0], template, arl=100.0).h
    for _ in range(trials):
        reference = reference_period(rng.normal(size=n))
        y = rng.normal(size=runs)
        alarms["individuals"] += individuals_chart(y, reference, arl=100.0).alarms.size
        naive += individuals_chart(y, known_reference(reference.centre, reference.sd), arl=100.0).alarms.size
        z = (y - reference.centre) / reference.sd
        alarms["ewma"] += restarts(z, of_ewma * np.sqrt(0.2 / 1.8), ewma=True)
        alarms["cusum"] += restarts(z, of_cusum, ewma=False)
    for kind, count in alarms.items():
        # 600 alarms are expected; those of one reference period come together.
        assert 430 < count < 780, (kind, count)
    assert naive > alarms["individuals"]


def restarts(z, limit, *, ewma):
    """Number of alarms of a chart that starts anew after each, written without the package."""
    count, last, up, down = 0, 0.0, 0.0, 0.0
    for value in z:
        last = 0.8 * last + 0.2 * value
        up, down = max(0.0, up + value - 0.5), max(0.0, down - value - 0.5)
        if (abs(last) > limit) if ewma else (max(up, down) > limit):
            count, last, up, down = count + 1, 0.0, 0.0, 0.0
    return count


def test_t_squared_false_alarm_rate_is_exact_with_twenty_runs(rate_agrees):
    rng = np.random.default_rng(21)
    alarms = 0
    for _ in range(2000):
        data = rng.normal(size=(21, 6)) @ np.diag([1, 1e3, 1e-6, 1, 1, 1])
        alarms += t_squared_chart(data[20:], data[:20], arl=20.0).alarms.size
    assert rate_agrees(alarms, 2000, 0.05)


def test_vector_charts_say_which_parameter_raised_the_alarm():
    rng = np.random.default_rng(22)
    reference = rng.normal(size=(60, 5))
    values = rng.normal(size=(30, 5))
    values[15:, 3] += 3.0
    chart = mewma_chart(values, reference, rng=rng)
    assert 15 <= chart.alarms[0] <= 20
    assert int(chart.shares[chart.alarms[-1]].argmax()) == 3


def test_mewma_run_length_by_simulation_with_forty_reference_runs(rate_agrees):
    rng = np.random.default_rng(23)
    alarms = 0
    reference = rng.normal(size=(300, 40, 3))
    limit = mewma_chart(np.zeros((1, 3)), reference[0], rng=rng, arl=50.0).limit
    for known in reference:
        mean, inverse = known.mean(axis=0), np.linalg.inv(np.cov(known.T))
        path, over = np.zeros(3), False
        for x in rng.normal(size=(50, 3)):
            path = 0.8 * path + 0.2 * (x - mean)
            over = over or path @ inverse @ path * 9.0 > limit
        alarms += over
    assert rate_agrees(alarms, 300, 1 - np.exp(-1))


def test_refusals_say_what_is_needed():
    reference = known_reference(0.0, 1.0)
    with pytest.raises(DataError, match=r"lam is 1\.5"):
        ewma_chart([0.0], reference, lam=1.5)
    with pytest.raises(DataError, match="arl is 1; an average run length between 2 and a million"):
        individuals_chart([0.0], reference, arl=1)
    with pytest.raises(DataError, match="all 5 values of the reference period are 1"):
        reference_period(np.ones(5))
    with pytest.raises(DataError, match="5 runs for 4 parameters; at least 6"):
        t_squared_chart(np.ones((1, 4)), np.random.default_rng(0).normal(size=(5, 4)))
    with pytest.raises(DataError, match="k is 7"):
        cusum_chart([0.0], reference, k=7)
    with pytest.raises(DataError, match="sd above zero"):
        known_reference(0.0, 0.0)
