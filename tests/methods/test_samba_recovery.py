"""SAMBA finds the truth of the independent simulator again, within the covariance that it states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy import stats

from monitor.machine import parse_topology
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.samba.method import METHOD as samba, bar_length
from monitor.records import Array, Campaign

Distance = Callable[[Array, Array], float]


def test_truth_without_noise_comes_back_exactly(simulated: Callable[..., Any], truth: Array) -> None:
    told, campaign = simulated(1, noise_um=0.0, bar_error_mm=0.0, decimals=None)
    run = samba.identify(campaign).runs[0]
    # Touches are exact to 1e-10 mm; over levers of 100 mm that is 1e-12 rad.
    np.testing.assert_allclose(run.estimate, truth, rtol=0, atol=1e-9)
    assert run.rms < 1e-9
    for ball, place in told["balls"].items():
        found = [run.unknowns[f"ball {ball} {axis}"] for axis in "xyz"]
        np.testing.assert_allclose(found, place, rtol=0, atol=1e-7)
    np.testing.assert_allclose(
        [run.unknowns[f"tip {axis}"] for axis in "xyz"], told["tip_mm"], rtol=0, atol=1e-7
    )


@pytest.mark.slow
def test_recovery_is_chi_square_over_200_seeds(
    simulated: Callable[..., Any], truth: Array, distance: Distance, seeds: Callable[[int, int], range]
) -> None:
    distances, costs, estimates, covariances = [], [], [], []
    freedom = 0
    numbers = seeds(200, 80)
    n = len(numbers)
    for seed in numbers:
        run = samba.identify(simulated(seed)[1]).runs[0]
        distances.append(distance(run.estimate - truth, run.covariance))
        costs.append(run.chi_square)
        estimates.append(run.estimate)
        covariances.append(run.covariance)
        freedom = run.degrees_of_freedom
    assert freedom == 3 * 62 + 1 - 34
    assert stats.kstest(distances, stats.chi2(13).cdf).pvalue > 1e-3
    assert stats.kstest(costs, stats.chi2(freedom).cdf).pvalue > 1e-3
    # The mean of n chi-squares has a standard deviation of sqrt(2 freedom / n): four of them on either side.
    assert np.mean(distances) == pytest.approx(13, abs=4 * np.sqrt(2 * 13 / n))
    assert np.mean(costs) == pytest.approx(freedom, abs=4 * np.sqrt(2 * freedom / n))
    # The scatter over the seeds is the covariance: variances of n values are good to sqrt(2 / n), of 200 to 10 %.
    scatter, stated = np.cov(np.array(estimates).T), np.mean(covariances, axis=0)
    np.testing.assert_allclose(np.diag(scatter) / np.diag(stated), 1.0, atol=4 * np.sqrt(2 / n))
    whitened = np.linalg.solve(np.linalg.cholesky(stated), np.array(estimates).T - truth[:, None])
    # Marchenko and Pastur: eigenvalues of 13 white variables seen n times lie in (1 +- sqrt(13/n))^2, but for a fringe.
    spread = np.linalg.eigvalsh(np.cov(whitened))
    assert spread.min() > 0.72 * (1 - np.sqrt(13 / n)) ** 2
    assert spread.max() < 1.2 * (1 + np.sqrt(13 / n)) ** 2


def test_runs_of_a_campaign_are_identified_one_by_one(simulated: Callable[..., Any]) -> None:
    campaign = simulated(3, days=1, runs=2)[1]
    both = samba.identify(campaign)
    for place, number in enumerate((1, 2)):
        rows = campaign.probings.run == number
        alone = samba.identify(replace(campaign, probings=campaign.probings.rows(rows))).runs
        assert [run.run for run in alone] == [number]
        np.testing.assert_allclose(alone[0].estimate, both.runs[place].estimate, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(alone[0].covariance, both.runs[place].covariance, rtol=1e-6, atol=1e-18)
        assert alone[0].chi_square == pytest.approx(both.runs[place].chi_square, rel=1e-8)


def test_runs_may_differ_in_their_plans(
    simulated: Callable[..., Any], truth: Array, distance: Distance
) -> None:
    campaign = simulated(4, days=1, runs=3)[1]
    probings = campaign.probings
    # Run 2 leaves out ball 4, run 3 stops after 50 probings: without the spindle's indexations.
    kept = ~((probings.run == 2) & (probings.target == "4")) & ~(
        (probings.run == 3) & (probings.sequence > 50)
    )
    found = samba.identify(replace(campaign, probings=probings.rows(kept)))
    whole = samba.identify(campaign)
    first, second, third = found.runs
    np.testing.assert_allclose(first.estimate, whole.runs[0].estimate, rtol=1e-6, atol=1e-12)
    assert second.refused == ()
    assert second.residuals.shape == (47, 3)
    assert second.degrees_of_freedom == 3 * 47 + 1 - 31
    assert distance(second.estimate - truth, second.covariance) < stats.chi2(13).ppf(1 - 1e-4)
    assert (np.diag(second.covariance) > np.diag(whole.runs[1].covariance)).all()
    assert [refusal.parameters for refusal in third.refused] == [("EX0C1",), ("EY0C1",)]
    free = np.isfinite(third.estimate)
    assert free.sum() == 11
    error = (third.estimate - truth)[free]
    assert distance(error, third.covariance[np.ix_(free, free)]) < stats.chi2(11).ppf(1 - 1e-4)


def test_residuals_stand_in_file_order(simulated: Callable[..., Any]) -> None:
    campaign = simulated(5, days=1, runs=2, bad_points=[(2, 10, (60.0, 0.0, 0.0))])[1]
    found = samba.identify(campaign)
    assert int(np.abs(found.runs[1].residuals).max(axis=1).argmax()) == 9
    np.testing.assert_allclose(
        [run.rms for run in found.runs],
        [np.sqrt(np.mean(run.residuals**2)) for run in found.runs],
        rtol=1e-12,
    )


@pytest.mark.parametrize(
    ("scale", "spread_mm"), [(0.0, 0.3), (50.0, 8.0), (-100.0, 5.0)], ids=["no errors", "1 mrad", "2 mrad"]
)
def test_weird_but_valid_machines(
    simulated: Callable[..., Any], truth: Array, scale: float, spread_mm: float, distance: Distance
) -> None:
    for seed in range(3):
        run = samba.identify(simulated(seed, scale=scale, spread_mm=spread_mm)[1]).runs[0]
        assert run.refused == ()
        assert distance(run.estimate - scale * truth, run.covariance) < stats.chi2(13).ppf(1 - 1e-4)
        assert run.chi_square < stats.chi2(run.degrees_of_freedom).ppf(1 - 1e-4)


def test_large_errors_hide_nothing_and_uncover_nothing(
    simulator: ModuleType, simulated: Callable[..., Any]
) -> None:
    campaign = simulated(6, scale=60.0, spread_mm=6.0, plan=simulator.cold_cold_plan())[1]
    run = samba.identify(campaign).runs[0]
    assert [refusal.parameters for refusal in run.refused] == [("EX0C1",), ("EY0C1",)]


def test_a_longer_bar_makes_larger_gains(simulated: Callable[..., Any], truth: Array) -> None:
    campaign = simulated(7, noise_um=0.0, bar_error_mm=0.0, decimals=None)[1]
    bar = campaign.artefact.scale_bar
    assert bar is not None
    artefact = replace(campaign.artefact, scale_bar=replace(bar, length=bar.length * (1 + 100e-6)))
    run = samba.identify(replace(campaign, artefact=artefact)).runs[0]
    # The bar is the unit of length: all gains grow by its 100 µm/m, no angle changes.
    np.testing.assert_allclose((run.estimate - truth)[-3:], 100e-6, rtol=1e-3)
    np.testing.assert_allclose((run.estimate - truth)[[0, 1, 3, 4, 5, 6, 7]], 0.0, atol=2e-8)


def test_the_bar_follows_its_temperature(simulated: Callable[..., Any]) -> None:
    campaign = simulated(8, days=1, runs=2)[1]
    bar = campaign.artefact.scale_bar
    assert bar is not None
    warm = replace(bar, expansion_coefficient=10e-6, reference_temperature=20.0)
    campaign = replace(campaign, artefact=replace(campaign.artefact, scale_bar=warm))
    expected = [bar.length * (1 + 10e-6 * (run.conditions["ambient_degC"] - 20.0)) for run in campaign.runs]
    np.testing.assert_allclose(bar_length(campaign), expected, rtol=1e-15)


@pytest.mark.parametrize("topology", ["w C A Y X b Z (C1) t", "w C A b X Y Z (C1) t", "w X b Y Z C B (C1) t"])
def test_any_chain_recovers_its_own_truth(
    simulator: ModuleType, recorded: Callable[..., Campaign], topology: str, distance: Distance
) -> None:
    effects = base_effects(parse_topology(topology))
    rng = np.random.default_rng(20)
    # Angles of 20 µrad, shifts of 20 µm, gains of 20 µm/m.
    sizes = [0.02 if text[1] in "XYZ" and ":" not in text else 20e-6 for text in effects]
    head = [joint.name for joint in parse_topology(topology).joints if joint.kind == "rotary"]
    angles = [
        dict(zip(head, np.round(rng.uniform(-90, 90, 2), 0), strict=True)) | {"C1": 0.0} for _ in range(14)
    ]
    angles += [dict.fromkeys(head, 0.0) | {"C1": c1} for c1 in (0.0, 90.0, 180.0, 270.0)]
    plan = simulator.indexed_plan("any", angles, bar_after=3)
    distances = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        true = rng.normal(0.0, sizes)
        machine = simulator.SimulatedMachine(
            topology, terms=dict(zip(effects, true, strict=True)), tip_mm=(0.0, 0.0, -150.0)
        )
        schedule = simulator.working_days(rng, 1, 1)
        told = simulator.simulate(plan, machine, schedule, rng, 1.0)
        campaign = recorded(plan, machine, schedule, told)
        run = samba.identify(replace(campaign, probe=replace(campaign.probe, tip=machine.tip_mm))).runs[0]
        assert run.refused == ()
        distances.append(distance(run.estimate - true, run.covariance))
    freedom = len(effects)
    assert stats.kstest(distances, stats.chi2(freedom).cdf).pvalue > 1e-3
    assert np.mean(distances) == pytest.approx(freedom, abs=4 * np.sqrt(2 * freedom / 40))
