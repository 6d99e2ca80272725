"""Readings that resemble each other: a measured mount recomputed by pointing formulas, and robots whose joints rest.

The robots are simulated by ``tests/simulator/robot_campaign.py``, which shares no code with the package.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.reporting.covariance_source import covariance_sentence
from monitor.store.models import StoredModel
from monitor.uncertainty import measured_run
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.inputs import reading_inputs
from monitor.workflow.uncertainty.request import UncertaintyRequest
from tests.simulator import robot_campaign as robots

ROOT = Path(__file__).resolve().parents[2]
MOUNT = ROOT / "examples" / "mount-mmt-2023-07"
MODEL = StoredModel("own", 1, None, (), (), (), "", None)
trial = load("trial_robot_parameters", ROOT / "tests" / "benchmarks" / "trial_robot_parameters.py")


def _elevations() -> tuple[np.ndarray, np.ndarray]:
    """What the elevations (n,) of the stars are off in rad, and the columns (n, 3) of IE, AN and AW (TPOINT)."""
    rows = list(csv.DictReader((MOUNT / "probings.csv").read_text().splitlines()))
    az, el = (np.deg2rad([float(row[name]) for row in rows]) for name in ("az_deg", "el_deg"))
    star = np.array([[float(row[f"direction_{axis}"]) for axis in "xyz"] for row in rows])
    seen = np.arcsin(star[:, 2] / np.linalg.norm(star, axis=1))
    return seen - el, np.column_stack([np.ones_like(az), np.cos(az), -np.sin(az)])


def _u_of_first(off: np.ndarray, columns: np.ndarray) -> float:
    """Standard uncertainty of the first coefficient under a slow part and an independent one, by restricted likelihood
    with dense matrices (Patterson and Thompson 1971)."""
    number = np.arange(len(off))
    best, u = np.inf, 0.0
    for rho in np.arange(0.0, 0.99, 0.05):
        for share in np.arange(0.1, 1.01, 0.1):
            noise = share * rho ** np.abs(number[:, None] - number) + (1.0 - share) * np.eye(len(off))
            inverse = np.linalg.inv(noise)
            normal = columns.T @ inverse @ columns
            left = off - columns @ np.linalg.solve(normal, columns.T @ inverse @ off)
            squares, free = left @ inverse @ left, len(off) - columns.shape[1]
            minus_twice = np.linalg.slogdet(noise)[1] + np.linalg.slogdet(normal)[1] + free * np.log(squares)
            if minus_twice < best:
                best, u = minus_twice, float(np.sqrt(np.linalg.inv(normal)[0, 0] * squares / free))
    return u


def test_the_index_error_of_a_measured_mount_is_as_uncertain_as_its_elevations_make_it() -> None:
    """Lag one is 0.2 there, but readings ten apart still resemble each other: 2.3 times the u of independent stars,
    and not the 1.2 that a correlation of 0.2 would give that falls off by itself."""
    campaign = read_campaign(MOUNT)
    fitted = fit(campaign_method(campaign).problem_of(campaign, as_model(MODEL)))
    result = evaluate_fit(campaign, MODEL, fitted, UncertaintyRequest(campaign.name, method="guf"))
    place = result.framework.names.index("EB0EL")
    u = float(np.sqrt(result.framework.covariance[place, place]))
    off, columns = _elevations()
    assert abs(result.framework.estimate[place] + np.linalg.lstsq(columns, off)[0][0]) < 0.1e-6
    assert u == pytest.approx(_u_of_first(off, columns), rel=0.15)
    assert covariance_sentence(result.covariance_source).endswith(
        "readings of the run resemble the one before, with a correlation of 0.19, times 0.93 with each further one, "
        "which is in the covariance"
    )


def _robot(seed: int, kind: str):
    """A campaign of a robot along an ordered grid."""
    rng = np.random.default_rng([seed, 41])
    location = robots.errors_of_robot(rng)
    return trial.measured(rng, kind, np.round(trial.grid(rng), 4), location, trial.NOISE_UM)


def test_readings_of_one_pose_of_a_robot_resemble_each_other_and_those_of_the_pose_before() -> None:
    campaign = _robot(900, "rest follows")
    fitted = fit(campaign_method(campaign).problem_of(campaign))
    fixed, coefficients = fitted.problem.resolved(fitted.solution.common)
    inputs, source = reading_inputs(fitted, campaign, measured_run(fixed, 1, coefficients), None)
    assert source.of_poses
    assert source.neighbours is not None
    assert source.further is not None
    size = np.sqrt(np.diag(inputs.covariance))
    alike = (inputs.covariance / np.outer(size, size))[::3, ::3]
    # Three reflectors a pose.
    np.testing.assert_allclose([alike[0, 1], alike[1, 2]], source.neighbours, rtol=0.02)
    np.testing.assert_allclose(alike[0, 3], source.neighbours * source.further, rtol=0.05)
    assert source.further > 0.4
    assert "readings of one pose resemble each other" in covariance_sentence(source)


def test_readings_of_a_robot_without_shared_noise_are_independent() -> None:
    campaign = _robot(901, "white")
    fitted = fit(campaign_method(campaign).problem_of(campaign))
    fixed, coefficients = fitted.problem.resolved(fitted.solution.common)
    _, source = reading_inputs(fitted, campaign, measured_run(fixed, 1, coefficients), None)
    assert (source.neighbours, source.further, source.of_poses) == (None, None, None)


@pytest.mark.all_seeds
def test_noise_that_poses_share_is_in_u_once() -> None:
    """Six robots whose joints rest within 40 µrad: 1 is right; as independent readings it was 6, with what is shared
    once more as lack of fit 0.58."""
    squares = []
    for seed in range(910, 916):
        rng = np.random.default_rng([seed, 41])
        location, degrees = robots.errors_of_robot(rng), np.round(trial.grid(rng), 4)
        _, true, _, _ = trial.evaluated(trial.measured(rng, "none", degrees, location, 0.01))
        _, estimate, covariance, told = trial.evaluated(trial.measured(rng, "rest", degrees, location, 20.0))
        off = estimate - true
        squares.append(float(off @ np.linalg.solve(covariance, off)) / len(off))
        assert told
    assert 0.5 < np.mean(squares) < 1.5, squares


def test_what_follows_itself_is_no_lack_of_fit_once_more() -> None:
    campaign = _robot(902, "rest")
    fitted = fit(campaign_method(campaign).problem_of(campaign))
    result = evaluate_fit(campaign, MODEL, fitted, UncertaintyRequest(campaign.name, method="guf"))
    shares = {line.source: np.abs(share) for line, share in zip(
        result.framework.budget, result.framework.budget_shares(), strict=True
    )}  # fmt: skip
    lack = shares.get("lack of fit of the model", np.zeros(1))
    assert np.median(lack) < 0.3
