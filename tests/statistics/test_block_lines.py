"""Lines of blocks of days: dense matrices of numpy, generalised least squares of statsmodels, rates with dependence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import signal, stats

from monitor.exceptions import DataError
from monitor.statistics import backtest, predict
from monitor.statistics.days.block_lines import Blocks, block_count, block_lines, block_of
from monitor.statistics.days.seasonal_slopes import SeasonAhead, beside_season
from monitor.statistics.sufficient import drift_from_sums, drift_in_blocks
from monitor.statistics.trend import trend


def first_order(rng, count, n, r):
    """Stationary first-order series (count, n) of unit variance."""
    steps = rng.normal(size=(count, n))
    steps[:, 1:] *= np.sqrt(1.0 - r * r)
    return signal.lfilter([1.0], [1.0, -r], steps, axis=1)


def cut(values, t):
    """Blocks of many series (c, n) over the same days."""
    place = block_of(t, int(block_count(len(t))), t[0], t[-1])
    place = np.unique(place, return_inverse=True)[1]
    counts = np.bincount(place).astype(float)
    sums = np.zeros((len(values), len(counts)))
    np.add.at(sums.T, place, values.T)
    shape = (len(values), 1)
    return Blocks(
        np.tile(counts, shape), np.tile(np.bincount(place, t) / counts, shape), sums / counts,
        np.full(len(values), float(len(t))),
    )  # fmt: skip


def rate(values, t, cycle=None):
    lines = block_lines(cut(values, t), cycle=cycle)
    _, p_value, season_p = beside_season(lines.slope, lines.u_slope, lines.dof, lines.seasonal)
    return float((np.where(np.isnan(season_p), p_value, season_p) < 0.05).mean())


@pytest.mark.parametrize(("n", "cycle"), [(7, None), (16, None), (40, None), (90, 365.25)])
def test_covariance_is_that_of_dense_matrices(n, cycle):
    rng = np.random.default_rng(n)
    t = 7.0 * np.arange(n)
    blocks = cut(first_order(rng, 1, n, 0.6), t)
    lines = block_lines(blocks, cycle=cycle)
    weight, time, value = blocks.weight[0], blocks.time[0], blocks.value[0]
    away = time - lines.at[0]
    phase = 2.0 * np.pi * away / 365.25
    columns = [np.ones_like(time), away] + ([np.cos(phase), np.sin(phase)] if cycle else [])
    assert lines.cyclic[0] == (cycle is not None)
    root = np.sqrt(weight)
    x, y = root[:, np.newaxis] * np.column_stack(columns), root * value
    # The correlation lies between two of the table, whose variances are interpolated: here those of the two themselves.
    table = np.linspace(0.0, 0.95, 20)
    place = min(int(lines.allowed[0] / 0.05 + 1e-9), 18)
    share = (lines.allowed[0] - table[place]) / 0.05
    pinv = np.linalg.pinv(x)
    residual = y - x @ (pinv @ y)
    m = np.eye(len(y)) - x @ pinv
    lag = np.abs(np.subtract.outer(np.arange(len(y)), np.arange(len(y))))
    slope_part = trace = dof = 0.0
    for r, part in ((table[place], 1.0 - share), (table[place + 1], share)):
        shape = r**lag
        slope_part += part * (pinv @ shape @ pinv.T)[1, 1]
        trace += part * np.trace(m @ shape)
        dof += part * np.trace(m @ shape) ** 2 / np.trace(m @ shape @ m @ shape)
    assert lines.slope[0] == pytest.approx((pinv @ y)[1], rel=1e-9)
    assert lines.covariance[0, 1, 1] == pytest.approx(residual @ residual / trace * slope_part, rel=1e-9)
    assert lines.dof[0] == pytest.approx(dof, rel=1e-9)


def test_line_without_resemblance_is_weighted_least_squares_of_statsmodels():
    rng = np.random.default_rng(5)
    t = np.arange(12.0)
    y = rng.normal(size=12)
    lines = block_lines(cut(y[np.newaxis], t))
    plain = sm.OLS(y, sm.add_constant(t)).fit()
    assert lines.slope[0] == pytest.approx(plain.params[1], rel=1e-10)
    assert lines.u_slope[0] / lines.widening[0] == pytest.approx(plain.bse[1], rel=1e-10)


def test_slope_of_long_series_has_the_uncertainty_of_generalised_least_squares():
    rng = np.random.default_rng(6)
    n, r = 250, 0.6
    t = np.arange(float(n))
    series = first_order(rng, 400, n, r)
    stated = np.median(block_lines(cut(series, t)).u_slope)
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    right = sm.GLS(series[0], sm.add_constant(t), sigma=r**lag).fit()
    exact = np.sqrt(right.normalized_cov_params[1, 1])
    # Twice as wide as of independent days, and by the margin for what is not known of the correlation a fifth more.
    assert exact < stated < 1.35 * exact


# All of the grid: docs/trials-statistics.md.
@pytest.mark.parametrize("n", [4, 6, 12, 40])
@pytest.mark.parametrize(("r", "component"), [(0.0, 0.0), (0.0, 2.0), (0.6, 1.0), (0.8, 1.0), (0.8, 2.0)])
def test_false_alarms_of_a_slope_with_days_that_resemble_each_other(n, r, component, rate_at_most):
    rng = np.random.default_rng([n, int(10 * r), int(component)])
    values = component * first_order(rng, 2000, n, r) + rng.normal(size=(2000, n, 4)).mean(axis=2)
    assert rate_at_most(round(2000 * rate(values, np.arange(float(n)))), 2000, 0.075)


@pytest.mark.parametrize("n", [52, 156])
def test_a_yearly_cycle_is_no_drift(n, rate_at_most):
    rng = np.random.default_rng(n)
    t = 7.0 * np.arange(n)
    wave = np.cos(2.0 * np.pi * (t + rng.uniform(0.0, 365.0, (1000, 1))) / 365.25)
    values = wave + 0.5 * rng.normal(size=(1000, n))
    assert rate_at_most(round(1000 * rate(values, t, 365.25)), 1000, 0.05)


def test_campaigns_of_days_count_once():
    rng = np.random.default_rng(8)
    t = (np.arange(4)[:, np.newaxis] * 180.0 + np.arange(5.0)).ravel()
    values = (rng.normal(size=(1000, 4, 1)) + 0.3 * rng.normal(size=(1000, 4, 5))).reshape(1000, -1)
    assert rate(values, t) < 0.05
    # As of independent days it would be called in every third history.
    plain = [stats.linregress(t, series).pvalue < 0.05 for series in values[:300]]
    assert np.mean(plain) > 0.3
    with pytest.raises(DataError, match="the 10 days lie in 2 groups far apart, which cannot tell a trend"):
        trend(values[0, :10], t[:10])


def test_many_series_are_those_one_by_one_and_blocks_without_days_are_left_out():
    rng = np.random.default_rng(9)
    weight = rng.integers(0, 4, (30, 12)).astype(float)
    time = np.sort(rng.uniform(0.0, 900.0, (30, 12)), axis=1)
    value = rng.normal(size=(30, 12))
    days = weight.sum(axis=1)
    together = block_lines(Blocks(weight, time, value, days), cycle=365.25)
    for row in range(30):
        full = weight[row] > 0.0
        alone = block_lines(
            Blocks(weight[[row]][:, full], time[[row]][:, full], value[[row]][:, full], days[[row]]),
            cycle=365.25,
        )
        assert together.cyclic[row] == alone.cyclic[0]
        for name in ("slope", "u_slope", "dof", "allowed"):
            np.testing.assert_allclose(getattr(together, name)[row], getattr(alone, name)[0], rtol=1e-8)


def test_backtest_beside_a_wave_is_that_of_each_day_by_itself():
    rng = np.random.default_rng(3)
    day = np.repeat(np.arange(70), 2)
    t = 7.0 * day + np.tile([0.0, 0.1], 70)
    y = rng.normal(size=140) + rng.normal(size=70)[day] + np.cos(2.0 * np.pi * t / 365.25)
    result = backtest(y, t, days=day, cycle=365.25)
    for target in (5, 30, 50, 69):
        past = day < target
        line = trend(y[past], t[past], days=day[past], cycle=365.25, robust=False)
        predicted, _, u = predict(line, t[day == target][:1])
        assert result.z[target - 5] == pytest.approx((y[day == target][0] - predicted[0]) / u[0], rel=1e-9)
    assert line.resemblance.cyclic


@pytest.mark.parametrize(
    ("n", "gap"), [(5, 7.0), (8, 7.0), (12, 7.0), (20, 7.0), (30, 7.0), (38, 7.0), (9, 30.0)]
)
@pytest.mark.parametrize("r", [0.0, 0.6])
def test_a_part_of_a_yearly_season_is_no_drift(n, gap, r):
    """Allowed is 1.5 times 5 %; without the season in the null up to 50 % of these are called."""
    rng = np.random.default_rng([n, int(10 * r)])
    t = gap * np.arange(n)
    noise = r * first_order(rng, 2000, n, r) + rng.normal(size=(2000, n, 4)).mean(axis=2)
    wave = np.cos(2.0 * np.pi * (t + rng.uniform(0.0, 365.25, (2000, 1))) / 365.25)
    warmth = wave + 0.5 * first_order(rng, 2000, n, 0.7)
    for season in (
        noise,
        noise + wave,
        noise + 2.0 * wave,
        noise + 2.0 * warmth,
        noise + 4.0 * np.maximum(wave, 0),
    ):
        assert rate(season, t, 365.25) <= 0.075


def test_a_steep_drift_of_30_weeks_is_none_of_the_season():
    rng = np.random.default_rng(30)
    t = 7.0 * np.arange(30)
    u = np.sqrt(1.25 / ((t - t.mean()) ** 2).sum())
    noise = rng.normal(size=(500, 30, 4)).mean(axis=2)
    assert rate(noise + 16.0 * u * t, t, 365.25) > 0.85


def test_beside_a_season_is_beside_its_columns():
    """Student's t of the slope in a dense fit of line, cosine and sine; days alike, so that no resemblance is seen."""
    rng = np.random.default_rng(2)
    t = 20.0 * np.arange(12)
    y = rng.normal(size=12) + 0.4 * t
    lines = block_lines(cut(y[np.newaxis], t), cycle=365.25)
    phase = 2.0 * np.pi * t / 365.25
    x = np.column_stack([np.ones(12), np.cos(phase), np.sin(phase), t])
    slope = np.linalg.lstsq(x, y, rcond=None)[0][-1]
    wide = block_lines(
        Blocks(*(column[np.newaxis] for column in (np.ones(12), t, y)), np.array([12.0]),
               np.column_stack([np.cos(phase), np.sin(phase)])[np.newaxis])
    )  # fmt: skip
    assert wide.slope[0] == pytest.approx(slope, rel=1e-9)
    assert lines.seasonal.t[0] == pytest.approx(abs(slope) / wide.u_slope[0], rel=1e-9)
    assert lines.seasonal.dof[0] == pytest.approx(wide.dof[0], rel=1e-9)
    # A recorded temperature beside the line answers for the season itself.
    assert np.isnan(
        block_lines(
            Blocks(*(column[np.newaxis] for column in (np.ones(12), t, y)), np.array([12.0]),
                   np.cos(phase)[np.newaxis, :, np.newaxis]), cycle=365.25
        ).seasonal.t[0]
    )  # fmt: skip


@pytest.mark.parametrize("n", [12, 20, 30])
def test_no_drift_lies_in_the_interval_of_a_slope_that_holds_a_season(n):
    rng = np.random.default_rng(n)
    t, inside = 7.0 * np.arange(n), 0
    for _ in range(200):
        wave = np.cos(2.0 * np.pi * (t / 365.25 + rng.uniform()))
        low, high = trend(2.0 * wave + 0.5 * rng.normal(size=n), t, cycle=365.25, robust=False).slope_interval
        inside += low <= 0.0 <= high
    assert inside >= 185


@pytest.mark.parametrize("weeks", [2, 8, 20, 30, 40])
def test_what_a_season_adds_ahead_is_how_far_a_wave_departs_from_its_own_line(weeks):
    """The wave by numpy's line through it, odd about the middle: the phase in which most of it is slope."""
    t = np.linspace(0.0, 7.0 * weeks, 4001)
    phase = 2.0 * np.pi / 365.25
    wave = np.sin(phase * (t - t.mean()))
    slope = np.polyfit(t, wave, 1)[0]
    for ahead in (7.0, 28.0, 90.0):
        time = t[-1] + ahead
        departs = slope * ahead - (np.sin(phase * (time - t.mean())) - wave[-1])
        of_season = SeasonAhead(slope, t[0], t[-1], 365.25).at(time)
        assert of_season == pytest.approx(max(slope * ahead, departs), rel=1e-3)
    assert SeasonAhead(slope, t[0], t[-1], 365.25).at(t[-1] - 1.0) == 0.0


@pytest.mark.parametrize("weeks", [12, 20, 30])
def test_the_bend_is_what_numpy_fits_of_an_even_wave_and_adds_what_it_falls_by(weeks):
    rng = np.random.default_rng(weeks)
    t = 7.0 * np.arange(weeks)
    phase = 2.0 * np.pi / 365.25 * (t - t.mean())
    y = 3.0 * np.cos(phase) + 0.1 * rng.normal(size=weeks)
    line = trend(y, t, cycle=365.25, robust=False)
    number = int(block_count(weeks))
    block = np.minimum((np.arange(weeks) / (weeks - 1) * number).astype(int), number - 1)
    mean = [np.array([column[block == index].mean() for index in range(number)]) for column in (t, y)]
    weight = np.sqrt(np.bincount(block))
    even = np.cos(2.0 * np.pi / 365.25 * (mean[0] - t.mean()))
    columns = np.column_stack([np.ones(number), mean[0], even])
    bend = abs(np.linalg.lstsq(columns * weight[:, None], mean[1] * weight, rcond=None)[0][2])
    assert line.season_ahead.bend == pytest.approx(bend, rel=1e-6)
    half, w = (t[-1] - t[0]) / 2.0, 2.0 * np.pi / 365.25
    for ahead in (28.0, 56.0, 400.0):
        falls = bend * (np.cos(w * half) - np.cos(min(w * (half + ahead), np.pi))) / np.sqrt(3.0)
        straight = SeasonAhead(line.season_ahead.u, t[0], t[-1], 365.25).at(t[-1] + ahead)
        assert line.season_ahead.at(t[-1] + ahead) - straight == pytest.approx(falls, rel=1e-9)
    assert line.season_ahead.at(t[-1] - 1.0) == 0.0


def test_runs_eight_weeks_after_twenty_weeks_of_a_season_lie_in_their_interval():
    """A season of two scatters of a run, days that differ by half of one; with the slope of the season alone 89 %."""
    rng = np.random.default_rng(8)
    day = np.repeat(np.arange(28), 4)
    t = 7.0 * day + np.tile([0.0, 0.05, 0.1, 0.15], 28)
    past, later = day < 20, np.flatnonzero(day == 27)[0]
    inside = 0
    for _ in range(300):
        y = 2.0 * np.cos(2.0 * np.pi * (t / 365.25 + rng.uniform()))
        y += rng.normal(size=len(t)) + 0.5 * rng.normal(size=28)[day]
        line = trend(y[past], t[past], days=day[past], cycle=365.25, robust=False)
        value, _, u = predict(line, t[later])
        inside += abs(y[later] - value) <= stats.t.isf(0.025, line.dof) * u
    # Of 300 with 93 %: 2 % of seeds lie below.
    assert inside >= 270


def test_a_season_may_be_any_part_of_a_slope_or_hide_as_much():
    rng = np.random.default_rng(5)
    t = 7.0 * np.arange(12)
    y = 0.2 * t + rng.normal(size=12)
    line = trend(y, t, cycle=365.25, robust=False)
    alone = trend(y, t, robust=False)
    assert line.season_p > 0.05 > line.p_value == alone.p_value
    # A rectangular distribution as wide as the slope on either side.
    assert line.u_slope == pytest.approx(np.hypot(alone.u_slope, line.slope / np.sqrt(3.0)))
    assert line.slope_interval[0] < 0.0 < line.slope_interval[1]
    later = np.array([t[-1], t[-1] + 28.0])
    (_, now, _), (_, before, _) = predict(line, later), predict(alone, later)
    assert now[0] == before[0]
    bend = line.season_ahead.at(later[1]) - replace(line.season_ahead, bend=0.0).at(later[1])
    of_season = 28.0 * abs(line.slope) / np.sqrt(3.0) + bend
    assert now[1] == pytest.approx(np.hypot(before[1], of_season))


@pytest.mark.parametrize("origin", [0.0, 17.3])
def test_days_that_differ_by_rounding_alone_do_not_drift(origin):
    """A campaign that was imported again under other names: means of equal values, added in other orders."""
    rng = np.random.default_rng(20261126)
    t = 365.25 * np.arange(5.0)
    runs = rng.normal(17.3, 1.4, 44)
    # As SQL adds them: the mean of the same runs to a few last bits of its level.
    means = runs.mean() - origin + np.spacing(17.3) * rng.integers(-4, 5, (50, 5))
    assert (np.ptp(means, axis=1) > 0.0).all()
    lines = block_lines(replace(cut(means, t), origin=np.full(50, origin)), cycle=365.25)
    sums = [np.full(50, 5.0), np.full(50, t.sum()), np.full(50, t @ t), means.sum(axis=1)]
    drift = drift_from_sums(*sums, (means**2).sum(axis=1), means @ t)
    drift = drift_in_blocks(drift, replace(cut(means, t), origin=np.full(50, origin)), cycle=365.25)
    for slope, u in ((lines.slope, lines.u_slope), (drift.slope, drift.u)):
        assert (slope == 0.0).all()
        assert (u == 0.0).all()
    assert (drift.p_value == 1.0).all()
    if not origin:
        values, times = np.concatenate([rng.permutation(runs) for _ in t]), np.repeat(t, 44)
        line = trend(values, times, days=np.repeat(np.arange(5), 44))
        assert (line.slope, line.u_slope, line.p_value) == (0.0, 0.0, 1.0)
    # What is a hundred times as much as rounding counts.
    moved = block_lines(replace(cut(means + 1e-11 * t / t[-1], t), origin=np.full(50, origin)))
    assert (moved.slope > 0.0).all()


def test_days_of_two_campaigns_a_month_apart_know_no_slope_better_than_independent_ones():
    """What nobody knows of the resemblance of 4 blocks made a slope's interval 0.73 times as wide."""
    rng = np.random.default_rng(40)
    times = np.concatenate([np.arange(5.0), 35.0 + np.arange(5.0)])
    for _ in range(20):
        values = rng.normal(size=10)
        line = trend(values, times, robust=False)
        assert line.resemblance.blocks == 4
        assert line.resemblance.widening >= 1.0 - 1e-12
        # The same four blocks by weighted least squares of statsmodels, as if they were independent.
        index = np.repeat(np.arange(4), [4, 1, 1, 4])
        size = np.bincount(index)
        y, t = (np.bincount(index, column) / size for column in (values, times))
        alone = sm.WLS(y, sm.add_constant(t), weights=size).fit()
        assert line.u_slope >= alone.bse[1] * (1.0 - 1e-9)
