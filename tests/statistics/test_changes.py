"""Changes: false-alarm probability on null data, intervals for when, the B-axis reset of five-days, hot-cold."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.statistics import find_changes, joint_change

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


@pytest.mark.parametrize(
    # Nominal 5 %; as measured with 1500 other histories each.
    ("n", "r", "level"),
    [(20, 0.0, 0.05), (44, 0.0, 0.048), (44, 0.5, 0.085)],
)
def test_false_alarm_rate(n, r, level, rate_agrees):
    rng = np.random.default_rng([n, int(10 * r)])
    alarms = 0
    for _ in range(300):
        history = find_changes({"a": first_order(rng, n, r)}, np.arange(n), rng=rng, trials=399)
        alarms += bool(history.changes or history.trends)
    assert rate_agrees(alarms, 300, level), alarms / 300


def test_false_alarm_rate_of_many_heteroscedastic_parameters_together(rate_agrees):
    rng = np.random.default_rng(3)
    u = np.exp(0.5 * rng.normal(size=24))
    alarms = 0
    for _ in range(150):
        values = {f"p{j}": rng.normal(size=24) * u for j in range(4)}
        history = find_changes(values, np.arange(24), u=dict.fromkeys(values, u), rng=rng, trials=399)
        alarms += bool(history.changes or history.trends)
    assert rate_agrees(alarms, 150, 0.05), alarms / 150


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


def test_hot_cold_warms_up_and_is_not_taken_for_steps():
    hours, _, parameters = campaign("hot-cold")
    history = find_changes(parameters, hours, rng=np.random.default_rng(1))
    assert {"EYY", "EZZ", "EXX"} <= {t.parameter for t in history.trends if t.kind == "transient"}
    assert not {"EYY", "EZZ", "EXX"} & {c.parameter for c in history.changes}


def test_a_step_is_a_step_and_a_drift_a_trend():
    rng = np.random.default_rng(4)
    steps = drifts = 0
    for _ in range(60):
        noise = rng.normal(size=(2, 40))
        values = {"step": noise[0] + 4.0 * (np.arange(40) >= 25), "drift": noise[1] + 0.15 * np.arange(40)}
        history = find_changes(values, np.arange(40), rng=rng, trials=399)
        steps += [c.kind for c in history.changes if c.parameter == "step"][:1] == ["step"]
        drifts += any(t.kind == "trend" for t in history.trends if t.parameter == "drift")
        assert not any(
            t.parameter == "step" and t.kind == "trend" and t.index == 0 for t in history.trends[:1]
        )
    assert steps >= 57
    assert drifts >= 51


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
    for _ in range(120):
        y = rng.normal(size=44) + 2.5 * (np.arange(44) >= 20)
        found = [
            c for c in find_changes({"a": y}, np.arange(44), rng=rng, trials=399).changes if c.kind == "step"
        ]
        if found:
            nearest = min(found, key=lambda c: abs(c.index - 20))
            trials += 1
            inside += nearest.interval[0] <= 19 and nearest.interval[1] >= 20
    assert trials > 114
    assert inside / trials > 0.93  # nominal 0.95; whole runs make it conservative


def test_known_events_split_the_history_and_are_no_findings():
    rng = np.random.default_rng(88)
    y = rng.normal(size=40) + 8.0 * (np.arange(40) >= 20)
    assert 20 in [c.index for c in find_changes({"a": y}, np.arange(40), rng=rng).changes]
    assert find_changes({"a": y}, np.arange(40), events=[19.5], rng=rng).changes == ()
    y[30:] += 8.0
    found = find_changes({"a": y}, np.arange(40), events=[19.5], rng=rng).changes
    assert [c.index for c in found] == [30]
    assert abs(found[0].size - 8.0) < 4 * found[0].u


def test_joint_change_sees_what_no_parameter_shows_alone_at_its_rate(rate_agrees):
    rng = np.random.default_rng(9)
    t = np.arange(24)
    alarms = sum(
        joint_change(rng.normal(size=(24, 4)), t, rng=rng, trials=199).p_value <= 0.05 for _ in range(200)
    )
    assert rate_agrees(alarms, 200, 0.05)
    values = rng.normal(size=(24, 1)) + 0.1 * rng.normal(size=(24, 2))
    values[14:, 0] += 0.5
    values *= [1.0, 1e-6]
    found = joint_change(values, t, rng=rng)
    assert found.index == 14
    assert found.p_value < 0.002
    assert find_changes({"a": values[:, 0], "b": values[:, 1]}, t, rng=rng).changes == ()


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
    with pytest.raises(DataError, match="8 runs for 4 parameters; more than 8"):
        joint_change(rng.normal(size=(8, 4)), np.arange(8.0), rng=rng)
