"""What errors of the linear axes do: against drawn functions put through the exact simulator."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.exceptions import InputError
from monitor.methods.rotary_probing.method import METHOD as rotary_probing
from monitor.records import LinearAxes, LinearAxisErrors
from monitor.uncertainty import measured_run, sensitivity_of
from monitor.uncertainty.linear_axes import row_covariances

TESTS = Path(__file__).resolve().parents[1]
SPACING = (20.0, 50.0)


@pytest.fixture(scope="module")
def tools(simulator):
    rp = importlib.import_module("simulator.rotary_probing")
    campaigns = load("rotary_campaigns", TESTS / "methods" / "rotary_campaigns.py")
    return rp, campaigns, sys.modules["simulator.chain"].read_topology(campaigns.PAPER)


@pytest.fixture(scope="module")
def problem(tools):
    rp, campaigns, chain = tools
    seen = rp.touch(chain, rp.paper_plan(), {}, np.random.default_rng(0))
    return rotary_probing.problem_of(campaigns.touched(campaigns.PAPER, rp.paper_plan(), [seen]))


def spread(problem, axes: LinearAxes) -> dict[str, np.ndarray]:
    """Standard uncertainties of the eight errors by source."""
    one = measured_run(problem, 1)
    at = sensitivity_of(one)
    rows = at.rows(problem.base_names)
    return {
        source: np.sqrt(np.maximum(np.diag(rows @ covariance @ rows.T), 0.0))
        for source, covariance in row_covariances(one, at.unknowns, axes).items()
    }


def test_squareness_and_gain_are_what_the_simulator_makes_of_them(tools, problem):
    rp, campaigns, chain = tools
    for axes, linear in (
        ({"Y": LinearAxisErrors(squareness={"X": 3e-5})}, lambda q: np.outer(q[:, 1], [3e-5, 0.0, 0.0])),
        ({"Z": LinearAxisErrors(squareness={"Y": 3e-5})}, lambda q: np.outer(q[:, 2], [0.0, 3e-5, 0.0])),
        ({"Z": LinearAxisErrors(proportional=1e-5)}, lambda q: np.outer(q[:, 2], [0.0, 0.0, 1e-5])),
        ({"Y": LinearAxisErrors(proportional=1e-5)}, lambda q: np.outer(q[:, 1], [0.0, 1e-5, 0.0])),
    ):
        (found,) = spread(problem, LinearAxes(axes, SPACING)).values()
        seen = rp.touch(chain, rp.paper_plan(), {}, np.random.default_rng(0), linear=linear)
        campaign = campaigns.touched(campaigns.PAPER, rp.paper_plan(), [seen])
        exact = rotary_probing.identify(campaign).runs[0].estimate
        np.testing.assert_allclose(np.abs(exact), found, rtol=1e-3, atol=2e-8)


def test_eq_22_errors_between_nodes_are_those_of_drawn_functions(tools, problem, seeds):
    rp, campaigns, chain = tools
    rng = np.random.default_rng(22)
    runs = []
    for _ in seeds(150, 60):
        pitch = rng.uniform(*SPACING)
        nodes = np.arange(-20, 21)
        heights = rng.normal(0.0, 2e-3, len(nodes))

        def linear(q, pitch=pitch, nodes=nodes, heights=heights):
            return np.outer(np.interp(q[:, 1], pitch * nodes, heights), [0.0, 0.0, 1.0])

        runs.append(rp.touch(chain, rp.paper_plan(), {}, rng, linear=linear))
    whole = rotary_probing.identify(campaigns.touched(campaigns.PAPER, rp.paper_plan(), runs))
    drawn = np.std([run.estimate for run in whole.runs], axis=0)
    found = spread(problem, LinearAxes({"Y": LinearAxisErrors(straightness=2e-3)}, SPACING))["EZY"]
    moved = found > 0.05 * np.array([1e-3 if name[1] in "XYZ" else 5e-6 for name in whole.parameters])
    assert moved.sum() >= 4
    np.testing.assert_allclose(
        drawn[moved], found[moved], rtol=3.5 / np.sqrt(2 * len(runs))
    )  # 150 runs: 6 %, three and a half of them


def test_errors_of_an_axis_that_is_not_there_are_refused(problem):
    with pytest.raises(InputError, match="has no linear axis W; it has Y, X, Z"):
        spread(problem, LinearAxes({"W": LinearAxisErrors(proportional=1e-5)}, SPACING))
