"""Changes: false-alarm probability on null data, intervals for when, the B-axis reset of five-days, hot-cold."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics import find_changes, scan
from monitor.statistics.changes import _Search, _Series
from monitor.statistics.days.day_evidence import shows_wide_days
from monitor.statistics.scan import Scanner

PARAMETERS = Path(__file__).resolve().parents[1] / "references" / "campaign-parameters"


def campaign(name):
    with (PARAMETERS / f"{name}.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
    return columns.pop("hours"), columns.pop("day"), columns


def first_order(rng, n, r):
    e = rng.normal(size=n)
    e[0] /= np.sqrt(1 - r * r)
    for i in range(1, n):
        e[i] += r * e[i - 1]
    return e


def share_called(scanner, series, rng, level=0.05):
    """Share of series (m, n) with any finding; they share the simulated null distributions."""
    return sum(scanner.scan(y, rng, 999, level).p_value <= level for y in series)


@pytest.mark.parametrize(
    ("n", "r"), [(12, 0.0), (12, 0.3), (20, 0.0), (20, 0.3), (20, 0.6), (44, 0.3), (44, 0.6), (200, 0.6)]
)
def test_false_alarm_rate_whatever_the_correlation(n, r, rate_at_most):
    rng = np.random.default_rng([n, int(10 * r)])
    series = [first_order(rng, n, r) for _ in range(200 if n == 200 else 600)]
    alarms = share_called(Scanner(np.arange(n, dtype=float), None, "constant"), series, rng)
    assert rate_at_most(alarms, len(series), 0.05), alarms / len(series)


@pytest.mark.parametrize(("days", "runs", "component"), [(5, 4, 0.5), (5, 4, 1.0), (6, 3, 1.0), (10, 4, 1.0)])
def test_false_alarm_rate_with_a_component_of_the_day(days, runs, component, rate_at_most):
    rng = np.random.default_rng([days, runs])
    day = np.repeat(np.arange(days), runs)
    series = [rng.normal(size=len(day)) + component * rng.normal(size=days)[day] for _ in range(400)]
    t = np.arange(len(day), dtype=float)
    alarms = share_called(Scanner(t, None, "constant", day), series, rng)
    assert rate_at_most(alarms, len(series), 0.05), alarms / len(series)
    without = share_called(Scanner(t, None, "constant"), series, rng)
    assert without > 1.5 * alarms or component < 1.0 or days == 10


def thirteen(rng, days, runs, component, height=0.0):
    """Histories of 13 parameters whose days differ, the first with a step two days before the end."""
    day = np.repeat(np.arange(days), runs)
    while True:
        y = rng.normal(size=(len(day), 13)) + component * rng.normal(size=(days, 13))[day]
        y[day >= days - 2, 0] += height
        yield {str(i): y[:, i] for i in range(13)}, np.arange(len(day), dtype=float), day


@pytest.mark.parametrize(
    # Measured (docs/trials-statistics.md): 5 to 9 % of histories; without the evidence of the others 37 and 99 %.
    ("days", "runs", "component", "most"),
    [(4, 5, 2.0, 8), (4, 5, 4.0, 9), (5, 4, 2.0, 8)],
)
def test_days_that_differ_much_in_all_parameters_raise_few_false_alarms(days, runs, component, most, seeds):
    rng = np.random.default_rng([days, int(component)])
    histories = thirteen(rng, days, runs, component)
    alarms = 0
    numbers = seeds(40, 12)
    for _ in numbers:
        values, t, day = next(histories)
        found = find_changes(values, t, days=day, rng=rng)
        alarms += bool(found.changes or found.trends)
    # Of 12 histories more than five once in a thousand times.
    assert alarms <= {40: most, 12: 5}[len(numbers)]


def test_a_step_of_one_parameter_is_found_where_the_days_of_the_others_are_alike():
    rng = np.random.default_rng(8)
    histories = thirteen(rng, 4, 5, 0.0, height=10.0)
    for _ in range(25):
        values, t, day = next(histories)
        assert {one.parameter for one in find_changes(values, t, days=day, rng=rng).changes} == {"0"}


def test_wide_days_are_believed_where_others_show_them():
    weak, wide = np.array([0.0, -0.2, -1.0, -3.0, -4.0]), np.array([-6.0, -4.0, -2.0, -0.3, 0.0])
    flat = np.zeros(5)
    assert not shows_wide_days(np.array([flat]))[0]
    assert not shows_wide_days(np.array([wide]))[0]
    assert not shows_wide_days(np.array([flat, *[weak] * 12]))[0]
    assert shows_wide_days(np.array([flat, *[wide] * 12])).all()
    mixed = shows_wide_days(np.array([weak, wide, flat, *[wide] * 6, *[weak] * 6]))
    assert mixed[1:3].tolist() == [True, True]


@pytest.mark.parametrize(
    # Steps of five innovation standard deviations; measured with 300: 0.95, 0.86, 0.98, 0.93 (heavy tails
    # allowed for).
    ("n", "r", "least"),
    [(20, 0.0, 0.89), (20, 0.3, 0.82), (44, 0.3, 0.94), (44, 0.6, 0.89)],
)
def test_power_stays_useful(n, r, least):
    rng = np.random.default_rng([n, int(10 * r), 1])
    series = [first_order(rng, n, r) + 5.0 * (np.arange(n) >= 12 * n // 20) for _ in range(300)]
    found = share_called(Scanner(np.arange(n, dtype=float), None, "constant"), series, rng)
    assert found / 300 >= least


@pytest.mark.parametrize("r", [0.0, 0.6])
@pytest.mark.all_seeds
def test_false_alarm_rate_of_many_heteroscedastic_parameters_together(r, rate_at_most):
    rng = np.random.default_rng(3)
    u = np.exp(0.5 * rng.normal(size=24))
    alarms = 0
    for _ in range(150):
        values = {f"p{j}": first_order(rng, 24, r) * u for j in range(4)}
        history = find_changes(values, np.arange(24), u=dict.fromkeys(values, u), rng=rng, trials=399)
        alarms += bool(history.changes or history.trends)
    assert rate_at_most(alarms, 150, 0.05), alarms / 150


def test_the_likelihood_of_a_shape_is_that_of_the_dense_normal_density():
    # Two ways: cumulative sums of whitened rows, and the residual likelihood of Patterson and Thompson
    # (Biometrika 58 (1971) 545) with dense matrices.
    rng = np.random.default_rng(8)
    t, u, day = np.sort(rng.uniform(0, 10, 15)), rng.uniform(0.5, 2.0, 15), np.repeat(np.arange(5), 3)
    y = rng.normal(size=15)
    for base in ("constant", "line"):
        scanner = Scanner(t, u, base, day)
        plain, best = scanner._deviances((scanner.root * y)[:, np.newaxis], range(len(scanner.prepared)))
        fixed = np.column_stack([np.ones(15), t] if base == "line" else [np.ones(15)])
        gains = []
        for prepared in scanner.prepared:
            colour = prepared.shape.colour(np.eye(15)) / scanner.root[:, np.newaxis]
            v = np.linalg.inv(colour @ colour.T)

            def deviance(design, v=v, base=fixed.shape[1]):
                # The candidate's coefficient in units of the scatter: the power of the base alone.
                p = v - v @ design @ np.linalg.inv(design.T @ v @ design) @ design.T @ v
                logdet = np.linalg.slogdet(design.T @ v @ design)[1] - np.linalg.slogdet(v)[1]
                return (15 - base) * np.log(y @ p @ y) + logdet

            candidates = [deviance(np.column_stack([fixed, c])) for c in scanner.columns.T]
            gains.append(deviance(fixed) - min(candidates))
        # Up to the scales of the columns, which are constants of the plan.
        apart = (plain - best)[:, 0] - np.array(gains)
        assert apart == pytest.approx(np.full(len(gains), apart[0]), abs=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_five_days_reset_of_the_b_axis_is_found_and_nothing_else_flagged(seed):
    hours, day, parameters = campaign("five-days")
    history = find_changes(parameters, hours, rng=np.random.default_rng(seed))
    assert [(c.parameter, c.kind) for c in history.changes] == [("EB0C", "step")]
    assert history.trends == ()
    change = history.changes[0]
    assert day[change.index - 1 : change.index + 1].tolist() == [3.0, 4.0]
    assert change.interval == (hours[11], hours[12])
    assert change.p_value < 0.05 / 13
    with_days = find_changes(parameters, hours, days=day, rng=np.random.default_rng(seed))
    assert [(c.parameter, c.index) for c in with_days.changes] == [("EB0C", change.index)]
    assert with_days.trends == ()


def test_hot_cold_warms_up_and_is_not_taken_for_steps():
    hours, _, parameters = campaign("hot-cold")
    history = find_changes(parameters, hours, rng=np.random.default_rng(1))
    assert {"EYY", "EZZ", "EXX"} <= {t.parameter for t in history.trends if t.kind == "transient"}
    assert not {"EYY", "EZZ", "EXX"} & {c.parameter for c in history.changes}


def test_a_step_is_a_step_and_a_drift_a_trend():
    rng = np.random.default_rng(4)
    steps = drifts = 0
    for _ in range(40):
        noise = rng.normal(size=(2, 40))
        values = {"step": noise[0] + 4.0 * (np.arange(40) >= 25), "drift": noise[1] + 0.15 * np.arange(40)}
        history = find_changes(values, np.arange(40), rng=rng, trials=399)
        steps += [c.kind for c in history.changes if c.parameter == "step"][:1] == ["step"]
        drifts += any(t.kind == "trend" for t in history.trends if t.parameter == "drift")
        assert not any(
            t.parameter == "step" and t.kind == "trend" and t.index == 0 for t in history.trends[:1]
        )
    assert steps >= 38
    assert drifts >= 34


def test_a_change_of_slope_is_found_with_its_size():
    t = np.arange(60.0)
    y = 0.5 * t - 0.9 * np.maximum(t - 35.0, 0.0) + np.random.default_rng(5).normal(size=60)
    history = find_changes({"EXX": y}, t, rng=np.random.default_rng(6))
    assert [c.kind for c in history.changes] == ["slope"]
    change = history.changes[0]
    assert change.interval[0] <= 35.0 <= change.interval[1]
    assert abs(change.size + 0.9) < 0.1


def test_interval_for_when_covers(rate_agrees):
    rng = np.random.default_rng(7)
    trials = inside = 0
    for _ in range(80):
        y = rng.normal(size=44) + 2.5 * (np.arange(44) >= 20)
        found = [
            c for c in find_changes({"a": y}, np.arange(44), rng=rng, trials=199).changes if c.kind == "step"
        ]
        if found:
            nearest = min(found, key=lambda c: abs(c.index - 20))
            trials += 1
            inside += nearest.interval[0] <= 19 and nearest.interval[1] >= 20
    assert trials > 76
    assert inside / trials > 0.93  # nominal 0.95; whole runs make it conservative


def test_the_unit_of_the_values_and_the_origin_of_the_times_change_nothing():
    hours, day, parameters = campaign("five-days")
    plain, other = (
        find_changes(
            {name: parameters[name] * unit for name in ("EB0C", "EXX")}, hours / scale + origin, days=day,
            rng=np.random.default_rng(1), trials=999,
        )
        for unit, scale, origin in ((1.0, 1.0, 0.0), (1e-6, 24.0, 20000.0))
    )  # fmt: skip
    assert [(c.index, c.p_value) for c in plain.changes] == [(c.index, c.p_value) for c in other.changes]
    assert plain.changes[0].size == pytest.approx(other.changes[0].size * 1e6, rel=1e-6)
    assert plain.changes[0].u == pytest.approx(other.changes[0].u * 1e6, rel=1e-6)


def test_known_events_split_the_history_and_are_no_findings():
    rng = np.random.default_rng(88)
    y = rng.normal(size=40) + 8.0 * (np.arange(40) >= 20)
    assert 20 in [c.index for c in find_changes({"a": y}, np.arange(40), rng=rng).changes]
    assert find_changes({"a": y}, np.arange(40), events=[19.5], rng=rng).changes == ()
    y[30:] += 8.0
    found = find_changes({"a": y}, np.arange(40), events=[19.5], rng=rng).changes
    assert [c.index for c in found] == [30]
    assert abs(found[0].size - 8.0) < 4 * found[0].u


def test_refusals_say_what_is_needed():
    rng = np.random.default_rng(0)
    with pytest.raises(DataError, match="times falls at index 3"):
        find_changes({"a": np.arange(6.0)}, [0, 1, 2, 1, 3, 4], rng=rng)
    with pytest.raises(DataError, match=r"trials is 99; 13 parameters in 1 pieces at 0\.05 need at least 2"):
        find_changes({f"p{i}": np.arange(6.0) for i in range(13)}, np.arange(6.0), rng=rng, trials=99)
    with pytest.raises(DataError, match="u names 'b'; values has a"):
        find_changes({"a": np.arange(6.0)}, np.arange(6.0), u={"b": np.ones(6)}, rng=rng)
    with pytest.raises(DataError, match="values holds no parameter"):
        find_changes({}, np.arange(6.0), rng=rng)


def test_a_part_of_a_yearly_wave_of_one_scatter_is_no_change_and_a_step_of_six_is(rate_at_most):
    rng = np.random.default_rng(14)
    t = 7.0 * np.arange(34)
    with_season, without = _Search(rng, 1999), _Search(rng, 1999)

    def is_called(search: _Search, y: np.ndarray, cycle: float | None) -> bool:
        return any(search.pieces([(_Series("a", y, t, None, None, cycle), 0)], 0.01))

    called = plain = seen = 0
    for _ in range(150):
        y = rng.normal(size=len(t)) + np.cos(2.0 * np.pi * (t / 365.25 + rng.uniform()))
        called += is_called(with_season, y, 365.25)
        plain += is_called(without, y, None)
        seen += is_called(with_season, rng.normal(size=len(t)) + 6.0 * (t > 120.0), 365.25)
    assert rate_at_most(called, 150, 0.015)
    assert plain / 150 > 0.1
    assert seen / 150 > 0.9


def test_a_wave_that_is_too_long_to_show_is_allowed_for_beside_runs_that_follow_each_other():
    t, rng = 7.0 * np.arange(20), np.random.default_rng(20)
    with_season, without = (Scanner(t, None, "constant", None, cycle) for cycle in (365.25, None))
    p_values = []
    while len(p_values) < 15:
        wave = np.cos(2.0 * np.pi * (t + rng.uniform(0.0, 365.25)) / 365.25)
        y = first_order(rng, len(t), 0.6) + wave
        p, p_season = (
            each.scan(y, np.random.default_rng(1), 499, 1.0).p_value for each in (without, with_season)
        )
        if p < 0.3:
            p_values.append((p, p_season))
    # Allowed for beside independent runs alone, it raised 7 of 17 such.
    assert sum(p_season > p for p, p_season in p_values) >= 13, p_values


@pytest.mark.parametrize("base", ["constant", "line"])
def test_the_statistic_of_a_series_is_the_same_however_many_are_computed_at_once(base, monkeypatch):
    # Of 20 runs 500 series are computed at once, of 80 a fifth of them.
    for n in (20, 80):
        day = np.arange(n) // 4
        scanner = Scanner(np.arange(n, dtype=float), None, base, day)
        series = np.random.default_rng(n).standard_normal((n, scan.BLOCK))
        gains = []
        for at_once in (0, scan.AT_ONCE, 10**9):
            monkeypatch.setattr(scan, "AT_ONCE", at_once)
            gains.append([scanner._gain(series, family) for family in range(3)])
        monkeypatch.undo()
        np.testing.assert_allclose(gains[1], gains[0], rtol=1e-12, atol=1e-10)
        np.testing.assert_allclose(gains[2], gains[0], rtol=1e-12, atol=1e-10)
