"""Shapes at probings that are only planned extend over what was measured: the same place gives the same number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from monitor.effects import Context, parse_effect
from monitor.effects.shapes.free import flexible_basis

X = [-200.0, -100.0, 0.0, 120.0, 300.0]
LAST = [2, 3, 4]


@pytest.mark.parametrize(
    "text",
    ["EYX:table", "EYX:free(2,4,12)", "EYX:free(19,20,21,22)", "EYX:free(26,27,30,36)", "EAC:free(21)"],
)
def test_the_same_places_have_the_same_columns(make: Callable[..., Context], text: str) -> None:
    measured = make({"X": X, "C": [0.1, 0.5, 1.0, 2.0, 3.0], "B": [-0.5, 0.2, 0.1, 0.3, 0.6]})
    planned = replace(measured.taken(np.array(LAST)), measured=measured)
    effect = parse_effect(text, measured.chain)
    # Only what depends on the places alone: way and direction of a plan begin anew.
    assert np.allclose(effect.basis(planned).columns, effect.basis(measured).columns[LAST])


def test_an_axis_that_stands_still_in_the_plan_takes_no_part_away(make: Callable[..., Context]) -> None:
    measured = make({"X": X, "C": [0.1, 0.5, 1.0, 2.0, 3.0], "B": [-0.5, 0.2, 0.1, 0.3, 0.6]})
    still = make({"X": [50.0, 50.0], "C": [0.0, 1.0], "B": [0.0, 0.0]})
    planned = replace(still, measured=measured)
    count = flexible_basis(measured, measured.chain.index("X")).shape[1]
    assert flexible_basis(planned, measured.chain.index("X")).shape[1] == count


def test_hats_of_a_mount_are_there_at_poses_of_which_nobody_says_where_it_points(
    make: Callable[..., Context],
) -> None:
    """`explain` ended with "operands could not be broadcast": a free shape had eight parts less at poses drawn to ask
    which effects move alike."""
    nights = make({"C": np.linspace(0.1, 1.3, 60).tolist(), "B": np.linspace(-2.0, 2.0, 60).tolist()})
    measured = replace(nights, sight=np.tile([1.0, 0.0, 0.0], (60, 1)))
    planned = replace(measured.taken(np.array([5, 30, 50])), sight=None, measured=measured)
    joint = measured.chain.index("C")
    assert flexible_basis(measured, joint).shape[1] == flexible_basis(nights, joint).shape[1] + 8
    hats = flexible_basis(measured, joint)[:, -8:]
    assert np.allclose(flexible_basis(planned, joint)[:, -8:], hats[[5, 30, 50]])
