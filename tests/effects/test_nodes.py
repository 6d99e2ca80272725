"""Tables on nodes that the user names, and the shape of a workpiece."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from monitor.effects import Context, parse_effect
from monitor.exceptions import EffectError
from monitor.machine import parse_topology

CHAIN = parse_topology("w C b Y X Z (C1) t")


def context(x, c=(0.0, 0.0, 0.0), **columns):
    n = len(x)
    zero = np.zeros(n)
    positions = np.zeros((n, len(CHAIN.joints)))
    positions[:, CHAIN.index("X")] = x
    positions[:, CHAIN.index("C")] = -np.radians(c)  # work side: q = -reading
    rows = np.arange(n)
    names, run = np.array(["a", "b", "a"]), np.ones(n, dtype=np.int64)
    return Context(CHAIN, positions, run, rows, zero, zero, zero, names, np.zeros((n, 3)), columns)


def test_hats_are_one_at_their_node_and_straight_between():
    effect = parse_effect("EXX:table(-100,0!,50)", CHAIN)
    here = context([-100.0, -25.0, 30.0])
    assert effect.parameters(here) == ("EXX(-100)", "EXX(50)")
    np.testing.assert_allclose(effect.basis(here).columns, [[1.0, 0.0], [0.25, 0.0], [0.0, 0.6]])


def test_nodes_are_readings_of_the_controller():
    effect = parse_effect("ECC:table(0,75,130)", CHAIN)
    here = context([0.0, 0.0, 0.0], (0.0, 75.0, 130.0))
    assert effect.parameters(here) == ("ECC(0)", "ECC(75)", "ECC(130)")
    np.testing.assert_allclose(effect.basis(here).columns, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("places", ["", "1,0", "0,0", "a,b", "0,nan"])
def test_nodes_that_are_none_are_refused(places):
    with pytest.raises(EffectError, match="must be numbers in rising order"):
        parse_effect(f"EXX:table({places})", CHAIN)


def test_the_text_of_a_table_is_read_back():
    effect = parse_effect("EXX:table(-100,0!,50)", CHAIN)
    assert parse_effect(effect.text, CHAIN) == effect


def test_shape_moves_a_point_along_its_normal():
    here = context([0.0, 0.0, 0.0], normal_x=np.array([3.0, 0.0, 3.0]), normal_y=np.array([4.0, 1.0, 4.0]))
    effect = parse_effect("shape", CHAIN)
    assert effect.parameters(here) == ("shape(a)", "shape(b)")
    shifts = effect.basis(here).shifts
    np.testing.assert_allclose(shifts[:, :2, 0], [[0.6, 0.8], [0.0, 0.0], [0.6, 0.8]])
    np.testing.assert_allclose(shifts[:, :2, 1], [[0.0, 0.0], [0.0, 1.0], [0.0, 0.0]])


def test_shape_without_normals_is_refused():
    with pytest.raises(EffectError, match="needs the normal of the surface: the columns normal_x"):
        parse_effect("shape", CHAIN).basis(replace(context([0.0, 0.0, 0.0])))
