"""Topology strings of the conventions, section Chain: every machine that must work, every refusal by its words."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings, strategies as st

from monitor.exceptions import TopologyError
from monitor.machine import parse_topology

HU40 = "w C B X b Z Y (C1) t"


def test_conventions_work_branch_reads_from_the_bed_outwards() -> None:
    chain = parse_topology(HU40)
    assert [joint.name for joint in chain.work] == ["X", "B", "C"]
    assert [joint.name for joint in chain.tool] == ["Z", "Y", "C1"]
    assert [joint.name for joint in chain.joints] == ["X", "B", "C", "Z", "Y", "C1"]
    assert [joint.kind for joint in chain.joints] == [
        "linear",
        "rotary",
        "rotary",
        "linear",
        "linear",
        "spindle",
    ]


def test_iso841_signs_without_a_machine_file() -> None:
    assert [joint.sign for joint in parse_topology(HU40).joints] == [-1, -1, -1, 1, 1, 1]


def test_signs_of_the_machine_file_win() -> None:
    chain = parse_topology(HU40, {"X": 1, "Y": -1, "C1": -1})
    assert [joint.sign for joint in chain.joints] == [1, -1, -1, 1, -1, -1]


def test_iso841_letters_and_directions() -> None:
    chain = parse_topology("w A U b V W B C12 t")
    assert {joint.name: joint.direction for joint in chain.joints} == {
        "U": (1.0, 0.0, 0.0),
        "A": (1.0, 0.0, 0.0),
        "V": (0.0, 1.0, 0.0),
        "W": (0.0, 0.0, 1.0),
        "B": (0.0, 1.0, 0.0),
        "C12": (0.0, 0.0, 1.0),
    }


def test_spindle_may_turn_about_x_or_y() -> None:
    assert parse_topology("w X b Y Z (A) t").joint("A").kind == "spindle"
    assert parse_topology("w X b Y Z (B2) t").joint("B2").direction == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("text", ["wCBXbZY(C1)t", "  w C  B X b\tZ Y (C1) t ", HU40])
def test_spaces_do_not_matter(text: str) -> None:
    chain = parse_topology(text)
    assert chain.topology == HU40
    assert chain == parse_topology(HU40)


@pytest.mark.parametrize("text", ["w b X Y Z t", "w X Y Z b t", "w C b t"])
def test_a_branch_may_be_empty(text: str) -> None:
    assert {len(parse_topology(text).work), len(parse_topology(text).tool)} >= {0}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must name w (workpiece), b (bed) and t (tool) once each"),
        ("w X Y Z t", "must name w (workpiece), b (bed) and t (tool) once each"),
        ("w X b b Y t", "must name w (workpiece), b (bed) and t (tool) once each"),
        ("X w b Y t", "must begin with w and end with t"),
        ("w X b Y t Z", "must begin with w and end with t"),
        ("t X b Y w", "must begin with w and end with t"),
        ("w b t", "has no axis"),
        ("w X b Y X t", "axis X appears twice; name each axis once"),
        ("w X b Y C (C) t", "axis C appears twice"),
        ("w x b Y t", "'x' has no meaning here"),
        ("w C B X b Z Y (C1 t", "'(' has no meaning here"),
        ("w X b Y -Z t", "'-' has no meaning here"),
        ("w Q b Y t", "an axis cannot be called Q; the letters are X, Y, Z, U, V, W (linear) and A, B, C"),
        ("w X b Y (Z) t", "a spindle cannot be called Z; the letters are A, B, C"),
        ("w X b (C1) Y t", "the spindle in brackets belongs just before t"),
        ("w (C1) X b Y Z t", "the spindle in brackets belongs just before t"),
        ("w X b Y (C1) (C2) t", "the spindle in brackets belongs just before t"),
    ],
)
def test_refusals_say_what_would_be_right(text: str, words: str) -> None:
    with pytest.raises(TopologyError, match=re.escape(words)):
        parse_topology(text)


@pytest.mark.parametrize("sign", [0, 2, -3])
def test_a_sign_is_plus_or_minus_one(sign: int) -> None:
    with pytest.raises(TopologyError, match=rf"axis Y: sign must be \+1 or -1, not {sign}"):
        parse_topology(HU40, {"Y": sign})


def test_an_unknown_axis_is_refused_with_those_there_are() -> None:
    with pytest.raises(TopologyError, match="has no axis A; it has X, B, C, Z, Y, C1"):
        parse_topology(HU40).index("A")


@pytest.mark.parametrize(
    ("text", "down"),
    [
        (HU40, (0.0, -1.0, 0.0)),
        ("w C A Y X b Z (C1) t", (0.0, 0.0, -1.0)),
        ("w X Y b t", (0.0, 0.0, -1.0)),
        ("w b Z X Y C t", (0.0, -1.0, 0.0)),
    ],
)
def test_gravity_follows_the_linear_axis_next_to_the_tool(
    text: str, down: tuple[float, float, float]
) -> None:
    assert parse_topology(text).gravity == down


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(
    order=st.permutations(["X", "Y", "Z", "A", "C"]),
    bed=st.integers(0, 5),
    spindle=st.booleans(),
)
def test_every_order_of_five_axes_is_read_and_written_back(order: list[str], bed: int, spindle: bool) -> None:
    parts = ["w", *order[:bed], "b", *order[bed:], *(["(C1)"] if spindle else []), "t"]
    chain = parse_topology(" ".join(parts))
    assert chain.topology == " ".join(parts)
    assert [joint.name for joint in chain.work] == order[:bed][::-1]
    assert parse_topology(chain.topology) == chain
    assert [chain.index(joint.name) for joint in chain.joints] == list(range(5 + spindle))


@pytest.mark.parametrize(
    ("code", "letters", "gravity"),
    [
        ("V [w C A Y X b Z S t]", "w C A Y X b Z (C1) t", (0.0, 0.0, -1.0)),
        ("V[w C' A' Y' X' b Z (C1) t]", "w C A Y X b Z (C1) t", (0.0, 0.0, -1.0)),
        ("H [w C2′ B′ X′ b Z Y (S) t]", "w C2 B X b Z Y (C1) t", (0.0, -1.0, 0.0)),
        ("[w X b Y Z C B S1 t]", "w X b Y Z C B (C1) t", None),
        ("w C1 X b Y Z S t", "w C1 X b Y Z (C2) t", None),
    ],
)
def test_iso_10791_6_structural_code_is_the_same_machine(
    code: str, letters: str, gravity: tuple[float, float, float] | None
) -> None:
    chain, plain = parse_topology(code), parse_topology(letters)
    assert chain.topology == plain.topology == letters
    assert chain.joints == plain.joints
    assert chain.gravity == (plain.gravity if gravity is None else gravity)


def test_a_machine_file_says_more_of_gravity_than_the_letter_does() -> None:
    assert parse_topology("V [w X b Y Z S t]", gravity=(0.0, -1.0, 0.0)).gravity == (0.0, -1.0, 0.0)
