"""A work point that a file states wrongly, or nowhere, is an unknown: it moves no number of the machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.records import Campaign, Setup

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
