"""Errors of instruments: how readings change, by hand, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from monitor.effects import Context, InstrumentRows, ReadBy, parse_effect
from monitor.effects.catalogue import of_instruments
from monitor.effects.words import describe
from monitor.exceptions import EffectError
from monitor.records import Array

SETUPS = (
    ReadBy("laser-x", "laser", "displacement", 1),
    ReadBy("laser-y", "laser", "displacement", 1),
    ReadBy("bar-xy", "", "distance", 1),
    ReadBy("nest", "R-test", "vector", 3),
    ReadBy("level", "", "level", 1),
)


@pytest.fixture
def context(make: Callable[..., Context]) -> Context:
    """Two rows of each of five setups; the nest's second row is seen from a tool that turned by 30 degrees about Z."""
    turned = np.array([[np.cos(np.pi / 6), -0.5, 0.0], [0.5, np.cos(np.pi / 6), 0.0], [0.0, 0.0, 1.0]])
    ideal, towards = np.full((10, 3), np.nan), np.zeros((10, 3, 3))
    ideal[:4, 0], ideal[4:6, 0], ideal[8:, 0] = (0.0, 500.0, 0.0, 400.0), 0.0, 0.0
    ideal[6:8] = 0.0
    towards[6], towards[7] = np.eye(3), turned
    instruments = InstrumentRows(SETUPS, np.repeat(np.arange(5), 2), ideal, towards, 1000.0)
    air = [20.0, 21.0, 22.0, 24.0, 20.0, 20.0, 20.0, 20.0, 20.0, 23.0]
    made = make({"X": [0.0] * 10}, columns={"air_degC": air})
    return replace(made, instruments=instruments)


def shown(text: str, context: Context) -> Array:
    return parse_effect(text, context.chain).basis(context).shown  # type: ignore[union-attr]


def test_a_scale_acts_in_all_setups_of_an_instrument_or_in_one(context: Context) -> None:
    whole = shown("instrument:laser:scale", context)
    np.testing.assert_array_equal(whole[:4, 0, 0], [0.0, 500.0, 0.0, 400.0])
    assert not whole[4:].any()
    np.testing.assert_array_equal(
        shown("instrument:laser-y:cosine", context)[:4, 0, 0], [0.0, 0.0, 0.0, -400.0]
    )
    driven = shown("instrument:laser:scale@air_degC", context)
    # A channel counts from 20 °C (ISO 1).
    np.testing.assert_array_equal(driven[:4, 0, 0], [0.0, 500.0, 0.0, 1600.0])


def test_what_shifts_a_zero_counts_from_the_first_row_of_its_setup(context: Context) -> None:
    path = shown("instrument:laser-y:dead_path@air_degC", context)
    np.testing.assert_array_equal(path[:, 0, 0], [0, 0, 0, 2.0, 0, 0, 0, 0, 0, 0])
    tilt = shown("instrument:level:tilt@air_degC", context)
    # A radian is a metre at the lever.
    np.testing.assert_array_equal(tilt[8:, 0, 0], [0.0, 3000.0])


def test_a_longer_bar_reads_less(context: Context) -> None:
    length = shown("instrument:bar-xy:length", context)
    np.testing.assert_array_equal(length[:, 0, 0], [0, 0, 0, 0, -1.0, -1.0, 0, 0, 0, 0])
    assert not length[:, 1:].any()


def test_a_nest_drifts_in_three_directions(context: Context) -> None:
    effect = parse_effect("instrument:nest:drift@run_time", context.chain)
    assert effect.parameters(context) == tuple(f"instrument:nest:drift@run_time.{axis}" for axis in "xyz")
    drift = shown("instrument:nest:drift@run_time", context)
    np.testing.assert_allclose(drift[7], np.eye(3) / 9.0, rtol=1e-12)
    assert not drift[:7].any()


def test_a_plate_that_grows_does_so_for_all_its_setups(make: Callable[..., Context]) -> None:
    """Two setups of one plate, one after the other: the second finds it grown. What is stated shows less growth,
    from the middle of all that was read, (50, -25) mm, on."""
    setups = (ReadBy("plate-0", "plate", "point", 2), ReadBy("plate-90", "plate", "point", 2))
    ideal = np.array([[100.0, 0.0], [0.0, -50.0], [100.0, 0.0], [0.0, -50.0]])
    rows = InstrumentRows(setups, np.array([0, 0, 1, 1]), ideal, np.zeros((4, 2, 3)), 1000.0)
    context = replace(make({"X": [0.0] * 4}, run_time=[0.0, 0.2, 0.6, 1.0]), instruments=rows)
    grown = shown("instrument:plate:expansion@run_time", context)[:, :, 0]
    np.testing.assert_allclose(grown, [[0.0, 0.0], [10.0, 5.0], [-30.0, -15.0], [50.0, 25.0]], atol=1e-12)
    with pytest.raises(EffectError, match=r"name what it follows: instrument:plate:expansion@run_time"):
        shown("instrument:plate:expansion", context)


def test_lobes_follow_the_direction_in_the_frame_of_the_tool(context: Context) -> None:
    """Each number lies along X, Y, Z of the tool in the first row; in the second X lies at -30 and Y at 60 degrees."""
    lobes = shown("instrument:nest:lobing3", context)
    assert parse_effect("instrument:nest:lobing3", context.chain).parameters(context)[1].endswith(".sin")
    np.testing.assert_allclose(lobes[6], [[1.0, 0.0], [0.0, -1.0], [0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(lobes[7], [[0.0, -1.0], [-1.0, 0.0], [0.0, 0.0]], atol=1e-12)
    ovals = shown("instrument:nest:lobing2", context)
    np.testing.assert_allclose(ovals[7, 0], [0.5, -np.sqrt(0.75)], atol=1e-12)


def test_the_machine_itself_stays_as_it_is(context: Context) -> None:
    basis = parse_effect("instrument:bar-xy:length", context.chain).basis(context)
    errors, target = np.zeros((10, len(context.chain.joints), 2, 6)), np.zeros((10, 3))
    basis.apply(np.ones(basis.size), errors, target)
    assert not errors.any()
    assert not target.any()


def test_chosen_rows_keep_the_setups_that_have_none(context: Context) -> None:
    taken = context.taken(np.array([4, 5]))
    assert not shown("instrument:laser:scale", taken).any()
    np.testing.assert_array_equal(shown("instrument:bar-xy:length", taken)[:, 0, 0], [-1.0, -1.0])


def test_the_catalogue_asks_an_instrument_with_several_setups_once(context: Context) -> None:
    assert context.instruments is not None
    texts = of_instruments(context.instruments, ("run_time",))
    assert len(set(texts)) == len(texts)
    assert "instrument:laser:scale" in texts
    assert "instrument:laser-x:scale" not in texts
    assert "instrument:laser-x:cosine" in texts
    assert "instrument:laser-y:dead_path@run_time" in texts
    assert "instrument:bar-xy:length@run_time" in texts
    for text in texts:
        effect = parse_effect(text, context.chain)
        assert effect.text == text
        words = describe(effect)
        assert all((words.meaning, words.cause, words.remedy, words.described_in))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "instrument:laser:bend",
            "there is no effect 'instrument:laser:bend' of an instrument; after instrument:",
        ),
        ("instrument:level:tilt", "name what it follows: instrument:level:tilt@run_time"),
        ("instrument:laser-z:scale", "no setup or instrument 'laser-z'; did you mean"),
        ("instrument:bar-xy:scale", "'instrument:bar-xy:scale' is a change of displacement readings only"),
        ("instrument:nest:drift@oil_degC", "no channel 'oil_degC'"),
    ],
)
def test_refusals_say_what_would_be_right(context: Context, text: str, words: str) -> None:
    with pytest.raises(EffectError, match=re.escape(words)):
        parse_effect(text, context.chain).basis(context)


def test_a_method_of_one_instrument_has_none(make: Callable[..., Context]) -> None:
    with pytest.raises(EffectError, match="nothing says which instrument read what"):
        shown("instrument:laser:scale", make({"X": [0.0]}))
