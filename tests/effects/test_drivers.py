"""Drivers: what an effect is multiplied by, number by number, and over days in a campaign's own records."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from monitor.effects import Context, context_of, parse_effect, positions_of, with_time_constant
from monitor.effects.catalogue import drivers_of
from monitor.exceptions import DataError, EffectError
from monitor.machine import parse_topology
from monitor.records import Array, Artefact, Ball, Campaign, Machine, Probe, Probings, Run

HU40 = "w C B X b Z Y (C1) t"
EASTERN = timezone(timedelta(hours=-5))


def columns(text: str, context: Context) -> Array:
    basis = parse_effect(text, context.chain).basis(context)
    found: Array = basis.columns  # type: ignore[union-attr]
    return found


def small_campaign(count: int = 3) -> Campaign:
    """Two days, two runs a day, three probings a run; run 4 is listed first, and starts 2 h into day 2."""
    starts = {
        1: datetime(2026, 3, 2, 8, 0, tzinfo=EASTERN),
        2: datetime(2026, 3, 2, 9, 0, tzinfo=EASTERN),
        3: datetime(2026, 3, 3, 8, 30, tzinfo=EASTERN),
        # 15:30 UTC is 10:30 in the zone of the others.
        4: datetime(2026, 3, 3, 15, 30, tzinfo=timezone.utc),  # noqa: UP017
    }
    runs = tuple(
        Run(
            number,
            starts[number],
            1 + (number > 2),
            False,
            {"ambient_degC": 20.0 + number, "air_hPa": 1000.0},
        )
        for number in (4, 1, 2, 3)
    )
    run = np.repeat([1, 2, 3, 4], count)
    time = np.tile(10.0 + 100.0 * np.arange(count), 4)
    x = np.arange(4.0 * count)
    probings = Probings(
        run,
        np.tile(np.arange(1, count + 1), 4),
        time,
        np.tile(np.array(["1", "2", "1"])[:count], 4),
        {"X": x, "B": np.deg2rad(x)},
        {"x_axis_degC": 22.0 + x},
    )
    balls = (Ball("1", (1.0, 2.0, 3.0), 12.7), Ball("2", (4.0, 5.0, 6.0), 12.7))
    return Campaign(
        "small", "samba", Machine("M", HU40), Probe("P", "p", 1e-3), Artefact("A", balls), runs, probings
    )


def test_warmup_is_one_less_the_exponential(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0] * 3}, day_time=[0.0, 2700.0, 5400.0])
    expected = [0.0, 0.6321205588285577, 0.8646647167633873]
    np.testing.assert_allclose(columns("EZC1:const@warmup45min", context).ravel(), expected, rtol=1e-14)


def test_warmup_without_a_constant_starts_at_one_hour(make: Callable[..., Context]) -> None:
    context = make({"X": [0.0]}, day_time=[3600.0])
    searched = parse_effect("EZC1:const@warmup", context.chain)
    assert columns("EZC1:const@warmup", context)[0, 0] == pytest.approx(0.6321205588285577, rel=1e-14)
    fixed = with_time_constant(searched, 1800.0)
    assert fixed.text == "EZC1:const@warmup"
    assert fixed.basis(context).columns[0, 0] == pytest.approx(0.8646647167633873, rel=1e-14)  # type: ignore[union-attr]


def test_settling_begins_anew_with_every_run() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    expected = np.tile([0.016528546178382446, 0.16750938738839732, 0.2953119102812866], 4)
    np.testing.assert_allclose(columns("EZC1:const@settling10min", context).ravel(), expected, rtol=1e-12)
    searched = columns("EZC1:const@settling", context)
    np.testing.assert_array_equal(searched, columns("EZC1:const@settling10min", context))
    with pytest.raises(EffectError, match=re.escape("the time constant of @settling must be above 0 min")):
        parse_effect("EZC1:const@settling0min", context.chain)


def test_settling_is_a_driver_where_a_day_has_several_runs() -> None:
    campaign = small_campaign()
    assert "settling" in drivers_of(context_of(campaign, parse_topology(HU40)))
    first = campaign.probings.rows((campaign.probings.run == 1) | (campaign.probings.run == 3))
    alone = context_of(replace(campaign, probings=first), parse_topology(HU40))
    assert "settling" not in drivers_of(alone)


def test_warmup_counts_from_the_first_run_of_each_day() -> None:
    campaign = small_campaign()
    context = context_of(campaign, parse_topology(HU40))
    expected = [10, 110, 210, 3610, 3710, 3810, 10, 110, 210, 7210, 7310, 7410]
    np.testing.assert_allclose(context.day_time, expected, rtol=0, atol=1e-9)


def test_a_lagged_temperature_solves_its_differential_equation() -> None:
    """tau dy/dt = T - y with straight lines between the readings, against an integration of scipy's; each day begins
    settled."""
    context = context_of(small_campaign(), parse_topology(HU40))
    lagged = columns("EXX:const@lagged5min_x_axis_degC", context).ravel()
    temperature = columns("EXX:const@x_axis_degC", context).ravel()
    for day in (slice(0, 6), slice(6, 12)):
        time, recorded = context.day_time[day], temperature[day]
        solved = solve_ivp(
            lambda t, y, time=time, recorded=recorded: (np.interp(t, time, recorded) - y) / 300.0,
            (time[0], time[-1]),
            recorded[:1],
            t_eval=time,
            rtol=1e-9,
            atol=1e-10,
            max_step=20.0,
        )
        np.testing.assert_allclose(lagged[day], solved.y[0], atol=1e-7)
    at_once = columns("EXX:const@lagged0.001min_x_axis_degC", context).ravel()
    np.testing.assert_allclose(at_once, temperature, atol=1e-2)


def test_a_lagged_temperature_has_a_time_constant_like_a_warm_up() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    searched = parse_effect("EXX:poly1@lagged_x_axis_degC", context.chain)
    fixed = with_time_constant(searched, 300.0)
    assert fixed.text == "EXX:poly1@lagged_x_axis_degC"
    known = parse_effect("EXX:poly1@lagged5min_x_axis_degC", context.chain)
    np.testing.assert_array_equal(fixed.basis(context).columns, known.basis(context).columns)  # type: ignore[union-attr]
    with pytest.raises(EffectError, match=re.escape("must be above 0 min; without one: @x_axis_degC")):
        parse_effect("EXX:poly1@lagged0min_x_axis_degC", context.chain)
    with pytest.raises(EffectError, match="no channel 'y_axis_degC'; this campaign has"):
        parse_effect("EXX:poly1@lagged_y_axis_degC", context.chain).basis(context)


def test_run_time_goes_from_zero_to_one_in_every_run() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    np.testing.assert_allclose(
        columns("EXX:const@run_time", context).ravel(), [0.0, 0.5, 1.0] * 4, atol=1e-15
    )


def test_run_time_of_one_run_is_zero_in_the_others() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    expected = [0.0] * 3 + [0.0, 0.5, 1.0] + [0.0] * 6
    np.testing.assert_allclose(columns("EXX:const@run_time(2)", context).ravel(), expected, atol=1e-15)
    effect = parse_effect("EB0Z@run_time(2)", context.chain)
    assert effect.text == "EB0Z@run_time(2)"
    assert effect.driver.phrase == ", drifting evenly in run 2 alone"


def test_a_step_is_one_from_its_reading_to_the_end_of_its_run() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    effect = parse_effect("EC0B@stepped(run 2, sequence 2)", context.chain)
    assert columns(effect.text, context)[:, 0].tolist() == [0.0] * 4 + [1.0] * 2 + [0.0] * 6
    assert effect.parameters(context) == ("EC0B@stepped(run 2, sequence 2)",)
    with pytest.raises(EffectError, match=r"'@stepped\(run 9, sequence 2\)': this campaign has no run 9"):
        columns("EC0B@stepped(run 9, sequence 2)", context)
    with pytest.raises(EffectError, match=r"'@stepped' must say when: write @stepped\(run 7, sequence 23\)"):
        parse_effect("EC0B@stepped", context.chain)


def test_run_time_of_a_run_with_one_probing_is_zero() -> None:
    context = context_of(small_campaign(1), parse_topology(HU40))
    assert columns("EXX:const@run_time", context).ravel().tolist() == [0.0] * 4


def test_channels_are_less_their_reference() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    # ISO 1: 20 degC for a temperature, recorded in a probing or in a run.
    assert columns("EXX:const@x_axis_degC", context).ravel().tolist() == (2.0 + np.arange(12.0)).tolist()
    assert (
        columns("EXX:const@ambient_degC", context).ravel().tolist()
        == [1.0] * 3 + [2.0] * 3 + [3.0] * 3 + [4.0] * 3
    )
    # Anything else: the mean of the campaign.
    assert columns("EXX:const@air_hPa", context).ravel().tolist() == [0.0] * 12
    np.testing.assert_allclose(columns("EXX:const@x_mm", context).ravel(), np.arange(12) - 5.5, atol=1e-13)
    np.testing.assert_allclose(columns("EXX:const@b_deg", context).ravel(), np.arange(12) - 5.5, atol=1e-12)


def test_shape_times_driver_is_the_product() -> None:
    context = context_of(small_campaign(), parse_topology(HU40, {"X": 1}))
    product = np.arange(12.0) * (2.0 + np.arange(12.0))
    np.testing.assert_allclose(columns("EXX:poly1@x_axis_degC", context).ravel(), product, rtol=1e-14)


def test_each_run_has_its_own_multiplier() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    np.testing.assert_array_equal(columns("EXX:const@each_run", context), np.repeat(np.eye(4), 3, axis=0))
    assert parse_effect("EXX:const@each_run", context.chain).parameters(context) == tuple(
        f"EXX:const@each_run.run{run}" for run in (1, 2, 3, 4)
    )


def test_gravity_has_the_components_in_the_frame_of_the_axis(make: Callable[..., Context]) -> None:
    context = make({"C": [0.0, np.pi / 2, np.pi], "B": [1.0, 2.0, 3.0]})
    np.testing.assert_allclose(
        columns("EAC:const@gravity", context), [[0, -1, 0], [-1, 0, 0], [0, 1, 0]], rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(columns("EAB:const@gravity", context), [[0, -1, 0]] * 3, rtol=0, atol=1e-15)


def test_an_unknown_channel_is_refused_with_those_there_are() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    words = (
        "no channel 'y_axis_degC'; this campaign has air_hPa, ambient_degC, b_deg, time_s, x_axis_degC, x_mm"
    )
    with pytest.raises(EffectError, match=re.escape(words)):
        columns("EXX:poly1@y_axis_degC", context)


def test_a_channel_with_empty_cells_is_refused_with_their_number(make: Callable[..., Context]) -> None:
    context = make({"X": [1.0, 2.0, 3.0]}, columns={"x_axis_degC": [20.0, np.nan, np.nan]})
    with pytest.raises(EffectError, match="channel 'x_axis_degC' is empty at 2 of 3 probings"):
        columns("EXX:poly1@x_axis_degC", context)


def test_conventions_positions_are_sign_times_reading() -> None:
    chain = parse_topology(HU40, {"B": 1})
    positions = positions_of(chain, {"X": np.array([3.0]), "B": np.array([0.5]), "Y": np.array([2.0])})
    # X is on the work side without a sign of its own: -1. Joints: X B C Z Y C1.
    assert positions.tolist() == [[-3.0, 0.5, 0.0, 0.0, 2.0, 0.0]]


def test_context_keeps_nominal_places_and_columns_in_the_units_of_the_file() -> None:
    context = context_of(small_campaign(), parse_topology(HU40))
    assert context.nominal[:3].tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]
    np.testing.assert_allclose(context.columns["b_deg"], np.arange(12.0), rtol=1e-14)
    assert context.columns["x_mm"].tolist() == list(range(12))


def test_a_campaign_without_probings_is_refused() -> None:
    campaign = small_campaign()
    empty = Campaign(
        campaign.name,
        campaign.method,
        campaign.machine,
        campaign.probe,
        campaign.artefact,
        campaign.runs,
        campaign.probings.rows(np.zeros(12, dtype=bool)),
    )
    with pytest.raises(DataError, match="campaign small has no probings"):
        context_of(empty, parse_topology(HU40))
