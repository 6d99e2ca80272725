"""The readings of one setup are wrong: another sign or exchanged columns are said in its name, and no effect.

Six instruments of one machine, simulated without a line of the package.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import find_reading_mistakes, find_setup_mistakes, fit
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator import four_instruments as shop
from tests.simulator.instrument_errors import week


def _of_machine(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


def _told(campaign: Campaign) -> list[str]:
    return [each.what for each in find_setup_mistakes(campaign, _of_machine, fit(_of_machine(campaign)))]


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    campaign = read_campaign(
        week(tmp_path_factory.mktemp("week") / "week", np.random.default_rng(31), shop.TRUTH)
    )
    assert isinstance(campaign, Campaign)
    return campaign


def _spoilt(campaign: Campaign, setup: str, change: dict[str, tuple[str, float]]) -> Campaign:
    """The campaign in whose rows of a setup columns have the values of another one, times a factor."""
    probings = campaign.probings
    rows = probings.target == setup
    channels = {name: np.array(values) for name, values in probings.channels.items()}
    for name, (source, factor) in change.items():
        channels[name][rows] = factor * probings.channels[source][rows]
    return replace(campaign, probings=replace(probings, channels=channels))


@pytest.mark.parametrize(
    ("setup", "change", "what"),
    [
        ("bar-yz", {"reading_um": ("reading_um", -1.0)}, "the sign of reading_um were the other way round"),
        ("r-test", {"dz_um": ("dz_um", -1.0)}, "the sign of dz_um were the other way round"),
        (
            "r-test",
            {name: (name, -1.0) for name in ("dx_um", "dy_um", "dz_um")},
            "the signs of dx_um, dy_um, dz_um were the other way round",
        ),
        ("bar-zx", {"reading_um": ("reading_um", 1e-3)}, "reading_um was in mm"),
        ("r-test", {"dx_um": ("dy_um", 1.0), "dy_um": ("dx_um", 1.0)}, "the columns dx_um and dy_um were exchanged"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_one_setup_is_said_in_its_name(
    right: Campaign, setup: str, change: dict[str, tuple[str, float]], what: str
) -> None:
    assert f"{what} in setup {setup}" in _told(_spoilt(right, setup, change))


def test_right_setups_and_errors_of_an_instrument_are_no_mistake(right: Campaign, tmp_path: Path) -> None:
    assert _told(right) == []
    for error, size in (
        ("bar-xy:length", 10.0),
        ("bar-xy:length", 37.5),
        ("laser-Y:dead_path@air_degC", 15.0),
    ):
        folder = week(
            tmp_path / f"{error[:3]}{size}",
            np.random.default_rng(32),
            shop.TRUTH,
            f"instrument:{error}",
            size,
        )
        campaign = read_campaign(folder)
        assert isinstance(campaign, Campaign)
        assert _told(campaign) == []
        # Exchanged for one of another instrument, a column leaves readings that nothing contradicts.
        assert find_reading_mistakes(campaign, _of_machine, fit(_of_machine(campaign))) == ()
