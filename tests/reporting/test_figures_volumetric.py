"""Figures of the volumetric error and of plans: same bytes for the same numbers, and refusals that say why."""

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.reporting.figures.style import svg
from monitor.reporting.figures.titles import map_note
from monitor.reporting.figures.volumetric import expected_uncertainties, volumetric_slices

GRID = np.array([[x, y, z] for x in (0.0, 50.0, 100.0) for y in (-20.0, 0.0, 20.0) for z in (0.0, 200.0)])
VECTORS = np.column_stack([0.1 * GRID[:, 0], 0.0 * GRID[:, 0], -0.02 * GRID[:, 2]])
UNCERTAINTY = np.full(len(GRID), 1.5)


def _slices(readings=GRID, vectors=VECTORS, expanded=UNCERTAINTY, names=("X", "Y", "Z")):
    return volumetric_slices(readings, vectors, expanded, names=names, title="A map", note="What it says.")


def test_slices_are_drawn_across_each_axis_whatever_the_order_of_the_points():
    shuffled = np.random.default_rng(1).permutation(len(GRID))
    first = svg(_slices())
    assert svg(_slices(GRID[shuffled], VECTORS[shuffled])) == first
    titles = [axes.get_title(loc="left") for axes in _slices().axes[:3]]
    assert titles == ["Z = 200 mm", "Y = 0 mm", "X = 50 mm"]


def test_a_map_without_errors_can_be_drawn():
    assert len(svg(_slices(vectors=0.0 * VECTORS))) > 1000


def test_refused_what_is_no_grid():
    with pytest.raises(DataError, match="17 points are no grid of 3 x 3 x 2"):
        _slices(GRID[1:], VECTORS[1:], UNCERTAINTY[1:])
    with pytest.raises(DataError, match=r"needs points and vectors \(n, 3\), n uncertainties and 3 names"):
        _slices(names=("X", "Y"))


def test_a_parameter_without_a_number_leaves_a_gap():
    figure = expected_uncertainties(
        ["EA0C", "EX0C1"], ["µrad", "µm"], [2.0, np.nan], [1.5, 0.3], title="A plan", note="One run."
    )
    assert len(svg(figure)) > 1000
    with pytest.raises(DataError, match="2 parameters need as many units and uncertainties"):
        expected_uncertainties(["EA0C", "EX0C1"], ["µrad"], [2.0, 1.0], None, title="A plan")


def test_the_note_says_rotary_axes_of_machines_that_have_them():
    assert "otary" not in map_note(2.0, 0.95, None)
    assert map_note(2.0, 0.95, 1).endswith("The title is about the one rotary pose of the plan.")
    assert map_note(2.0, 0.95, 4).startswith("Rotary axes at zero. Colour")
    assert map_note(2.0, 0.95, 4).endswith("all 4 rotary poses of the plan.")
