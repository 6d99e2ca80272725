"""Readings of laser, ball bar and R-test that follow the reading before: what a certificate states of such a session.

Simulated by ``tests/simulator/four_instruments.py``, which shares no code with the package.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.store.models import StoredModel
from monitor.uncertainty import measured_run
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.inputs import reading_inputs
from monitor.workflow.uncertainty.request import UncertaintyRequest

trial = load("trial_instruments", Path(__file__).resolve().parents[1] / "benchmarks" / "trial_instruments.py")
MODEL = StoredModel("own", 1, None, (), (), (), "", None)


def _fitted(folder: Path, seed: int, memory: float, *, bar: bool = False):
    """A session whose readings follow the one before of their instrument, and the true errors."""
    asked = argparse.Namespace(
        pitch=False, heavy=False, bar=bar, drift=False, stated=False, certified=True, follows=memory
    )
    campaign, true = trial.campaign_of(folder, seed, asked, 1, 10.0)
    return campaign, fit(campaign_method(campaign).problem_of(campaign, as_model(MODEL))), true


def test_readings_of_a_setup_resemble_their_neighbours_and_none_of_another_setup(tmp_path) -> None:
    campaign, fitted, _ = _fitted(tmp_path / "shop", 61, 0.8, bar=True)
    fixed, coefficients = fitted.problem.resolved(fitted.solution.common)
    inputs, source = reading_inputs(fitted, campaign, measured_run(fixed, 1, coefficients), None)
    assert source.neighbours is not None
    setups = fitted.problem.context.target
    covariance = inputs.covariance
    size = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(size, size)
    same = setups[:, None] == setups[None, :]
    assert np.abs(correlation[~same]).max() < 1e-9
    beside = np.array([correlation[row, row + 1] for row in range(len(setups) - 1) if same[row, row + 1]])
    assert beside.min() > 0.4
    np.testing.assert_allclose(beside, source.neighbours, atol=0.02)


@pytest.mark.all_seeds
def test_noise_of_instruments_that_follows_itself_is_in_the_covariance(tmp_path) -> None:
    squares = []
    for seed in range(62, 74):
        campaign, fitted, true = _fitted(tmp_path / f"shop{seed}", seed, 0.6)
        result = evaluate_fit(campaign, MODEL, fitted, UncertaintyRequest(campaign.name, method="guf"))
        truth = dict(zip(trial.PARAMETERS, true, strict=True))
        off = result.framework.estimate - np.array([truth[name] for name in result.framework.names])
        squares.append(float(off @ np.linalg.solve(result.framework.covariance, off)) / len(off))
    # 1 is right; taken as independent it is 2.5 of forty others.
    assert np.mean(squares) < 1.7
