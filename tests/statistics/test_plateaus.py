"""Changes that were put right again: found with both ends, with the likelihood of the dense model, and no others."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.statistics import find_changes
from monitor.statistics.changes import _Search, _Series
from monitor.statistics.plateaus import FEWEST, PlateauScanner
from monitor.statistics.scan import GRID, Scanner
from monitor.statistics.scan_candidates import EDGE, SEASON_FROM

YEAR = 365.25


def weekly(weeks, start, stop, height, seed):
    week = np.arange(weeks)
    noise = np.random.default_rng(seed).normal(size=weeks)
    return 7.0 * week, noise + height * ((week >= start) & (week < stop))


def changes_of(t, y, **options):
    return find_changes(
        {"EB0A": y}, t, rng=np.random.default_rng(1), cycle=YEAR, false_alarm=0.01, **options
    ).changes


@pytest.mark.parametrize(("weeks", "start", "stop"), [(26, 8, 19), (35, 20, 31), (52, 20, 31), (52, 35, 44)])
def test_a_change_that_was_put_right_again_is_found_with_both_its_steps(weeks, start, stop):
    t, y = weekly(weeks, start, stop, 15.0, seed=weeks + start)
    up, down = changes_of(t, y)
    assert (up.kind, up.index, down.kind, down.index) == ("step", start, "step", stop)
    # Beside a wave of any size, which half of a year hardly tells from a plateau.
    assert abs(up.size - 15.0) < 4.0 * up.u < 5.0
    assert abs(down.size + 15.0) < 4.0 * down.u < 5.0
    assert up.interval == (t[start - 1], t[start])
    assert down.interval == (t[stop - 1], t[stop])
    assert up.p_value <= 0.01


def off_by(moving, steps, *, trials=10):
    """Sizes less the true ones over u (trials, 2) of plateaus of 30 weeks beside what moves besides."""
    off = []
    for seed in range(trials):
        t, y = weekly(30, 10, 20, 15.0, seed=100 + seed)
        found = {change.index: change for change in changes_of(t, y + moving(t))}
        off.append([(found[at].size - size) / found[at].u for at, size in steps])
    return np.array(off)


@pytest.mark.slow
@pytest.mark.parametrize(
    "moving",
    [
        pytest.param(lambda t: 12.0 * t / 210.0, id="drift"),
        pytest.param(lambda t: 3.0 * np.cos(2.0 * np.pi * t / YEAR + 1.0), id="season"),
    ],
)
def test_the_ends_of_a_plateau_are_as_large_as_they_are_beside_what_the_search_had_beside_them(moving):
    off = off_by(moving, [(10, 15.0), (20, -15.0)])
    # With the level alone beside them the means are 5.1 and 5.8 beside the drift, -5.0 and 1.5 beside the season.
    assert np.abs(off.mean(axis=0)).max() < 1.0
    assert np.mean(np.abs(off) < 2.0) > 0.7


def test_the_base_of_the_search_and_of_a_size_have_the_same_columns():
    t, y = weekly(30, 10, 20, 15.0, seed=1)
    for base, fitted_from in (
        ("constant", None),
        ("line", None),
        ("season", None),
        ("constant", SEASON_FROM),
    ):
        series = _Series("EB0A", y, t, None, None, YEAR, fitted_from=fitted_from)
        scanner = Scanner(t, None, base, None, YEAR, None, fitted_from)
        fitted = series.fitted(base)
        assert fitted.shape[1] == len(y) - scanner.free
        np.testing.assert_allclose(scanner.plain @ (scanner.plain.T @ fitted), fitted, atol=1e-12)


@pytest.mark.slow
def test_a_season_is_no_trend_between_the_ends_of_a_plateau():
    with_a_trend = 0
    for seed in range(12):
        t, y = weekly(104, 30, 56, 15.0, seed=seed)
        y = y + 4.0 * np.cos(2.0 * np.pi * t / YEAR + seed)
        history = find_changes({"EB0A": y}, t, rng=np.random.default_rng(seed), cycle=YEAR, false_alarm=0.01)
        assert [change.index for change in history.changes][:2] == [30, 56]
        with_a_trend += bool(history.trends)
    assert with_a_trend == 0


def test_one_step_alone_is_one_change_and_the_same_with_and_without_plateaus():
    t, y = weekly(40, 20, 40, 8.0, seed=3)
    (change,) = changes_of(t, y)
    alone, _ = _Search(np.random.default_rng(1), 1999).pieces(
        [(_Series("EB0A", y, t, None, None, YEAR), 0)], 0.01
    )
    assert [change] == alone


def test_half_a_season_and_a_drift_are_no_plateaus():
    t, y = weekly(30, 0, 0, 0.0, seed=5)
    for moving in (20.0 * np.cos(2.0 * np.pi * t / YEAR - np.pi / 2.0), 0.1 * t):
        scanner = PlateauScanner(t, None, YEAR)
        assert scanner.plateau(y + moving, np.random.default_rng(2), 199, 0.01).p_value > 0.05


def test_the_unit_of_the_values_and_the_weights_change_nothing():
    t, y = weekly(30, 10, 20, 12.0, seed=6)
    found = changes_of(t, y, u={"EB0A": np.full(30, 2.0)})
    in_another = changes_of(t, 1e-6 * y + 3.0, u={"EB0A": np.full(30, 5.0)})
    assert [(change.index, change.p_value) for change in found] == [
        (change.index, change.p_value) for change in in_another
    ]
    assert [change.size for change in in_another] == pytest.approx([1e-6 * change.size for change in found])


def test_the_likelihood_of_the_best_plateau_is_that_of_the_dense_normal_density():
    """Of a history whose grid holds all plateaus: residual likelihood of the dense covariance, by every pair."""
    rng, n = np.random.default_rng(7), 14
    t, u = 7.0 * np.arange(n), rng.uniform(0.5, 2.0, n)
    y = rng.normal(size=n) * u
    scanner = PlateauScanner(t, u)
    place = 4
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    root = (1.0 / u) / np.sqrt(np.mean(1.0 / u**2))
    r = GRID[place]
    covariance = r**lags / (1.0 - r * r) / np.outer(root, root)
    base = np.column_stack([np.ones(n), t])

    def explained(design):
        solved = np.linalg.solve(covariance, np.column_stack([design, y]))
        gram = design.T @ solved[:, :-1]
        coefficients = np.linalg.solve(gram, design.T @ solved[:, -1])
        return float((y - design @ coefficients) @ np.linalg.solve(covariance, y - design @ coefficients))

    run = np.arange(n)
    ends = [
        (a, b) for a in range(EDGE, n) for b in range(a + FEWEST, n - EDGE + 1) if b == n or b <= n - EDGE
    ]
    left = {(a, b): explained(np.column_stack([base, (run >= a) & (run < b)]).astype(float)) for a, b in ends}
    total, steps = scanner._along(place, (scanner.root * (y - y.mean()))[:, np.newaxis])
    start, stop, _, _ = scanner._best(place, total, steps)
    table = scanner.tables[place]
    weighted = {pair: value * table.weight[pair] for pair, value in left.items()}
    assert (start[0], stop[0]) == min(weighted, key=weighted.__getitem__)
    assert total[0] - (steps[start[0], 0] - steps[stop[0], 0]) ** 2 * table.inverse[
        start[0], stop[0]
    ] == pytest.approx(left[(start[0], stop[0])], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("weeks", "r"), [(26, 0.0), (35, 0.6), (26, 0.8)])
def test_plateaus_are_called_as_seldom_as_stated_where_there_are_none(weeks, r, rate_at_most):
    rng = np.random.default_rng([weeks, int(10 * r)])
    series = rng.normal(size=(400, weeks))
    for week in range(1, weeks):
        series[:, week] = r * series[:, week - 1] + np.sqrt(1.0 - r * r) * series[:, week]
    scanner = PlateauScanner(7.0 * np.arange(weeks), None, YEAR)
    scanner.look(list(series))
    called = sum(scanner.plateau(y, rng, 999, 0.01).p_value <= 0.01 for y in series)
    assert rate_at_most(called, len(series), 0.015)
