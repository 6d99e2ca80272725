"""Method tracker: the exact robot of tests/simulator, identified from outside; every way in which it may be given."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.model import chain_of
from monitor.methods.tracker.method import METHOD as tracker
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.refused import refusal_sentence

Tracks = Callable[..., tuple[Any, Campaign]]


@pytest.fixture(scope="module")
def robots(simulator: ModuleType) -> ModuleType:
    """The simulator of tracked robots."""
    return importlib.import_module(f"{simulator.__name__}.robot_campaign")


@pytest.fixture
def tracked(robots: ModuleType, tmp_path: Path) -> Tracks:
    """A simulated run, and the campaign that the product reads of it."""

    def make(seed: int, hidden: Any = None, **options: Any) -> tuple[Any, Campaign]:
        made = robots.track(np.random.default_rng(seed), hidden, **options)
        folder = robots.write_tracked(tmp_path / f"robot-{seed}", made, options.get("noise_um", 20.0))
        return made, read_campaign(folder)

    return make


def predicted(campaign: Campaign, of: Campaign) -> np.ndarray:
    """Where the model identified from one campaign puts the reflectors of another run of the same robot, mm (n, 3)."""
    found = tracker.problem_of(of)
    solution = solve_problem(found)
    count = len(found.base_names)
    other = tracker.problem_of(campaign)
    # Frame and reflectors are this run's own: only the errors of the joints are taken over.
    base = np.zeros((1, len(other.local_names)))
    base[:, :count] = solution.local[:, :count]
    start = other.start
    for _ in range(20):
        start[:, :count] = base[:, :count]
        at = other.linearise(start, other.common_start)
        own = at.local[0][:, count:]
        step = np.linalg.lstsq(own / np.linalg.norm(own, axis=0), -at.residual[0], rcond=1e-9)[0]
        start[:, count:] += step / np.linalg.norm(own, axis=0)
    return other.vectors(start, other.common_start)


@pytest.mark.parametrize("seed", range(4))
def test_residuals_are_the_noise_and_nothing_else(tracked: Tracks, seed: int) -> None:
    """Four robots, four frames metres away in any orientation, errors of 0.3 degrees and 0.5 mm."""
    _, campaign = tracked(seed, poses=200, fixed_every=20 * (seed % 2))
    found = tracker.identify(campaign)
    run = found.runs[0]
    # Chi-square of some 1800 readings: within five standard deviations of its expectation.
    assert abs(run.chi_square / run.degrees_of_freedom - 1.0) < 5.0 * np.sqrt(2.0 / run.degrees_of_freedom)
    assert run.refused == ()
    assert len(found.parameters) == 18


def test_a_model_of_one_run_predicts_another_run_of_the_same_robot(
    tracked: Tracks, robots: ModuleType
) -> None:
    location = robots.errors_of_robot(np.random.default_rng(7))
    _, one = tracked(71, poses=300, location=location)
    _, other = tracked(72, poses=150, location=location)
    left = predicted(other, one)
    # 20 µm of noise, and what the first run's estimates add.
    assert np.sqrt(np.mean(left**2)) < 0.022
    # Without the model the robot is off by more than a millimetre.
    none = tracker.problem_of(other)
    assert np.sqrt(np.mean(none.vectors(none.start, none.common_start) ** 2)) > 0.3


def test_zeros_off_by_a_degree_and_more_converge(tracked: Tracks, robots: ModuleType) -> None:
    location = robots.errors_of_robot(np.random.default_rng(8), scale=4.0)
    assert max(abs(six[3:]).max() for six in location.values()) > np.deg2rad(1.0)
    _, campaign = tracked(8, poses=150, location=location)
    run = tracker.identify(campaign).runs[0]
    assert run.rms < 0.022


def test_one_reflector_is_enough_for_the_robot(tracked: Tracks) -> None:
    _, campaign = tracked(9, poses=200, reflectors=("R2",))
    found = tracker.identify(campaign)
    assert found.runs[0].rms < 0.022
    assert found.runs[0].refused == ()


def test_intervals_hold_the_zero_that_was_set(tracked: Tracks, robots: ModuleType) -> None:
    """Of a robot without errors every parameter is zero: the standardised estimates are normal, 90 of them."""
    standardised = []
    for seed in range(5):
        _, campaign = tracked(100 + seed, poses=120, location={})
        run = tracker.identify(campaign).runs[0]
        standardised += (run.estimate / np.sqrt(np.diag(run.covariance))).tolist()
    squares = np.sum(np.square(standardised))
    # Chi-square with 90 degrees of freedom, correlated within a run: 0.0001 % to either side were they not.
    assert 40.0 < squares < 170.0


@pytest.mark.slow
def test_an_axis_turned_the_wrong_way_is_refused_in_words(tracked: Tracks) -> None:
    _, campaign = tracked(10, poses=150)
    chain = tuple(
        dataclasses.replace(axis, sign=-1) if axis.name == "J2" else axis for axis in campaign.machine.chain
    )
    wrong = dataclasses.replace(campaign, machine=dataclasses.replace(campaign.machine, chain=chain))
    with pytest.raises(DataError, match="the readings contradict the machine file"):
        tracker.identify(wrong)


def test_a_joint_that_stands_still_is_named(tracked: Tracks, robots: ModuleType) -> None:
    made, campaign = tracked(11, poses=150, ranges={"J4": (20.0, 20.0)})
    assert np.ptp(made.readings[:, 3]) == 0.0
    refused = tracker.identify(campaign).runs[0].refused
    assert refused
    assert all("J4 stood still throughout; move it too" in refusal_sentence(one) for one in refused)


def test_too_few_poses_are_refused(tracked: Tracks) -> None:
    _, campaign = tracked(12, poses=5, reflectors=("R1",))
    with pytest.raises(DataError, match="the 15 readings of run 1 determine as many unknowns"):
        tracker.identify(campaign)


def test_a_chain_without_axes_on_the_tool_side_is_refused(tracked: Tracks) -> None:
    _, campaign = tracked(13, poses=5)
    chain = tuple(dataclasses.replace(axis, branch="work") for axis in campaign.machine.chain)
    with pytest.raises(
        DataError, match="has no axis on the tool's side; a tracker beside the machine sees none of it"
    ):
        tracker.problem_of(
            dataclasses.replace(campaign, machine=dataclasses.replace(campaign.machine, chain=chain))
        )


def test_the_analytic_jacobian_agrees_with_differences(tracked: Tracks) -> None:
    _, campaign = tracked(14, poses=12, fixed_every=4)
    problem = tracker.problem_of(
        campaign, dataclasses.replace(tracker.own_model, added=("tracker:turn@run_time",))
    )
    rng = np.random.default_rng(1)
    local = problem.start + rng.normal(0.0, 1e-3, problem.start.shape)
    common = rng.normal(0.0, 1e-4, problem.common_start.shape)
    at = problem.linearise(local, common)
    step = 1e-6
    for place in range(local.shape[1]):
        high, low = local.copy(), local.copy()
        high[:, place] += step
        low[:, place] -= step
        slope = (problem.linearise(high, common).residual - problem.linearise(low, common).residual) / (
            2.0 * step
        )
        np.testing.assert_allclose(
            at.local[..., place], slope, rtol=1e-5, atol=1e-3 * np.abs(slope).max() + 1e-6
        )
    for place in range(len(common)):
        high, low = common.copy(), common.copy()
        high[place] += step
        low[place] -= step
        slope = (problem.linearise(local, high).residual - problem.linearise(local, low).residual) / (
            2.0 * step
        )
        np.testing.assert_allclose(at.common[..., place], slope, rtol=1e-5, atol=1e-3 * np.abs(slope).max())


def test_it_is_a_method_with_the_chain_of_the_file(tracked: Tracks) -> None:
    _, campaign = tracked(15, poses=10)
    assert campaign_method(campaign) is tracker
    assert [joint.name for joint in chain_of(campaign.machine).tool] == ["J1", "J2", "J3", "J4", "J5", "J6"]
