"""A step has one name, however its readings are written, and the name is read as the same step."""

from __future__ import annotations

from decimal import Decimal
from itertools import accumulate

import pytest
from hypothesis import given, settings, strategies as st

from monitor.effects import parse_effect
from monitor.machine import parse_topology

CHAIN = parse_topology("w C B X b Z Y (C1) t")
# Below 1e6 mm, in steps of 0.0001 mm.
MOST = 10**10 - 1


@settings(max_examples=30, deadline=None)
@given(
    st.integers(-MOST, MOST // 2),
    st.lists(st.integers(10, MOST // 8), max_size=2),
    st.one_of(st.none(), st.integers(1, MOST)),
    st.integers(4, 9),
)
def test_the_name_of_a_step_is_read_as_the_same_step(
    first: int, gaps: list[int], width: int | None, digits: int
) -> None:
    chosen = list(accumulate(gaps, initial=first))
    over = "" if width is None else f"{Decimal(width) / 10**4:f}mm"
    written = ", ".join(f"{Decimal(place) / 10**4:.{digits}f}" for place in chosen)
    effect = parse_effect(f"EXX:step{over}({written})", CHAIN)
    again = parse_effect(effect.text, CHAIN)
    assert (again, again.text) == (effect, effect.text)
    assert again.shape.readings == tuple(place / 10**4 for place in chosen)  # type: ignore[union-attr]
    assert len(set(again.shape.labels)) == len(chosen)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("step(12.0)", "step(12)"),
        ("step( 120 , 300 )", "step(120,300)"),
        ("step(-0)", "step(0)"),
        ("step(-0.00001)", "step(0)"),
        ("step(007)", "step(7)"),
        ("step12340.0mm(123456.78910)", "step12340mm(123456.7891)"),
    ],
)
def test_a_step_has_one_name(written: str, name: str) -> None:
    assert parse_effect(f"EXX:{written}", CHAIN).text == f"EXX:{name}"
