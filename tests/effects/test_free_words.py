"""What an effect of free shape is said to depend on, by what its parts are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from monitor.discovery.machine.shapes.curves import curve_of, follows
from monitor.effects import ChainEffect, Context, parse_effect
from monitor.effects.shapes.free import Follows, Free, flexible_basis
from monitor.effects.words import describe, describe_free

#: There and back, other axes elsewhere each time.
X = [*np.linspace(-200.0, 300.0, 14), *np.linspace(290.0, -190.0, 14)]
OTHERS = {"Z": [40.0 * np.sin(3.0 * number) for number in range(28)]}


def free_of(context: Context, text: str) -> ChainEffect:
    effect = parse_effect(text, context.chain)
    assert isinstance(effect, ChainEffect)
    return effect


def test_each_part_follows_what_it_changes_with(make: Callable[..., Context]) -> None:
    """By the other way through the same places, and by other places of the other axes."""
    there, back = make({"X": X, **OTHERS}), make({"X": X[::-1], "Z": OTHERS["Z"][::-1]})
    elsewhere = make({"X": X, "Z": OTHERS["Z"][::-1]})
    joint = there.chain.index("X")
    plain, other_way, other_place = (flexible_basis(context, joint) for context in (there, back, elsewhere))
    changes = np.abs(plain - other_way[::-1]).max(axis=0) > 1e-9
    moves = np.abs(plain - other_place).max(axis=0) > 1e-9
    kinds = Free().following(there, joint)
    # The last is the row before the axis first moves: none, from either end.
    np.testing.assert_array_equal((kinds == Follows.DIRECTION)[:-1], changes[:-1])
    np.testing.assert_array_equal(kinds == Follows.OTHERS, moves)


@pytest.mark.parametrize(
    ("text", "sizes", "said"),
    [
        ("EYX:free(6,8)", (3.0, 2.0), "it depends on the position of X alone"),
        ("EYX:free(24)", (3.0,), "it depends on the position of X alone"),
        ("EYX:free(6,13)", (3.0, 0.3), "it depends on the position of X alone"),
        ("EYX:free(6,13)", (3.0, 2.0), "it depends on position and direction of X"),
        ("EYX:free(6,19)", (3.0, 2.0), "it depends on the position of X, and where the other axes stand"),
    ],
)
def test_a_direction_is_said_where_the_curve_shows_one(
    make: Callable[..., Context], text: str, sizes: tuple[float, ...], said: str
) -> None:
    """Was: "it depends on position and direction" of every free shape."""
    context = make({"X": X, **OTHERS})
    effect = free_of(context, text)
    shows = follows(context, effect, np.array(sizes), 0.2**2 * np.eye(len(sizes)))
    assert describe_free(effect, shows).meaning.endswith(f"no entry of the catalogue has: {said}")
    # Of a shape that no data show nothing is said.
    assert describe(effect).meaning.endswith("no entry of the catalogue has")


def test_a_point_of_a_curve_stands_there_once(make: Callable[..., Context]) -> None:
    """Was: six times, one for each ball that was touched where the table stood."""
    places = np.repeat(np.linspace(-200.0, 300.0, 9), 6).tolist()
    context = make({"X": places})
    curve = curve_of(context, free_of(context, "EYX:free(6,8)"), np.array([3.0, 2.0]), np.eye(2))
    assert curve is not None
    np.testing.assert_allclose(np.sort(np.abs(curve.at)), np.sort(np.abs(np.linspace(-200.0, 300.0, 9))))
    assert len(curve.size) == len(curve.u) == 9
