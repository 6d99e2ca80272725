"""Setups whose zero drifts: stated, it is an unknown with its uncertainty; not stated, the residuals say it.

The references are regressions by numpy on columns that are written here; no code of the package makes them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import CampaignError, DataError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.method import Instruments, SetupDrift
from monitor.readers import read_campaign
from monitor.readers.writer import write_campaign
from monitor.records import Campaign
from tests.simulator import four_instruments as shop

#: What the laser and the R-test read too much from their first row to their last, mm; of a reading, mm.
DRIFT, READING = 3e-3, 3e-4
STATED = "drift_standard_uncertainty_um = 2.0\n"


def _laser(folder: Path, *, stated: bool, drift: float = DRIFT, one_way: bool = False) -> Campaign:
    """A laser along X, there and back, whose zero drifts; the beam is known."""
    rng = np.random.default_rng(20)
    chain = shop.machine(0.0)
    rows = []
    stops = np.linspace(0.0, 500.0, 11)
    places = stops if one_way else np.concatenate([stops, stops[::-1]])
    for number, place in enumerate(places):
        readings = shop.pose(X=float(place))
        value = float(shop.seen(chain, readings)[0]) + drift * number / (len(places) - 1)
        rows.append({"setup": "laser", **readings, "reading_um": 1e3 * (value + rng.normal(0.0, READING))})
    text = (
        '\n[[setups]]\nid = "laser"\nreading = "displacement"\ninstrument = "laser interferometer"\n'
        f'standard_uncertainty_um = {1e3 * READING:g}\ndirection = "X"\nknown = ["direction"]\n'
        f"tool_point_mm = {shop.TOOL.tolist()}\n" + (STATED if stated else "")
    )
    chain.write(folder, text, rows)
    return read_campaign(folder)


def _regression(campaign: Campaign, prior: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Gain, zero and drift of the laser's rows by least squares, and their covariance; ``prior`` mm of the drift."""
    x = campaign.probings.readings["X"]
    deviation = 1e-3 * campaign.probings.channels["reading_um"] - x
    columns = np.column_stack([x, np.ones(len(x)), np.arange(len(x)) / (len(x) - 1)]) / READING
    right = deviation / READING
    if prior is not None:
        columns, right = np.vstack([columns, [0.0, 0.0, 1.0 / prior]]), np.append(right, 0.0)
    covariance = np.linalg.inv(columns.T @ columns)
    return covariance @ columns.T @ right, covariance


def _drifts(campaign: Campaign) -> tuple[SetupDrift, ...]:
    method = campaign_method(campaign)
    assert isinstance(method.instruments, Instruments)
    problem = method.problem_of(campaign)
    return method.instruments.drifts(problem, solve_problem(problem))


def _gain(campaign: Campaign) -> tuple[float, float]:
    result = campaign_method(campaign).identify(campaign)
    index = result.parameters.index("EXX")
    run = result.runs[0]
    return float(run.estimate[index]), float(np.sqrt(run.covariance[index, index]))


@pytest.mark.parametrize("one_way", [False, True])
def test_a_stated_drift_is_an_unknown_known_to_its_uncertainty(tmp_path: Path, one_way: bool) -> None:
    """There and back the rows estimate it; one way it does what a gain does, and stands in u of the gain."""
    campaign = _laser(tmp_path / "laser", stated=True, one_way=one_way)
    values, covariance = _regression(campaign, 2e-3)
    gain, u = _gain(campaign)
    # Products of errors that the regression leaves out: 40 urad and 10 um/m on half a metre, some picometres.
    assert gain == pytest.approx(values[0], abs=2e-9)
    assert u == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-4)
    plain = _gain(_laser(tmp_path / "plain", stated=False, one_way=one_way))[1]
    assert u == pytest.approx(plain, rel=0.01) if not one_way else u > 4.0 * plain


def test_what_runs_with_the_time_is_the_drift_of_a_regression(tmp_path: Path) -> None:
    campaign = _laser(tmp_path / "laser", stated=False)
    values, covariance = _regression(campaign, None)
    (drift,) = _drifts(campaign)
    assert (drift.run, drift.setup, drift.number, drift.angular) == (1, "laser", "reading", False)
    assert drift.size == pytest.approx(values[2], rel=1e-3)
    assert drift.size == pytest.approx(DRIFT, abs=4.0 * float(np.sqrt(covariance[2, 2])))
    # The readings scatter by chance 1.1 times what they state: then u is that much larger.
    assert drift.u == pytest.approx(np.sqrt(covariance[2, 2]), rel=0.3)
    assert drift.u > 0.999 * np.sqrt(covariance[2, 2])
    assert drift.p < 1e-6


def test_one_way_shows_no_drift_and_none_is_claimed(tmp_path: Path) -> None:
    assert _drifts(_laser(tmp_path / "laser", stated=False, one_way=True)) == ()


def test_a_setup_that_states_its_drift_is_not_judged(tmp_path: Path) -> None:
    assert _drifts(_laser(tmp_path / "laser", stated=True)) == ()


def test_the_drift_is_read_and_written_again(tmp_path: Path) -> None:
    campaign = _laser(tmp_path / "laser", stated=True)
    (setup,) = campaign.artefact.setups
    assert setup.drift_uncertainty == pytest.approx(2e-3)
    named = replace(
        campaign, artefact=replace(campaign.artefact, setups=(replace(setup, certificate="K 17"),))
    )
    write_campaign(named, tmp_path / "again")
    assert read_campaign(tmp_path / "again").artefact.setups == named.artefact.setups


def test_a_drift_in_the_wrong_unit_is_refused_by_line(tmp_path: Path) -> None:
    _laser(tmp_path / "laser", stated=True)
    path = tmp_path / "laser" / "campaign.toml"
    path.write_text(
        path.read_text(encoding="utf-8").replace("tainty_um = 2.0", "tainty_urad = 2.0"), encoding="utf-8"
    )
    with pytest.raises(CampaignError, match="the reading is a length: write drift_standard_uncertainty_um"):
        read_campaign(tmp_path / "laser")


def test_a_drift_of_rows_without_times_is_refused(tmp_path: Path) -> None:
    campaign = _laser(tmp_path / "laser", stated=True)
    probings = replace(campaign.probings, time=np.zeros(len(campaign.probings)))
    with pytest.raises(DataError, match="all its rows have the same time_s"):
        campaign_method(campaign).problem_of(replace(campaign, probings=probings))
