"""Shop-floor names against the tables of ISO 230-1:2012 (3.7) and ISO 10791-1, typed by hand; and against the angles
between the axes of a chain that is turned by each of its orientations, computed here with matrices."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest

from monitor.machine import parse_topology
from monitor.methods.chain.base_effects import base_effects
from monitor.reporting.plain_names import plain_name

STANDARD = "w C B X b Z Y (C1) t"
TABLE_ON_BED = "w C b X Y Z (C1) t"
TRUNNION = "w C A Y X b Z (C1) t"
TOPOLOGIES = (
    STANDARD, TABLE_ON_BED, TRUNNION, "w C A b X Y Z (C1) t", "w Y b X Z B (C1) t",
    "w b X Y Z C A (C1) t", "w B b Z X Y (C1) t", "V [w C A Y X b Z S t]",
)  # fmt: skip


def _orientations(topology: str) -> tuple[str, ...]:
    """The orientations that the chain's own model has."""
    return tuple(name for name in base_effects(parse_topology(topology)) if re.fullmatch("E[ABC]0.*", name))


@pytest.mark.parametrize(
    ("topology", "symbol", "name"),
    [
        # Horizontal, table B with C on it, on X; Z and Y carry the tool.
        (STANDARD, "EC0Y", "squareness X-Y"),
        (STANDARD, "EB0Z", "squareness X-Z"),
        (STANDARD, "EA0Y", "squareness Y-Z"),
        (STANDARD, "EA0B", "squareness of axis B to Z"),
        (STANDARD, "EC0B", "squareness of axis B to X"),
        (STANDARD, "EB0C", "squareness of axis C to X"),
        # C is stated relative to B, which carries it: not to Y.
        (STANDARD, "EA0C", "squareness of axis C to axis B"),
        # The table turns on the bed; what the first linear axis is turned by is its angle to the table's axis.
        (TABLE_ON_BED, "EB0X", "squareness of X to axis C"),
        (TABLE_ON_BED, "EC0Y", "squareness X-Y"),
        (TABLE_ON_BED, "EB0Z", "squareness X-Z"),
        # Vertical with a trunnion, A on X and Y, C on A: Z is turned by its own EB0Z, X is not.
        (TRUNNION, "EB0A", "parallelism of axis A to X"),
        (TRUNNION, "EB0C", "squareness of axis C to axis A"),
        # No squareness: positions, zeros, error motions and names that are no symbol stay as a table has them.
        (STANDARD, "EX0C", "position in X of axis C"),
        (STANDARD, "EC0C", "zero angle of axis C"),
        (STANDARD, "EXX", "positioning gain of axis X"),
        (STANDARD, "volumetric", "volumetric"),
        # Without its chain nothing is claimed; nor where letters do not say how an axis lies.
        ("", "EB0X", "orientation about Y of axis X"),
        ("w b J1 J2 t", "EB0X", "orientation about Y of axis X"),
    ],
)
def test_names_of_the_shop_floor(topology: str, symbol: str, name: str) -> None:
    parameters = _orientations(topology) if "J" not in topology and topology else ()
    assert plain_name(symbol, topology, parameters) == name


def _direction(name: str) -> int:
    return {"U": 0, "V": 1, "W": 2, "A": 0, "B": 1, "C": 2, "X": 0, "Y": 1, "Z": 2}[name[0]]


def _turned(topology: str, symbol: str, angle: float) -> dict[str, np.ndarray]:
    """The direction of every axis in the frame of the machine with one orientation at an ``angle``."""
    chain = parse_topology(topology)
    directions = {}
    for branch in (chain.work, chain.tool):
        rotation = np.eye(3)
        for joint in branch:
            if symbol[3:] == joint.name:
                first, second = [k for k in range(3) if k != "ABC".index(symbol[1])]
                step = np.eye(3)
                step[first, first] = step[second, second] = np.cos(angle)
                step[first, second], step[second, first] = -np.sin(angle), np.sin(angle)
                rotation = rotation @ step
            directions[joint.name] = rotation[:, _direction(joint.name)]
    return directions


def _change(topology: str, symbol: str, pair: Sequence[str]) -> float:
    """By how many radians a radian of ``symbol`` changes the angle between two axes."""
    angle = 1e-4
    first, second = (_turned(topology, symbol, angle)[name] for name in pair)
    cosine = abs(first @ second)
    if _direction(pair[0]) == _direction(pair[1]):
        return float(np.linalg.norm(np.cross(first, second)) / angle)
    return float(np.arcsin(cosine) / angle)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_a_named_angle_changes_by_its_parameter_and_by_no_other(topology: str) -> None:
    every = _orientations(topology)
    named = 0
    for symbol in every:
        words = plain_name(symbol, topology, every)
        if words.startswith("orientation"):
            continue
        named += 1
        pair = re.findall(r"\b[A-Z]\d?\b", words)
        assert symbol[3:] in pair
        assert len(pair) == 2
        assert _change(topology, symbol, pair) == pytest.approx(1.0, abs=1e-3)
        # Of two parallel axes both planes count, and the name is of one: those about other directions may move them.
        alike = [other for other in every if other[1] == symbol[1] and other != symbol]
        assert [_change(topology, other, pair) for other in alike] == pytest.approx([0.0] * len(alike))
    assert named >= 2
