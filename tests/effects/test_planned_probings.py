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
