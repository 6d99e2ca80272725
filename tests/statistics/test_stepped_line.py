"""A step beyond a drift: generalised least squares of statsmodels, rates on machines that drift and wander."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm

from monitor.statistics.days.before_after import OtherDays, before_after
from monitor.statistics.days.beside_drift import Verdict, beside_drift
from monitor.statistics.days.stepped_line import (
    MIXTURES,
    REFUTED,
    Campaigns,
    campaigns_of,
    moves,
    stepped_line,
)


def of_means(mean, t, piece):
    """Campaigns of one day each."""
    days = tuple(np.array([value]) for value in mean)
    return Campaigns(
        np.asarray(mean, float), np.asarray(t, float), np.asarray(piece), np.asarray(piece),
        np.arange(len(mean)), days, np.zeros(len(mean), dtype=np.intp),
    )  # fmt: skip


def by_statsmodels(y, t, piece, wander, contrast):
    """Restricted likelihood (up to a constant) and t test of a contrast of levels and slope a day."""
    unit = np.median(np.diff(t))
    covariance = np.eye(len(y)) + wander * (np.minimum.outer(t, t) - t.min()) / unit
    design = np.column_stack([piece == number for number in np.unique(piece)] + [t - t[0]]).astype(float)
    fit = sm.GLS(y, design, covariance).fit()
    information = design.T @ np.linalg.solve(covariance, design)
    logs = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
    return -0.5 * (fit.df_resid * np.log(fit.scale) + logs), fit.t_test(contrast)


@pytest.mark.parametrize("seed", range(4))
def test_the_step_of_the_lines_is_that_of_statsmodels_under_the_least_sure_mixture_left_open(seed):
    rng = np.random.default_rng([14, seed])
    t = np.cumsum(rng.uniform(20.0, 40.0, 9))
    piece = np.repeat([3, 7], [5, 4])
    y = 0.1 * t + np.cumsum(rng.normal(size=9)) + rng.normal(size=9) + 12.0 * (piece == 7)
    line = stepped_line(of_means(y, t, piece), 4, 5, levels=True)
    results = [by_statsmodels(y, t, piece, wander, [-1.0, 1.0, 0.0]) for wander in MIXTURES]
    highest = max(likelihood for likelihood, _ in results)
    open_ = [test for likelihood, test in results if likelihood >= highest - REFUTED]
    worst = max(open_, key=lambda test: test.pvalue)
    assert line.dof == 6
    assert line.step == pytest.approx(float(worst.effect[0]), rel=1e-9)
    assert line.u == pytest.approx(float(worst.sd.item()), rel=1e-9)
    assert line.p_value() == pytest.approx(float(worst.pvalue), rel=1e-8)


@pytest.mark.parametrize("sides", [(4, 4), (3, 3), (5, 1), (6, 2)])
def test_campaigns_of_one_time_a_side_show_no_rate(sides):
    """Dates without a time of day, copies: the time is a sum of the sides, and steps of 1e16 came of it."""
    piece = np.repeat([0, 1], sides)
    y = np.random.default_rng(5).normal(size=len(piece)) + 9.0 * piece
    line = stepped_line(of_means(y, 0.3 + 30.1 * piece, piece), sides[0] - 1, sides[0], levels=True)
    assert line is None


def test_of_two_campaigns_alone_the_drift_between_them_is_taken_off():
    rng = np.random.default_rng(3)
    t = 30.0 * np.arange(8.0)
    piece = np.repeat([0, 1], [7, 1])
    y = 3.0 * np.arange(8) + rng.normal(size=8) - 20.0 * piece
    line = stepped_line(of_means(y, t, piece), 6, 7, levels=False)
    # The likelihoods of all mixtures, and the difference of two campaigns less slope times gap as a sum over them.
    results = []
    for wander in MIXTURES:
        covariance = np.eye(8) + wander * np.minimum.outer(t, t) / 30.0
        design = np.column_stack([piece == 0, piece == 1, t]).astype(float)
        whole = np.linalg.solve(
            design.T @ np.linalg.solve(covariance, design), design.T @ np.linalg.inv(covariance)
        )
        contrast = np.eye(8)[7] - np.eye(8)[6] - 30.0 * whole[2]
        left = y - design @ whole @ y
        scale = left @ np.linalg.solve(covariance, left) / 5
        logs = (
            np.linalg.slogdet(covariance)[1]
            + np.linalg.slogdet(design.T @ np.linalg.solve(covariance, design))[1]
        )
        results.append(
            (
                -0.5 * (5 * np.log(scale) + logs),
                contrast @ y,
                np.sqrt(scale * contrast @ covariance @ contrast),
            )
        )
    highest = max(result[0] for result in results)
    _, step, u = min((r for r in results if r[0] >= highest - REFUTED), key=lambda r: abs(r[1]) / r[2])
    assert (line.step, line.u) == (pytest.approx(step), pytest.approx(u))
    assert line.step + line.expected == pytest.approx(y[7] - y[6])


def test_fewer_campaigns_than_lines_need_have_none_and_neighbours_say_how_far_the_machine_moves():
    campaigns = of_means([0.0, 4.0, 20.0, 21.0], [0.0, 30.0, 90.0, 120.0], [0, 0, 1, 1])
    assert stepped_line(campaigns, 1, 2, levels=True) is None
    # The event lies between campaigns twice as far apart as their neighbours are.
    assert moves(campaigns, 1, 2, levels=False) == (8.0, 2)
    assert moves(of_means([0.0, 4.0], [0.0, 30.0], [0, 1]), 0, 1, levels=False) == (0.0, 0)
    # The middles of both sides are three times as far apart.
    assert moves(campaigns, 1, 2, levels=True) == (12.0, 2)
    # A change that somebody found is a move without an event.
    found = replace(campaigns, piece=np.array([0, 1, 2, 2]))
    assert moves(found, 1, 2, levels=False) == (8.0, 2)


def test_means_of_campaigns_are_means_of_means_of_days_and_an_event_cuts_one_in_two():
    values = np.array([1.0, 2.0, 6.0, 10.0, 20.0, 30.0])
    days = np.array([0, 0, 1, 1, 2, 3])
    t = np.array([0.0, 0.2, 1.0, 1.4, 2.0, 30.0])
    campaigns = campaigns_of(
        values, days, t, np.array([0, 0, 0, 1, 1, 1]), np.array(["a", "a", "a", "a", "a", "b"])
    )
    assert campaigns.mean.tolist() == [3.75, 15.0, 30.0]
    assert campaigns.t.tolist() == pytest.approx([0.55, 1.7, 30.0])
    assert campaigns.piece.tolist() == [0, 1, 1]
    assert [days.tolist() for days in campaigns.days] == [[1.5, 6.0], [10.0, 20.0], [30.0]]


def drawn(rng, before, after, rate=0.0, walk=0.0, step=0.0):
    """Verdict on the last campaign before and the first after an event: two days of two runs every 30 days."""
    count = before + after
    level = (
        rate * np.arange(count)
        + np.cumsum(walk * rng.normal(size=count))
        + step * (np.arange(count) >= before)
    )
    values = level[:, None, None] + rng.normal(size=(count, 2, 1)) + rng.normal(size=(count, 2, 2))
    t = 30.0 * np.arange(count)[:, None, None] + np.arange(2.0)[:, None] + np.array([0.0, 0.1])
    campaign, day = (np.repeat(np.arange(count * 4 // n), n).reshape(values.shape) for n in (4, 2))
    piece = (campaign >= before).astype(np.intp)
    rest = np.ones(count, dtype=bool)
    rest[[before - 1, before]] = False
    others = OtherDays(*(column[rest].ravel() for column in (values, day, piece, campaign)))
    days = before_after(
        *(column[i].ravel() for column in (values, day) for i in (before - 1, before)), others
    )
    campaigns = campaigns_of(*(column.ravel() for column in (values, day, t, piece, campaign)))
    return beside_drift(days, campaigns, before - 1, before, levels=False).verdict(0.05)


@pytest.mark.parametrize(("before", "after"), [(2, 2), (4, 4), (7, 1)])
@pytest.mark.parametrize("law", [{}, {"rate": 3.0}, {"walk": 3.0}, {"rate": 20.0, "walk": 1.0}])
@pytest.mark.all_seeds
def test_machines_that_drift_or_wander_are_not_said_to_step(before, after, law, rate_at_most):
    rng = np.random.default_rng([before, after, *(int(value) for value in law.values())])
    verdicts = [drawn(rng, before, after, **law) for _ in range(100)]
    assert rate_at_most(verdicts.count(Verdict.STEPPED), 100, 0.05)


def test_a_step_on_a_machine_that_drifts_is_seen_and_the_days_alone_do_not_see_it():
    rng = np.random.default_rng(7)
    verdicts = [drawn(rng, 7, 1, rate=5.0, step=-20.0) for _ in range(60)]
    assert verdicts.count(Verdict.STEPPED) >= 54
