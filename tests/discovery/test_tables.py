"""A curve that no single shape follows is told as one table, not as the shapes that mimic it together."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of

GRID = np.linspace(-300.0, 300.0, 25)


@pytest.fixture(scope="module")
def bumped(virtual_campaigns):
    """A guideway with a bump of 8 µm in the middle of its travel, and a spindle that grows."""
    sim = virtual_campaigns.simulator()
    bump = sim.Effect(
        "EYX:table", coefficients=list(8e-3 * np.exp(-(((GRID - 60.0) / 60.0) ** 2))), grid=list(GRID)
    )
    return virtual_campaigns.virtual(4, [bump, sim.Effect("EZC1:const@warmup", peak_um=6.0)], days=2)[0]


@pytest.fixture(scope="module")
def explanation(bumped, explained):
    """What the plain model lacks of the bumped guideway."""
    return explained(bumped)


@pytest.mark.slow
def test_a_bump_is_one_table_and_nothing_is_missing_once_it_is_added(bumped, explanation):
    found = [one.effect for one in explanation.missing]
    assert len(found) == 2
    assert found[0].startswith("EYX:table(")
    assert found[1] == "EZC1:const@warmup"
    assert explanation.final.scale == pytest.approx(1.0, abs=0.03)
    added = problem_of(bumped, Model("samba", added=tuple(found)))
    assert not explain(bumped, added, "samba", rng=np.random.default_rng(1)).missing


def test_the_ends_of_a_table_hold_what_the_base_can_do(explanation):
    """Straightness is the deviation from a straight line through the ends (ISO 230-1:2012, 3.5)."""
    found = explanation.missing[0]
    assert found.effect.count("!") == 2
    nodes = [float(word.strip("!)")) for word in found.effect.partition("(")[2].split(",")]
    values = np.interp(nodes, GRID, 8e-3 * np.exp(-(((GRID - 60.0) / 60.0) ** 2)))
    line = np.interp(nodes, [nodes[0], nodes[-1]], values[[0, -1]])
    told = (
        -found.coefficients
        if np.corrcoef(found.coefficients, (values - line)[1:-1])[0, 1] < 0
        else found.coefficients
    )
    u = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(told - (values - line)[1:-1]) < 3.0 * u + 1e-3)


def test_the_size_of_a_table_is_its_largest_node(explanation):
    """It was the root of the sum of squares of all nodes, twice the bump or more with as many nodes."""
    found = explanation.missing[0]
    nodes = dict(zip(found.parameters, found.coefficients, strict=True))
    u = dict(zip(found.parameters, np.sqrt(np.diag(found.covariance)), strict=True))
    assert found.amplitude == max(abs(value) for value in nodes.values()) == abs(nodes[found.largest])
    assert found.u == pytest.approx(u[found.largest])
    assert 5e-3 < found.amplitude < 8e-3 + 3.0 * found.u


@pytest.mark.slow
def test_shapes_of_the_catalogue_stay_what_they_are(virtual_campaigns, explained):
    sim = virtual_campaigns.simulator()
    effects = [sim.Effect("EYX:poly3", peak_um=8.0), sim.Effect("EYX:reversal", peak_um=5.0)]
    found = [one.effect for one in explained(virtual_campaigns.virtual(6, effects, days=2)[0]).missing]
    assert sorted(found) == ["EYX:poly3", "EYX:reversal"]
