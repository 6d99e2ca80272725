"""ISO 230-1 symbols of geometric errors: EA0B is a location error, EYX an error motion."""

from __future__ import annotations

import re

import pytest

from monitor.exceptions import EffectError
from monitor.machine import COMPONENTS, LOCATION, MOTION, parse_term, parse_topology

CHAIN = parse_topology("w C B X b Z Y (C1) t")


@pytest.mark.parametrize("stage", [LOCATION, MOTION])
@pytest.mark.parametrize("component", range(6))
def test_iso230_1_every_symbol_of_every_axis(stage: int, component: int) -> None:
    for place, joint in enumerate(CHAIN.joints):
        symbol = f"E{COMPONENTS[component]}{'0' if stage == LOCATION else ''}{joint.name}"
        term = parse_term(symbol, CHAIN)
        assert (term.symbol, term.joint, term.stage, term.component) == (symbol, place, stage, component)


def test_iso230_1_translations_in_micrometres_rotations_in_microradians() -> None:
    assert {parse_term(f"E{c}X", CHAIN).unit.name for c in "XYZ"} == {"µm"}
    assert {parse_term(f"E{c}0B", CHAIN).unit.name for c in "ABC"} == {"µrad"}
    assert parse_term("EBB", CHAIN).is_rotation
    assert not parse_term("EXC1", CHAIN).is_rotation


def test_the_spindle_is_not_the_c_axis() -> None:
    assert parse_term("EX0C", CHAIN).joint == CHAIN.index("C")
    assert parse_term("EX0C1", CHAIN).joint == CHAIN.index("C1")
    assert parse_term("EXC1", CHAIN).stage == MOTION


def test_numbered_axes_are_told_apart_whatever_their_digits() -> None:
    chain = parse_topology("w C1 C11 X b C Y Z (C111) t")
    assert [parse_term(f"EA0{n}", chain).joint for n in ("C1", "C11", "C", "C111")] == [
        chain.index(n) for n in ("C1", "C11", "C", "C111")
    ]


@pytest.mark.parametrize(
    "symbol", ["", "E", "EA0", "EQ0B", "EA1B", "EA0A", "EXQ", "ea0b", "EA0B ", "EA00B", "A0B"]
)
def test_what_is_no_term_is_refused_with_the_axes_there_are(symbol: str) -> None:
    words = (
        re.escape(f"'{symbol}' is no geometric error of 'w C B X b Z Y (C1) t': ")
        + r"(did you mean 'E[XYZABC]0?[XBCZY1]+'\? )?write E, a direction X Y Z A B C, "
        "0 for a location error, and one of its axes X, B, C, Z, Y, C1, for example EX0C1 or EYX"
    )
    with pytest.raises(EffectError, match=words):
        parse_term(symbol, CHAIN)


def test_an_axis_that_was_left_out_is_named() -> None:
    """``EX`` was answered with EZX."""
    with pytest.raises(EffectError, match=r"'EX' is no geometric error of .*: did you mean 'EXX'\?"):
        parse_term("EX", parse_topology("w C B X b Z Y (C1) t"))
