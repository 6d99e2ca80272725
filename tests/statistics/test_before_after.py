"""Before and after an event: Student's test of scipy, false alarms, and a change of 3.5 standard deviations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import DataError
from monitor.statistics.days.before_after import OtherDays, before_after


def sides(rng, days, runs, component):
    values = component * rng.normal(size=(days, 1)) + rng.normal(size=(days, runs))
    return values.ravel(), np.repeat(np.arange(days), runs)


def test_one_day_a_side_decides_nothing_however_many_runs_and_u_is_students_of_the_runs():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=6), rng.normal(size=4) + 9.0
    result = before_after(x, y, np.zeros(6), np.zeros(4))
    right = stats.ttest_ind(y, x).confidence_interval(0.95)
    assert result.difference - result.expanded == pytest.approx(right.low, rel=1e-10)
    assert result.difference + result.expanded == pytest.approx(right.high, rel=1e-10)
    assert result.between is result.agree is result.e_n is None


def test_with_other_days_of_the_machine_it_is_students_test_of_all_means_about_their_own_stretches():
    rng = np.random.default_rng(4)
    rest = rng.normal(size=(7, 4)) + rng.normal(size=(7, 1)) + np.repeat([0.0, 50.0], [3, 4])[:, np.newaxis]
    x, y = rng.normal(size=4), rng.normal(size=4) + 3.0
    stretches = np.repeat([0, 1], [12, 16])
    others = OtherDays(rest.ravel(), np.repeat(np.arange(7), 4), stretches, stretches)
    result = before_after(x, y, np.zeros(4), np.zeros(4), others)
    means = rest.mean(axis=1)
    squares = means[:3].var(ddof=1) * 2 + means[3:].var(ddof=1) * 3
    u = np.sqrt(2.0 * squares / 5)
    assert (result.u, result.dof, result.other_days) == (pytest.approx(u), 5.0, 7)
    assert result.expanded == pytest.approx(stats.t.ppf(0.975, 5) * u)


def test_campaigns_that_differ_by_more_than_their_days_say_what_a_change_has_to_exceed():
    rng = np.random.default_rng(5)
    level = 5.0 * rng.normal(size=6)
    rest = level[:, np.newaxis] + rng.normal(size=(6, 4))
    others = OtherDays(rest.ravel(), np.arange(24), np.zeros(24), np.repeat(np.arange(6), 4))
    result = before_after(rng.normal(size=4), rng.normal(size=4) + 4.0, np.arange(4), np.arange(4), others)
    assert result.u == pytest.approx(np.sqrt(2.0) * rest.mean(axis=1).std(ddof=1))
    assert (result.dof, result.other_campaigns, result.agree) == (5.0, 6, True)


def test_of_days_of_as_many_runs_it_is_students_test_of_their_means():
    rng = np.random.default_rng(2)
    (x, of_x), (y, of_y) = sides(rng, 5, 4, 3.0), sides(rng, 4, 4, 3.0)
    result = before_after(x, y, of_x, of_y)
    right = stats.ttest_ind(y.reshape(4, 4).mean(axis=1), x.reshape(5, 4).mean(axis=1)).confidence_interval(
        0.95
    )
    assert result.difference - result.expanded == pytest.approx(right.low, rel=1e-9)
    assert result.difference + result.expanded == pytest.approx(right.high, rel=1e-9)


@pytest.mark.parametrize(
    ("before", "after", "component"), [((3, 4), (2, 4), 0.0), ((5, 4), (5, 4), 1.0), ((4, 3), (2, 3), 2.0)]
)
@pytest.mark.all_seeds
def test_false_alarms_and_a_change_of_three_and_a_half_standard_deviations(
    before, after, component, rate_at_most
):
    rng = np.random.default_rng([*before, *after])
    false_alarms = seen = called = 0
    u = np.sqrt(sum((component**2 + 1.0 / runs) / days for days, runs in (before, after)))
    for _ in range(300):
        (x, of_x), (y, of_y) = sides(rng, *before, component), sides(rng, *after, component)
        false_alarms += not before_after(x, y, of_x, of_y).agree
        seen += not before_after(x, y + 3.5 * u, of_x, of_y).agree
        called += before_after(x, y + 7.0 * u, of_x, of_y).agree is False
    assert rate_at_most(false_alarms, 300, 0.05)
    assert seen / 300 > 0.6
    assert called / 300 > 0.4


@pytest.mark.parametrize(("before", "after", "correlation"), [(5, 5, 0.6), (5, 2, 0.6), (5, 5, 0.0)])
def test_days_that_follow_each_other_are_not_called_and_u_is_that_of_dense_matrices(
    before, after, correlation, rate_at_most
):
    rng = np.random.default_rng([before, after])
    ns = (before, after)
    called = 0
    for _ in range(300):
        days = [rng.normal(size=n) for n in ns]
        for side in days:
            for i in range(1, len(side)):
                side[i] = correlation * side[i - 1] + np.sqrt(1.0 - correlation**2) * side[i]
        result = before_after(*days, np.arange(before), np.arange(after))
        called += result.agree is False
    assert rate_at_most(called, 300, 0.075)
    # The last machine by dense matrices: Satterthwaite for the sum of squares y'MCM y (Box 1954).
    c = np.zeros((sum(ns), sum(ns)))
    for start, n in ((0, before), (before, after)):
        c[start : start + n, start : start + n] = result.correlation ** np.abs(
            np.subtract.outer(range(n), range(n))
        )
    stretch = np.repeat([[1.0, 0.0], [0.0, 1.0]], ns, axis=1)
    m = np.eye(sum(ns)) - stretch.T @ np.diag(1.0 / np.array(ns)) @ stretch
    contrast = np.repeat([-1.0 / before, 1.0 / after], ns)
    y = np.concatenate(days)
    u = np.sqrt(y @ m @ y / np.trace(m @ c) * (contrast @ c @ contrast))
    dof = np.trace(m @ c) ** 2 / np.trace(m @ c @ m @ c)
    welch = stats.ttest_ind(days[1], days[0], equal_var=False).confidence_interval(0.95)
    # Two campaigns that differ by 0.8 of the scatter of a mean of a day.
    freedom = sum(ns) - 2
    campaigns = np.sqrt(y @ m @ y / freedom * (1.0 / before + 1.0 / after + 2.0 * 0.8**2))
    assert [(rival.u, rival.dof) for rival in result.rivals[::2]] == [
        (pytest.approx(u), pytest.approx(dof)),
        (pytest.approx(campaigns), pytest.approx(freedom)),
    ]
    assert result.cautious == pytest.approx(
        max(
            stats.t.ppf(0.975, dof) * u,
            (welch.high - welch.low) / 2.0,
            stats.t.ppf(0.975, freedom) * campaigns,
        )
    )


def test_two_days_that_scatter_more_than_ten_before_are_seldom_called_without_welch(rate_at_most):
    rng = np.random.default_rng(3)
    called = alike = 0
    for _ in range(400):
        x, y = 0.5 * rng.normal(size=10), 3.0 * rng.normal(size=2)
        result = before_after(x, y, np.arange(10), np.arange(2))
        called, alike = called + (result.agree is False), alike + (abs(result.e_n) > 1.0)
    # Welch with one degree of freedom holds 8 to 9 % (docs/trials-statistics.md); days of one scatter half of them.
    assert rate_at_most(called, 400, 0.09)
    assert alike / 400 > 0.4


@pytest.mark.parametrize(("before", "after", "rest"), [(1, 1, (5,)), (1, 1, (1,) * 6), (2, 2, (5,) * 4)])
def test_few_days_that_scatter_three_times_as_much_as_the_machines_others_are_no_change(
    before, after, rest, rate_at_most
):
    rng = np.random.default_rng([before, after, *rest])
    called = alike = seen = 0
    for _ in range(300):
        (x, of_x), (y, of_y) = sides(rng, before, 4, 1.0), sides(rng, after, 4, 1.0)
        days = rng.normal(size=(sum(rest), 1)) + rng.normal(size=(sum(rest), 4))
        campaign = np.repeat(np.repeat(np.arange(len(rest)), rest), 4)
        others = OtherDays(days.ravel(), np.repeat(np.arange(len(days)), 4), 0.0 * campaign, campaign)
        result = before_after(x, 3.0 * y, of_x, of_y, others)
        called, alike = called + (result.agree is False), alike + (abs(result.e_n) > 1.0)
        # A change of 12 u is seen: 12 sqrt(2/days) of a day that scatters by sqrt(1.25).
        shift = 12.0 * np.sqrt(1.25 * (1.0 / before + 1.0 / after))
        seen += before_after(x, y + shift, of_x, of_y, others).agree is False
    assert rate_at_most(called, 300, 0.075)
    assert alike / 300 > 0.2
    assert seen / 300 > 0.9


@pytest.mark.parametrize("days", [5, 20])
def test_two_campaigns_that_differ_by_as_much_as_their_days_are_no_change(days, rate_at_most):
    rng = np.random.default_rng(days)
    called = alike = seen = 0
    for _ in range(300):
        x, y = (
            0.7 * rng.normal(size=(2, days))
            + 0.5 * rng.normal(size=(2, days))
            + 0.7 * rng.normal(size=(2, 1))
        )
        result = before_after(x, y, np.arange(days), np.arange(days))
        called, alike = called + (result.agree is False), alike + (abs(result.e_n) > 1.0)
        seen += before_after(x, y + 6.0, np.arange(days), np.arange(days)).agree is False
    assert rate_at_most(called, 300, 0.075)
    assert alike / 300 > 0.2
    assert seen / 300 > 0.9


def test_a_single_day_may_scatter_three_times_as_much_by_hand():
    rng = np.random.default_rng(8)
    rest = rng.normal(size=5)
    others = OtherDays(rest, np.arange(5), np.zeros(5), np.zeros(5))
    result = before_after([0.0, 0.0], [1.0, 1.1], [0, 0], [0, 0], others)
    assert max(rival.u for rival in result.rivals) == pytest.approx(rest.std(ddof=1) * np.sqrt(1.0 + 9.0))


def test_refusals_say_what_is_needed():
    with pytest.raises(DataError, match=r"1 run\(s\) before and 1 after say nothing of their scatter"):
        before_after([1.0], [2.0], [0], [0])
    with pytest.raises(DataError, match="no run differs from the others of its side"):
        before_after([1.0, 1.0], [2.0, 2.0], [0, 0], [0, 0])


@pytest.mark.parametrize("component", [0.0, 1.0, 3.0])
def test_of_one_day_a_side_and_five_other_days_one_in_twenty_is_called_whatever_the_days_do(
    component, rate_at_most
):
    rng = np.random.default_rng(int(9 + component))
    called = 0
    for _ in range(400):
        parts = [sides(rng, days, 4, component) for days in (1, 1, 5)]
        others = OtherDays(*parts[2], np.zeros(20), np.zeros(20))
        (x, of_x), (y, of_y), _rest = parts
        called += before_after(x, y, of_x, of_y, others).agree is False
    assert rate_at_most(called, 400, 0.05)
