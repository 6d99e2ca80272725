"""Histories of several instruments: what one of them is off by is no cause, no step and no drift of the machine."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from monitor.cli.dependence_output import dependences
from monitor.reporting.confounding import charted
from monitor.reporting.lacks import Undecided
from monitor.sources import CommonQuantity
from monitor.statistics.groups import eras, interleaved_columns, most_common, share_within
from monitor.store import Database, MachineEvent, MachineHistory
from monitor.web.rendering import _environment
from monitor.workflow.history.agreement import agreement
from monitor.workflow.history.event_steps import event_steps
from monitor.workflow.history.other_instruments import between_instruments
from monitor.workflow.history.past import machine_past, splitting_events
from monitor.workflow.history.series import parameter_series
from monitor.workflow.trend.causes import conditions, cycles
from monitor.workflow.trend.control import Charts
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import _answer

START = datetime(2026, 1, 5, tzinfo=UTC)
LASER, BAR = "instruments (laser)", "instruments (ball bar)"


def history(letters: str, levels: list[float], hours: list[float], degrees: list[float]) -> MachineHistory:
    """Campaigns a month apart, by laser (L) or bar (B), two days of two runs each."""
    rng = np.random.default_rng(5)
    count, runs = len(letters), 4 * len(letters)
    of = np.repeat(np.arange(count), 4)
    day = np.tile([1, 1, 2, 2], count)
    values = np.repeat(levels, 4) + np.repeat(rng.normal(0.0, 0.2, 2 * count), 2) + rng.normal(0.0, 0.2, runs)
    return MachineHistory(
        machine="M", campaigns={i: f"c{i}" for i in range(count)}, campaign=np.array([f"c{i}" for i in of]),
        method=np.full(runs, "instruments"), measured_by=np.array([LASER if letters[i] == "L" else BAR for i in of]),
        run=np.arange(runs), started_at=tuple(
            START + timedelta(days=30 * int(i) + int(day[k]), hours=hours[i] + k % 2) for k, i in enumerate(of)
        ),
        day=day, warm_up=np.zeros(runs, dtype=np.bool_), parameters=("EXX",), units=("µm/m",), values=values[:, None],
        u=np.full((runs, 1), 0.3), conditions={"ambient_degC": np.repeat(degrees, 4) + rng.normal(0.0, 0.1, runs)},
        tolerances={}, unidentified=(),
    )  # fmt: skip


def event(before: int) -> MachineEvent:
    return MachineEvent(START + timedelta(days=30 * before - 10), "repair", "spindle")


@pytest.fixture
def db(tmp_path):
    with Database(tmp_path / "m.duckdb", threads=1) as opened:
        yield opened


def of_letters(letters: str, laser: float, bar: float) -> list[float]:
    return [laser if letter == "L" else bar for letter in letters]


def test_a_temperature_at_which_each_instrument_measured_alone_is_not_decided(db):
    """The bar is 3 µm/m off and measures at 23 °C in the evening: 0.75 µm/m/K and a wave of the day were told."""
    letters = "LB" * 6
    machine = history(
        letters, of_letters(letters, 0, 3), of_letters(letters, 7, 20), of_letters(letters, 19, 23)
    )
    series = parameter_series(machine)["EXX"][0]
    (effect,), _ = conditions(series, machine.true_conditions, -np.inf)
    assert effect.p_value < 1e-3
    assert [(at.by, round(at.least), round(at.greatest)) for at in effect.not_decided.measured] == [
        (LASER, 19, 19), (BAR, 23, 23),
    ]  # fmt: skip
    assert all(wave.not_decided is not None for wave in cycles(series)[0])
    answer = _answer(db, TrendRequest("M", parameter="EXX"), machine, [], machine_past(machine, []), {}, {})
    (sentence,) = [line for line in dependences(answer) if "whether it goes with ambient" in line]
    assert sentence.startswith("EXX: whether it goes with ambient_degC: the data cannot decide: measured by")
    assert sentence.endswith("°C, would decide")


def test_a_slope_within_each_instrument_is_found_beside_what_these_are_off_by():
    letters, rng = "LB" * 8, np.random.default_rng(1)
    degrees = rng.uniform(18.0, 24.0, 16).tolist()
    levels = [1.5 * (warm - 20.0) + off for warm, off in zip(degrees, of_letters(letters, 0, 5), strict=True)]
    machine = history(letters, levels, [8.0] * 16, degrees)
    (effect,), _ = conditions(parameter_series(machine)["EXX"][0], machine.true_conditions, -np.inf)
    assert effect.not_decided is None
    assert effect.coefficient == pytest.approx(1.5, abs=4.0 * effect.u)
    assert effect.u < 0.1


def test_the_first_campaign_by_another_instrument_is_no_change_that_passes_again():
    letters = "L" + "B" * 9
    machine = history(letters, of_letters(letters, 0, 5), [8.0] * 10, [20.0] * 10)
    past = machine_past(machine, [])
    search = past["EXX"].search
    assert [change.kind for change in search.changes] == ["step"]
    assert "transient" not in [change.kind for change in search.drifts]
    (others,) = between_instruments(machine, past).values()
    assert (others.before, others.after, others.may_be_all) == (LASER, BAR, True)


def test_a_step_that_both_of_two_instruments_show_is_found_and_what_they_are_apart_is_none():
    letters = "LB" * 6
    levels = [off + 4.0 * (i >= 6) for i, off in enumerate(of_letters(letters, 0, 5))]
    machine = history(letters, levels, [8.0] * 12, [20.0] * 12)
    (change,) = machine_past(machine, [])["EXX"].search.changes
    assert change.kind == "step"
    assert change.size == pytest.approx(4.0, abs=0.5)


def test_a_step_at_an_event_between_instruments_is_decided_by_one_that_measured_on_both_sides():
    past = {}
    for letters in ("LLLLBBBB", "LBLBLBLB"):
        machine = history(letters, [off + 3.0 * (i >= 4) for i, off in enumerate(of_letters(letters, 0, 2))],
                          [8.0] * 8, [20.0] * 8)  # fmt: skip
        past[letters] = machine_past(machine, splitting_events([event(4)]))
    (apart,) = event_steps(past["LLLLBBBB"], [event(4)])
    assert apart.undecided is Undecided.INSTRUMENTS_MAY_DO
    (both,) = event_steps(past["LBLBLBLB"], [event(4)])
    assert both.decided
    assert both.size == pytest.approx(3.0, abs=0.6)


def test_a_drift_that_all_instruments_show_is_taken_out_of_a_pair_of_one(db):
    """One campaign by laser on each side, ten months apart, with 0.5 µm/m a month: called a step of 5 µm/m."""
    letters = "LBBBBBBBBBL"
    levels = [0.5 * i + off for i, off in enumerate(of_letters(letters, 0, 2))]
    machine = history(letters, levels, [8.0] * 11, [20.0] * 11)
    pair = next(each for each in agreement(db, machine, [event(5)]) if each.method == LASER)
    gain = pair.parameters["EXX"]
    assert gain.agree is not False
    assert gain.expected_of_drift == pytest.approx(5.0, abs=1.0)
    assert gain.drift_in_30_days == pytest.approx(0.5, abs=0.1)
    stepped = replace(
        machine, values=machine.values + 4.0 * (machine.seconds >= event(5).at.timestamp())[:, None]
    )
    pair = next(each for each in agreement(db, stepped, [event(5)]) if each.method == LASER)
    assert pair.disagree == ("EXX",)


def test_charts_are_of_one_instrument_and_name_it():
    letters = "LB" * 10
    machine = history(letters, of_letters(letters, 0, 5), [8.0] * 20, [20.0] * 20)
    charts = Charts(machine, timedelta(), [], None)
    assert charts.period().measured_by == BAR
    assert np.ptp(charts.points.values[charts.inside, 0]) < 2.0
    plain = Charts(history("L" * 20, [0.0] * 20, [8.0] * 20, [20.0] * 20), timedelta(), [], None)
    assert plain.period().measured_by is None


@pytest.mark.parametrize(
    ("part", "campaigns_of_each", "points"),
    [(0.02, 6, 48), (0.5, 6, 12), (None, 6, 12), (0.5, 2, 48)],
)
def test_a_new_certificate_begins_charts_anew_where_it_shows_and_leaves_points_enough(
    part: float | None, campaigns_of_each: int, points: int
) -> None:
    """Yearly calibrations left four points and no chart: of 0.3 µm/m scatter a part of 0.02 shows nothing."""
    machine = history("L" * 24, [0.0] * 24, [8.0] * 24, [20.0] * 24)
    numbers = np.array([int(name[1:]) // campaigns_of_each for name in machine.campaign.tolist()])
    certificates = {f"c{i}": {"laser": f"L-{i // campaigns_of_each}"} for i in range(24)}
    common_parts = {
        CommonQuantity("laser", f"L-{number}", "scale", 1e-6): np.where(numbers == number, part, 0.0)[:, None]
        for number in range(24 // campaigns_of_each)
        if part is not None
    }
    calibrations = replace(machine.calibrations, certificates=certificates)
    machine = replace(machine, calibrations=calibrations, common_parts=common_parts)
    charts = Charts(machine, timedelta(), [], None)
    assert len(charts.points.t) == points
    assert (charts.period().measured_by is None) == (points == 48)


def test_groups_by_hand():
    groups = np.array([0, 0, 1, 0, 2, 2, 3])
    np.testing.assert_array_equal(eras(groups), [0, 0, 0, 0, 1, 1, 2])
    np.testing.assert_array_equal(interleaved_columns(groups), [[0], [0], [1], [0], [0], [0], [0]])
    assert most_common([np.array([1, 1, 2]), np.array([2, 2, 1])]) == 1
    assert most_common([np.array([1]), np.array([2])]) is None
    line = np.array([0.0, 1.0, 2.0, 3.0])[:, None]
    # 1 of 5: within pairs (0, 1), (2, 3) the squares are 4 of 0.25, about the mean of all 5.
    assert share_within(line, np.array([0, 0, 1, 1])) == pytest.approx(0.2)


def test_the_page_says_what_instruments_leave_undecided_and_follows_no_such_temperature(db):
    letters = "LB" * 10
    machine = history(
        letters, of_letters(letters, 0, 3), of_letters(letters, 7, 20), of_letters(letters, 19, 23)
    )
    request = TrendRequest("M", parameter="EXX")
    answer = _answer(db, request, machine, [], machine_past(machine, []), {}, {})
    template = _environment().get_template("goes_with.html")
    said = template.render(statement=answer.parameters["EXX"], trend=answer)
    follows, _, undecided = said.partition("<dt>Not decided</dt>")
    assert "method instruments (ball bar)" in follows
    assert "ambient" not in follows
    assert (
        "whether it goes with ambient: the data cannot decide: measured by instruments (laser)" in undecided
    )
    assert f", those by {BAR} alone" in said


def test_charts_of_a_named_period_say_that_several_instruments_measured():
    letters = "LB" * 10
    machine = history(letters, of_letters(letters, 0, 5), [8.0] * 20, [20.0] * 20)
    first = machine.seconds[0] / 86400.0
    period = Charts(machine, timedelta(), [], (first, first + 200.0)).period()
    assert charted(period.measured_by, period.several_instruments).startswith(", by several instruments")
    plain = history("L" * 20, [0.0] * 20, [8.0] * 20, [20.0] * 20)
    period = Charts(plain, timedelta(), [], (first, first + 200.0)).period()
    assert charted(period.measured_by, period.several_instruments) == ""
