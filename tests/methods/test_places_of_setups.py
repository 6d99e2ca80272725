"""A work point that a file states wrongly, or nowhere, is an unknown: it moves no number of the machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.readings.distance import DistanceReading
from monitor.readers import read_campaign
from monitor.records import Campaign, Setup
from tests.simulator import horizontal_centre as centre

EXAMPLES = Path(__file__).parents[2] / "examples"


def with_setups(campaign: Campaign, change: Callable[[Setup], Setup]) -> Campaign:
    """The campaign with its setups changed."""
    setups = tuple(map(change, campaign.artefact.setups))
    return replace(campaign, artefact=replace(campaign.artefact, setups=setups))


def moved(kind: str, by: tuple[float, float, float]) -> Callable[[Setup], Setup]:
    """State the work points of a kind of reading elsewhere by so many mm."""

    def change(setup: Setup) -> Setup:
        if setup.reading != kind:
            return setup
        return replace(setup, work_point=tuple(np.add(setup.work_point, by).tolist()))

    return change


def numbers(campaign: Campaign) -> tuple[np.ndarray, np.ndarray]:
    """The estimates of the one run and their standard uncertainties, NaN where there is no number."""
    (run,) = campaign_method(campaign).identify(campaign).runs
    return run.estimate, np.sqrt(np.diag(run.covariance))


# At 671473cd: 24, 1.3, 0.8, no convergence, 1.7, 2.4 and 0.8 standard uncertainties.
@pytest.mark.parametrize(
    ("example", "kind", "by"),
    [
        ("r-test", "vector", (-80.0, 0.0, -60.0)),
        ("r-test", "vector", (9.0, 0.0, 0.0)),
        ("ball-bar", "distance", (0.0, 0.0, 1.9)),
        ("ball-bar", "distance", (9.0, 0.0, 0.0)),
        ("four-instruments", "distance", (0.0, 1.9, 0.0)),
        ("four-instruments", "distance", (0.0, 0.0, 9.0)),
        ("four-instruments", "distance", (15.0, 15.0, 15.0)),
    ],
)
def test_a_work_point_stated_wrongly_moves_no_number(
    example: str, kind: str, by: tuple[float, float, float]
) -> None:
    campaign = read_campaign(EXAMPLES / example)
    right, u = numbers(campaign)
    wrong, _ = numbers(with_setups(campaign, moved(kind, by)))
    np.testing.assert_array_equal(np.isnan(wrong), np.isnan(right))
    assert np.nanmax(np.abs(wrong - right) / u) < 0.02


def test_a_length_that_is_typed_wrong_is_not_taken_up_by_a_centre_off_the_plane() -> None:
    campaign = read_campaign(EXAMPLES / "four-instruments")

    def change(setup: Setup) -> Setup:
        if setup.reading != "distance":
            return setup
        assert setup.length is not None
        return replace(setup, length=setup.length - 1.0)

    wrong = with_setups(campaign, change)
    problem = campaign_method(wrong).problem_of(wrong)
    start = problem.own_start[0, problem.own_columns[3][:3]]
    stated = next(setup.work_point for setup in wrong.artefact.setups if setup.id == "bar-xy")
    np.testing.assert_allclose(start, stated, atol=0.1)
    # A millimetre of a bar known to 0.3 um contradicts the laser, and is seen.
    assert solve_problem(problem).iterations < 50
    (run,) = campaign_method(wrong).identify(wrong).runs
    assert run.chi_square > 1e3 * run.degrees_of_freedom


def horizontal(folder: Path, change: Callable[[Setup], Setup]) -> Campaign:
    """Laser, ball bar and R-test on a horizontal centre, its setups stated otherwise."""
    campaign = read_campaign(centre.campaign(folder / "shop", np.random.default_rng(7)))
    assert isinstance(campaign, Campaign)
    return with_setups(campaign, change)


def test_a_centre_that_lies_off_the_plane_of_a_swing_by_rounding_moves_no_number(tmp_path: Path) -> None:
    """From a centre that was stated 15 mm across the plane 1e-14 mm were left, which the fit took for readings: on a
    machine of another simulator 64 u of EA0Y."""
    campaign = horizontal(tmp_path, lambda setup: setup)
    problem = campaign_method(campaign).problem_of(campaign)
    assert isinstance(problem, InstrumentProblem)
    (index,) = (number for number, part in enumerate(problem.parts) if part.id == "bar-yz")
    parts, reading = list(problem.parts), problem.parts[index].reading
    assert isinstance(reading, DistanceReading)
    assert reading.centre == tuple(centre.BAR_AT)
    beside = (float(np.nextafter(reading.centre[0], 41.0)), *reading.centre[1:])
    # The projector on what the bar shows, as a plane that was found by 1e-14 leaves it.
    guess = parts[index].rows.guess.copy()
    guess[:, 0] += np.finfo(np.float64).eps
    rows = replace(parts[index].rows, guess=guess)
    parts[index] = replace(parts[index], rows=rows, reading=replace(reading, centre=beside))
    right, off = solve_problem(problem), solve_problem(replace(problem, parts=tuple(parts)))
    u = np.sqrt(np.diag(right.local_covariance[0]))[: len(problem.base_names)]
    free = right.local_free[0, : len(u)]
    moved_by = (off.local - right.local)[0, : len(u)] / u
    assert np.abs(moved_by[free]).max() < 1e-3
    assert off.iterations == right.iterations


def test_a_tool_point_that_the_readings_contradict_is_named_with_the_one_they_fit(tmp_path: Path) -> None:
    """A head that turns shows the length of its tool; nothing else of the machine does the same."""

    def longer(setup: Setup) -> Setup:
        return replace(setup, tool_point=(0.0, 0.0, -151.0)) if setup.reading == "vector" else setup

    # The end of the refusal where the fit does not settle.
    said = campaign_method(campaign := horizontal(tmp_path, longer)).problem_of(campaign).unsettled
    assert "the readings of setup r-test-A fit tool_point_mm = [0.00, 0.00, -150.00], with 0.0" in said
    right = horizontal(tmp_path / "right", lambda setup: setup)
    assert campaign_method(right).problem_of(right).unsettled == ""


def test_a_bar_whose_plane_is_a_hundredth_off_is_where_it_is_stated(tmp_path: Path) -> None:
    """At b04ae590 `bar-yz` came out centimetres across its plane, and the certificate was refused (`work-point`)."""
    rng = np.random.default_rng(14600)
    campaign = read_campaign(centre.campaign(tmp_path / "shop", rng, centre.truth_of(rng)))
    assert isinstance(campaign, Campaign)

    def change(setup: Setup) -> Setup:
        if setup.reading != "distance":
            return setup
        return replace(setup, tool_point=tuple(np.subtract(setup.tool_point, (0.01, 0.0, 0.0)).tolist()))

    wrong = with_setups(campaign, change)
    problem = campaign_method(wrong).problem_of(wrong)
    assert wrong.artefact.setups != campaign.artefact.setups
    assert problem.displaced(solve_problem(problem).local[0]) == ()
