"""GUM framework for many outputs against published examples (JCGM 100 H.2, H.3; JCGM 102 clause 6)."""

import math

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.uncertainty import (
    Inputs,
    OutputContribution,
    ellipsoid_factor,
    gum_framework,
    joined,
    overall,
    rectangle_factor,
    uncorrelated,
)


def h2_result(references, finite_dof=True):
    data = np.loadtxt(references / "gum" / "gum_H2_data.csv", delimiter=",", skiprows=1)
    data[:, 1] *= 1e-3
    inputs = overall(data, ("V", "I", "phi"), ("V", "A", "rad"), mean_of=5)
    voltage, current, phase = inputs.estimate
    z = voltage / current
    sine, cosine = math.sin(phase), math.cos(phase)
    sensitivity = np.array(
        [
            [cosine / current, -z * cosine / current, -z * sine],
            [sine / current, -z * sine / current, z * cosine],
            [1.0 / current, -z / current, 0.0],
        ]
    )
    outputs = np.array([z * cosine, z * sine, z])
    return gum_framework(inputs, sensitivity, outputs, "RXZ", ("ohm",) * 3, finite_dof=finite_dof)


def test_gum_h2_resistance_reactance_impedance(gum, references):
    published = gum("gum_H2")["published"]
    result = h2_result(references)
    assert np.round(result.estimate, 3) == pytest.approx([published[name] for name in "RXZ"], abs=6e-3)
    assert np.round(result.u, 3) == pytest.approx([published[f"u_{name}"] for name in "RXZ"], abs=1.1e-3)
    pairs = [(0, 1, "r_R_X"), (0, 2, "r_R_Z"), (1, 2, "r_X_Z")]
    for i, j, key in pairs:
        assert result.correlation[i, j] == pytest.approx(published[key], abs=6e-4)


def test_gum_h2_output_covariance_has_rank_2_and_k_p_is_for_2(gum, references):
    result = h2_result(references, finite_dof=False)
    assert result.rank == gum("gum_H2")["recomputed_approach_1"]["rank_of_Uy"] == 2
    assert result.k_p == ellipsoid_factor(2)
    # Three intervals in a plane: less than any bound for three, more than one interval needs.
    assert 1.96 < result.k_q < rectangle_factor(3)
    finite = h2_result(references)
    assert finite.dof == pytest.approx(4.0)
    assert finite.k_p == pytest.approx(ellipsoid_factor(2, dof=4.0))


def test_gum_h3_straight_line_calibration(gum):
    h3 = gum("gum_H3")
    t, b, published = np.array(h3["t"]), np.array(h3["b"]), h3["published"]
    design = np.column_stack([np.ones_like(t), t - h3["t0"]])
    solver = np.linalg.pinv(design)
    line = solver @ b
    scatter = np.sum((b - design @ line) ** 2) / (len(t) - 2)
    names = tuple(f"b{i}" for i in range(len(t)))
    inputs = Inputs(
        names, ("degC",) * len(t), b, scatter * np.eye(len(t)), ("fit",) * len(t), {"fit": len(t) - 2}
    )
    at_30 = np.vstack([solver, np.array([1.0, 10.0]) @ solver])
    result = gum_framework(inputs, at_30, at_30 @ b, ("y1", "y2", "b30"), ("degC", "1", "degC"))
    assert result.estimate == pytest.approx([published["y1"], published["y2"], published["b30"]], abs=6e-5)
    assert result.u == pytest.approx([published["u_y1"], published["u_y2"], published["u_b30"]], rel=0.02)
    assert round(result.correlation[0, 1], 2) == published["r"]
    assert result.rank == 2
    assert result.dof == pytest.approx(published["nu"])


def linear_case():
    rng = np.random.default_rng(11)
    runs = rng.standard_normal((8, 6))
    probing = overall(runs, tuple("abcdef"), ("mm",) * 6, source="probing")
    bar = uncorrelated(("bar",), ("mm",), [0.0], [1e-6], source="scale bar")
    return joined(probing, bar), rng.standard_normal((3, 7))


def test_jcgm102_6_2_budget_is_never_trimmed_and_adds_up():
    inputs, sensitivity = linear_case()
    lack = OutputContribution("lack of fit", np.diag([0.3, 0.0, 0.1]), 40.0)
    result = gum_framework(inputs, sensitivity, np.zeros(3), "xyz", ("mm",) * 3, contributions=[lack])
    expected = sensitivity @ inputs.covariance @ sensitivity.T + lack.covariance
    assert result.covariance == pytest.approx(expected, rel=1e-12)
    assert [line.source for line in result.budget] == ["probing", "scale bar", "lack of fit"]
    total = sum(line.variance for line in result.budget)
    assert total == pytest.approx(np.diag(result.covariance), rel=1e-14)
    assert result.budget_shares().sum(axis=0) == pytest.approx(np.ones(3), rel=1e-14)
    # The bar is a millionth of the rest, and is there all the same.
    assert np.all(result.budget[1].variance > 0.0)
    assert 7.0 < result.dof_by_output[1] < 7.001


def test_budget_with_correlated_sources_has_a_line_for_the_covariance_between_them():
    covariance = np.array([[1.0, -0.6], [-0.6, 1.0]])
    inputs = Inputs(("a", "b"), ("mm", "mm"), np.zeros(2), covariance, ("one", "two"), {"one": 5.0})
    result = gum_framework(inputs, np.array([[1.0, 1.0]]), np.zeros(1), ("y",), ("mm",))
    lines = {line.source: line.variance[0] for line in result.budget}
    assert lines == pytest.approx({"one": 1.0, "two": 1.0, "one × two": -1.2})
    assert result.u[0] ** 2 == pytest.approx(0.8)


def test_framework_refusals():
    inputs, sensitivity = linear_case()
    with pytest.raises(DataError, match=r"sensitivity matrix of shape \(2, 7\), not \(3, 7\)"):
        gum_framework(inputs, sensitivity, np.zeros(2), "xy", ("mm", "mm"))
    with pytest.raises(DataError, match=r"two lines of the budget are named 'probing'"):
        gum_framework(
            inputs,
            sensitivity,
            np.zeros(3),
            "xyz",
            ("mm",) * 3,
            contributions=[OutputContribution("probing", np.eye(3))],
        )
