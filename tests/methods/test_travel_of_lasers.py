"""Lasers that read something else than the travel: `identify` refuses, and says which setup and what it reads."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator import four_instruments as shop


def lasers(folder: Path, change: Callable[[dict], None], setups: str = "laser-Z") -> Campaign:
    """Three axes by a laser, of which some setups were written otherwise."""
    chain = shop.machine(0.0)
    text, rows = shop.laser(chain, np.random.default_rng(3), 1)
    for row in rows:
        if str(row["setup"]).startswith(setups):
            change(row)
    campaign = read_campaign(chain.write(folder / "shop", text, rows))
    assert isinstance(campaign, Campaign)
    return campaign


def scaled(factor: float) -> Callable[[dict], None]:
    return lambda row: row.update(reading_um=factor * row["reading_um"])


def deviations(row: dict) -> None:
    """As many programs write it: the error of the position."""
    row["reading_um"] -= 1e3 * row["Z"]


def of_another_axis(row: dict) -> None:
    row["X"], row["Z"] = row["Z"], row["X"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (scaled(-1.0), "the readings of setup laser-Z are its travel with the other sign"),
        (scaled(1e-3), "the readings of setup laser-Z are its travel in mm: the column is in µm"),
        (scaled(1.0 / 25.4), "the readings of setup laser-Z are its travel in thousandths of an inch"),
        (scaled(0.5), "the readings of setup laser-Z are 0.5 times its travel along `direction`"),
        (deviations, "the readings of setup laser-Z are no travel: the whole travel is read, not its error"),
        (
            of_another_axis,
            "the readings of setup laser-Z are a travel of 400 mm where its tool point moves 0 mm",
        ),
    ],
)
def test_a_laser_that_reads_no_travel_is_named_with_what_it_reads(
    tmp_path: Path, change: Callable[[dict], None], said: str
) -> None:
    campaign = lasers(tmp_path, change)
    with pytest.raises(DataError, match=said) as refused:
        campaign_method(campaign).identify(campaign)
    assert "laser-X" not in str(refused.value)


def test_right_lasers_are_not_named(tmp_path: Path) -> None:
    campaign = lasers(tmp_path, scaled(1.0))
    assert campaign_method(campaign).problem_of(campaign).unsettled == ""
