"""A bar that is warmer than the air: its own recorded temperature is what its length is corrected by.

The bar of the independent simulator is made as long as one of steel is at 27 °C; the air has 21.5 °C.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from monitor.methods.bar_temperature import BarTemperature, bar_temperature
from monitor.methods.samba.method import METHOD as samba
from monitor.readers.doubts.doubts import implausible_temperatures
from monitor.records import Array, Campaign

STEEL, WARM, AIR = 11.5e-6, 27.0, 21.5
Simulated = Callable[..., tuple[dict[str, Any], Campaign]]


@pytest.fixture
def warm(simulated: Simulated) -> Campaign:
    """One run without noise, whose file states the length of the bar at 20 °C and what the air had."""
    growth = 304.98923 * STEEL * (WARM - 20.0)
    campaign = simulated(1, noise_um=0.0, bar_error_mm=growth, decimals=None)[1]
    bar = campaign.artefact.scale_bar
    assert bar is not None
    steel = replace(bar, expansion_coefficient=STEEL, reference_temperature=20.0)
    artefact = replace(campaign.artefact, scale_bar=steel)
    return recorded(replace(campaign, artefact=artefact), ambient_degC=AIR)


def recorded(campaign: Campaign, **conditions: float) -> Campaign:
    """With these conditions of every run and no channel."""
    runs = tuple(replace(run, conditions=conditions) for run in campaign.runs)
    return replace(campaign, runs=runs, probings=replace(campaign.probings, channels={}))


def by_touch(campaign: Campaign, values: Array, name: str = "bar_degC") -> Campaign:
    return replace(campaign, probings=replace(campaign.probings, channels={name: values}))


def gain_errors(campaign: Campaign, truth: Array) -> Array:
    """How far EXX, EYY and EZZ are from what was simulated, in µm/m."""
    return 1e6 * (samba.identify(campaign).runs[0].estimate - truth)[-3:]


def test_a_bar_known_to_be_at_27_degC_gives_the_gains_that_were_simulated(
    warm: Campaign, truth: Array
) -> None:
    """By the air alone every gain is wrong by 5.5 K of steel, 63 µm/m: the file has nothing better."""
    rows = np.full(len(warm.probings), WARM)
    assert gain_errors(warm, truth) == pytest.approx([-STEEL * 5.5e6] * 3, rel=1e-3)
    for campaign in (
        by_touch(warm, rows),
        by_touch(warm, rows, "scale_bar_1_degC"),
        recorded(warm, ambient_degC=AIR, bar_degC=WARM),
        recorded(warm, ambient_degC=AIR, artefact_degC=WARM),
        recorded(warm, bar_degC=WARM),
    ):
        assert gain_errors(campaign, truth) == pytest.approx([0.0] * 3, abs=1e-3)


def test_only_the_touches_of_the_bars_balls_say_how_warm_it_was(warm: Campaign, truth: Array) -> None:
    of_bar = np.isin(warm.probings.target, ("S1", "S2"))
    cooling = np.where(of_bar, WARM, 24.0)
    assert gain_errors(by_touch(warm, cooling), truth) == pytest.approx([0.0] * 3, abs=1e-3)
    # Of a channel with gaps what is there counts; one without values leaves the word to the air.
    gaps = np.where(of_bar, np.nan, WARM)
    assert bar_temperature(by_touch(warm, gaps), warm.runs[0]) == BarTemperature(WARM, ("bar_degC",))
    empty = by_touch(warm, np.full(len(warm.probings), np.nan))
    assert bar_temperature(empty, warm.runs[0]) == BarTemperature(AIR, ("ambient_degC",))


def test_what_only_sounds_like_a_bar_is_none(warm: Campaign) -> None:
    other = recorded(warm, drawbar_degC=40.0, spindle_degC=35.0, bar_percent=50.0)
    assert bar_temperature(other, other.runs[0]) is None
    two = recorded(warm, bar_2_degC=26.0, bar_1_degC=25.0, ambient_degC=AIR)
    assert bar_temperature(two, two.runs[0]) == BarTemperature(25.5, ("bar_1_degC", "bar_2_degC"))


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("bar_degC", True),
        ("scalebar2_degC", True),
        ("air_degC", True),
        ("drawbar_degC", False),
        ("repair_degC", False),
    ],
)
def test_import_and_the_bars_length_take_the_same_columns_for_temperatures_of_the_bar(
    warm: Campaign, column: str, said: bool
) -> None:
    """`import` once asked a drawbar of 80 °C, by the letters of its name, whether it was a bar."""
    one = recorded(warm, **{column: 80.0})
    assert (bar_temperature(one, one.runs[0]) is not None) is said
    assert (column in implausible_temperatures(one, one.runs[0].run)) is said
