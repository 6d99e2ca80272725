"""Sensitivity by the implicit-function theorem against differences of the whole solve (JCGM 102 clause 6)."""

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.uncertainty import measured_run, sensitivity_of


def differences_of_the_solve(run, at, columns, step):
    """Central differences of complete re-solves, Richardson-extrapolated once."""
    found = []
    for size in (step, 2 * step):
        moves = np.zeros((len(at.inputs), 2 * len(columns)))
        moves[columns, np.arange(len(columns))] = size
        moves[columns, len(columns) + np.arange(len(columns))] = -size
        solved, converged = run.solve(at.inputs[:, None] + moves, at.unknowns)
        assert np.all(converged)
        found.append((solved[:, : len(columns)] - solved[:, len(columns) :]) / (2 * size))
    return (4 * found[0] - found[1]) / 3


@pytest.mark.parametrize("name", ["five-days", "cold-cold"])
def test_samba_sensitivity_equals_differences_of_the_whole_solve(campaign, name):
    run = measured_run(campaign(name), 1)
    at = sensitivity_of(run)
    columns = np.array([0, 7, 50, len(at.inputs) // 2, len(at.inputs) - 2, len(at.inputs) - 1])
    numeric = differences_of_the_solve(run, at, columns, 2e-3)
    seen = at.determined
    exact = at.matrix[np.ix_(np.flatnonzero(seen), columns)]
    size = np.max(np.abs(at.matrix[seen]), axis=1, keepdims=True)
    assert np.max(np.abs(exact - numeric[seen]) / size) < 2e-6
    assert at.compiled


def test_residual_curvature_is_in_it(make_run):
    # Readings 0.1 mm off leave residuals whose curvature a pseudo-inverse of the Jacobian does not see.
    run = make_run("w C B X b Z Y (C1) t", noise=0.1)
    at = sensitivity_of(run)
    jacobian = run.repeated(run.inputs[:, None]).linearise(at.unknowns[None], run.common).local[0]
    gauss_newton = np.linalg.inv(jacobian.T @ jacobian)
    columns = np.arange(0, len(at.inputs), 30)
    numeric = differences_of_the_solve(run, at, columns, 0.01)
    size = np.max(np.abs(at.matrix), axis=1, keepdims=True)
    with_curvature = np.max(np.abs(at.matrix[:, columns] - numeric) / size)
    hessian_error = np.max(np.abs(gauss_newton - at.inverse) / np.sqrt(np.outer(*[np.diag(at.inverse)] * 2)))
    assert hessian_error > 1e-4
    assert with_curvature < 2e-6


def test_gradient_vanishes_at_the_least_squares_point(campaign):
    at = sensitivity_of(measured_run(campaign("five-days"), 3))
    left = at.inverse @ at.gradient(at.unknowns[:, None], at.inputs[:, None])[:, 0]
    assert np.max(np.abs(left) / np.sqrt(np.diag(at.inverse))) < 1e-9


def test_standard_uncertainties_of_five_days_are_those_of_the_conventions(campaign):
    # Conventions: 1 µm white noise on every reading, µrad, µm and µm/m, computed independently.
    expected = {
        "EA0B": 1.9, "EC0B": 1.7, "EA0C": 2.0, "EB0C": 1.7, "EB0Z": 2.3, "EA0Y": 2.7, "EC0Y": 2.2,
        "EX0C": 0.28, "EX0C1": 0.33, "EY0C1": 0.36, "EXX": 6.2, "EYY": 5.7, "EZZ": 6.3,
    }  # fmt: skip
    at = sensitivity_of(measured_run(campaign("five-days"), 1))
    white = np.full(len(at.inputs), 1e-3)
    white[-1] = 1.2e-3
    u = dict(zip(at.names, np.sqrt(np.sum((at.matrix * white) ** 2, axis=1)), strict=True))
    for name, value in expected.items():
        display = 1e3 if name in ("EX0C", "EX0C1", "EY0C1") else 1e6
        assert u[name] * display == pytest.approx(value, rel=0.1)


def test_what_the_plan_does_not_determine_is_refused_by_name(campaign):
    at = sensitivity_of(measured_run(campaign("cold-cold"), 1))
    assert not at.determined[at.names.index("EX0C1")]
    assert at.determined[at.names.index("EB0C")]
    with pytest.raises(DataError, match=r"the plan does not determine EX0C1"):
        at.rows(("EB0C", "EX0C1"))
    with pytest.raises(DataError, match=r"no unknown 'EXY'; there are EA0B"):
        at.rows(("EXY",))


def test_runs_and_inputs_are_checked(campaign):
    problem = campaign("five-days")
    with pytest.raises(DataError, match=r"no run 99; there are runs 1, 2"):
        measured_run(problem, 99)
    with pytest.raises(DataError, match=r"this run has 187 inputs, not \(3,\)"):
        sensitivity_of(measured_run(problem, 1), np.zeros(3))
