"""What errors of single axes do in place of a product of two axes in a free shape."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.discovery.machine.explain import explain
from monitor.effects.shapes.free import Follows, Free, axes_of_products
from monitor.methods import campaign_method
from tests.discovery.ball_bars import ball_bars


def s_shaped(place, move, direction):
    """Z goes astray along X in a cube of its position."""
    return 0.0, 0.0, 4.0 * ((place[0] - 200.0) / 100.0) ** 3


def test_the_axes_of_products_are_those_that_the_basis_says(tmp_path) -> None:
    campaign = ball_bars(tmp_path, lambda *_: (0.0, 0.0, 0.0))
    context = campaign_method(campaign).problem_of(campaign).context
    for joint in range(3):
        kinds = Free().following(context, joint)
        products = 1 + np.flatnonzero(kinds == Follows.OTHERS)
        others = [other for other in range(3) if other != joint]
        assert [axes_of_products(context, joint, [part]) for part in products] == [
            frozenset({other}) for other in others * 2
        ]
        rest = 1 + np.flatnonzero(kinds != Follows.OTHERS)
        assert axes_of_products(context, joint, rest.tolist()) == frozenset()
        assert axes_of_products(context, joint, products.tolist()) == frozenset(others)


@pytest.mark.slow
def test_an_s_shaped_straightness_is_a_rival_of_the_product_that_is_told(tmp_path) -> None:
    """Two powers score 110 where one part of a free shape of another error scores 123."""
    campaign = ball_bars(tmp_path, s_shaped, seed=5000, planes=("xy", "yz", "zx"))
    problem = campaign_method(campaign).problem_of(campaign)
    found = explain(campaign, problem, "instruments", rng=np.random.default_rng(1)).missing
    names = {each.effect for each in found} | {rival.effect for each in found for rival in each.rivals}
    assert {"EZX:poly2", "EZX:poly3"} <= names
