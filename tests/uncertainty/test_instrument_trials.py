"""Trials of several instruments: expanded, although the model leaves products of errors out of its derivatives.

Until they were, every trial of a laser and a ball bar was a fit of its own: a run of 732 rows had no Monte Carlo in
200 s.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.uncertainty import RowRun, measured_run, run_estimator, sensitivity_of, uncorrelated
from tests.simulator import four_instruments as shop


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RowRun:
    """One run of laser, ball bar and R-test, as simulated without a line of the package."""
    rng, chain = np.random.default_rng(41), shop.machine(0.0)
    parts = [shop.laser(chain, rng, 1), shop.ball_bar(chain, rng, 30.0), shop.r_test(chain, rng)]
    folder: Path = chain.write(
        tmp_path_factory.mktemp("shop") / "week",
        "".join(text for text, _ in parts),
        [row for _, rows in parts for row in rows],
    )
    campaign = read_campaign(folder)
    measured = measured_run(campaign_method(campaign).problem_of(campaign), 1)
    assert isinstance(measured, RowRun)
    return measured


def test_trials_of_laser_and_bar_are_expanded_and_solved(run: RowRun) -> None:
    """Every trial against Gauss and Newton with a fresh Jacobian in every step."""
    u = np.concatenate([run.stated, run.calibrated[2]])
    inputs = uncorrelated(run.input_names, ("mm",) * len(u), run.inputs, u, source="readings")
    estimator = run_estimator(run, inputs)
    assert type(estimator.sensitivity.gradient.__self__).__name__ == "Expansion"  # type: ignore[attr-defined]
    trials = u * np.random.default_rng(2).standard_normal((30, len(u)))
    outputs, converged = estimator(trials)
    exact, solved = run.solve(np.ascontiguousarray(trials.T), estimator.sensitivity.unknowns)
    assert converged.all()
    assert solved.all()
    at = estimator.sensitivity.places(estimator.outputs)
    off = np.abs(outputs.T - exact[at]) / estimator.u[at][:, None]
    assert off.max() < 1e-5
    assert estimator.by_gauss_newton == 0


def test_a_gradient_that_leads_elsewhere_is_not_used(run: RowRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """An expansion that takes the products for derivatives is off by 1e-5 u and more, and the exact one is used."""
    monkeypatch.setattr(type(run.problem), "with_products", lambda self: self)
    at = sensitivity_of(run)
    assert at.gradient == run.gradient
