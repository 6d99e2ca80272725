"""Columns of shapes and drivers are computed once for the same probings, and are what they would be anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from monitor.effects import parse_effect
from monitor.effects.context import MOST_REMEMBERED, Context
from monitor.effects.drivers import Always
from monitor.records import Array


@dataclass(frozen=True)
class CountedDriver(Always):
    """One, and a note of every time that it is asked."""

    asked: list[int] = field(default_factory=list, compare=False)

    def columns(self, context: Context, joint: int | None) -> Array:
        self.asked.append(len(context))
        return super().columns(context, joint)


@dataclass(frozen=True, eq=False)
class UnhashableDriver(CountedDriver):
    """The same of a plug-in that cannot be hashed."""

    __hash__ = None  # type: ignore[assignment]


def test_two_effects_of_a_joint_ask_a_driver_once(make: Callable[..., Context]) -> None:
    context, driver = make({"X": np.linspace(0.0, 100.0, 7)}), CountedDriver()
    for text in ("EYX:poly1", "EZX:poly2"):
        effect = replace(parse_effect(text, context.chain), driver=driver)
        first, again = effect.basis(context), effect.basis(context)
        np.testing.assert_array_equal(first.columns, again.columns)
        anew = parse_effect(text, context.chain).basis(replace(context))
        np.testing.assert_array_equal(first.columns, anew.columns)
    assert driver.asked == [7]


def test_what_is_made_of_the_columns_does_not_change_them(make: Callable[..., Context]) -> None:
    context = make({"X": np.linspace(0.0, 100.0, 7)})
    effect = parse_effect("EYX:poly2", context.chain)
    first = effect.basis(context).columns
    expected = first.copy()
    first *= 2.0
    np.testing.assert_array_equal(effect.basis(context).columns, expected)


def test_drivers_that_cannot_be_hashed_and_long_campaigns_are_asked_each_time(
    make: Callable[..., Context],
) -> None:
    short, long = (
        make({"X": np.linspace(0.0, 100.0, 7)}),
        make({"X": np.linspace(0.0, 100.0, MOST_REMEMBERED + 1)}),
    )
    for context, driver in ((short, UnhashableDriver()), (long, CountedDriver())):
        effect = replace(parse_effect("EYX:poly1", context.chain), driver=driver)
        effect.basis(context)
        effect.basis(context)
        assert len(driver.asked) == 2
