"""Nominal numbers in place of readings are told by arithmetic, and what was measured is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import doubts, read_campaign
from monitor.readers.doubts.nominal_readings import nominal_readings
from monitor.records import Campaign
from monitor.workflow.explain.nominal_mistakes import pasted
from tests.simulator.ball_plate import Row, plate_rows, write_plate

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _pasted(rows: list[Row], first: int, last: int, turn: tuple[int, ...] = (0, 1, 2)) -> list[Row]:
    """Rows of which some have the stated places, shifted, for positions."""
    spoilt = [dict(row) for row in rows]
    for row in spoilt[first:last]:
        stated = [float(row[f"point_{axis}_mm"]) for axis in "xyz"]
        for axis, place, shift in zip("xyz", turn, (20.0, 10.0, 360.0), strict=True):
            row[f"{axis}_mm"] = f"{stated[place] + shift:.4f}"
    return spoilt


def _read(folder: Path) -> Campaign:
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return campaign


def _problem_of(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


@pytest.mark.parametrize(
    ("first", "last", "turn", "setup"),
    [(50, 100, (0, 1, 2), "place2"), (60, 80, (0, 1, 2), "place2"), (100, 150, (0, 2, 1), "place3")],
)
def test_positions_that_are_the_stated_places_are_told(
    tmp_path: Path, first: int, last: int, turn: tuple[int, ...], setup: str
) -> None:
    campaign = _read(write_plate(tmp_path / "plate", _pasted(plate_rows(1), first, last, turn)))
    (found,) = nominal_readings(campaign)
    assert found.setup == setup
    assert found.rows.tolist() == list(range(first, last))
    (sentence,) = (each for each in doubts(campaign) if "nominal values" in each)
    assert f"setup {setup}: in {last - first} rows of run 1 (sequences {first + 1} to {last})" in sentence


@pytest.mark.parametrize(("noise", "u_um"), [(5e-4, 0.5), (5e-5, 0.5), (5e-4, 10.0)])
def test_measured_positions_are_not(tmp_path: Path, noise: float, u_um: float) -> None:
    assert not nominal_readings(_read(write_plate(tmp_path / "plate", plate_rows(2, noise=noise), u_um=u_um)))


def test_explain_asks_for_the_readings_and_fits_the_others(tmp_path: Path) -> None:
    campaign = _read(write_plate(tmp_path / "plate", _pasted(plate_rows(3), 50, 100)))
    (mistake,) = pasted(campaign, _problem_of, fit(_problem_of(campaign)))
    assert mistake.what.startswith("the positions of X, Y and Z of setup place2 were no readings in 50 rows")
    assert mistake.rms_undone < mistake.rms_as_recorded


def test_a_laser_that_reads_what_the_axis_shows_is_told() -> None:
    campaign = _read(EXAMPLES / "laser")
    assert not nominal_readings(campaign)
    probings = campaign.probings
    of_x = probings.channels["setup"] == 1
    reading = np.where(of_x, 1e3 * probings.readings["X"], probings.channels["reading_um"])
    spoilt = replace(
        campaign, probings=replace(probings, channels={**probings.channels, "reading_um": reading})
    )
    (found,) = nominal_readings(spoilt)
    assert found.setup == campaign.artefact.setups[0].id
    assert found.why.startswith("is what x_mm shows")


def test_deviations_of_one_number_in_one_run_are_told() -> None:
    campaign = _read(EXAMPLES / "r-test")
    probings = campaign.probings
    count = len(probings)
    twice = replace(probings.rows(np.tile(np.arange(count), 2)), run=np.repeat([1, 2], count))
    assert not nominal_readings(replace(campaign, probings=twice))
    channels = {
        name: np.where(twice.run == 2, 0.0, values) if name.startswith("d") else values
        for name, values in twice.channels.items()
    }
    (found,) = nominal_readings(replace(campaign, probings=replace(twice, channels=channels)))
    assert (found.run, found.what) == (2, "dx_um, dy_um and dz_um")
