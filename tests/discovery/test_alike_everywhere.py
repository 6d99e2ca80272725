"""Shifts that no pose tells apart, against matrices of rotation that share no code with the package.

The machine is the example of rotary probing, ``w C A Y b X Z t``: the table tilts about X (A) and turns about Z (C).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.discovery import fit
from monitor.discovery.machine.separation.alike import moves_alike
from monitor.discovery.machine.separation.separate import separating_poses
from monitor.effects import parse_effect
from monitor.machine import chain_of_axes
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import ChainAxis

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "tilting-table"
DIRECTIONS = dict(zip("XYZ", np.eye(3), strict=True))


@pytest.fixture(scope="module")
def fitted():
    campaign = read_campaign(EXAMPLE)
    return fit(campaign_method(campaign).problem_of(campaign))


#: Axes of the table that a shift of a place turns with, seen from the bed: those that stand after it turn it.
TURNS_AFTER = {"0A": "AC", "A": "C", "0C": "C", "C": "", "X": "AC", "Y": "AC", "Z": "AC"}


def seen_from_table(text: str, a: np.ndarray, c: np.ndarray) -> np.ndarray:
    """How a shift moves the tip as the table sees it (n, 3), but for its sign: what stands between it and the table
    turns it."""
    place = text.partition(":")[0].partition("@")[0][2:]
    vector = np.tile(DIRECTIONS[text[1]], (len(a), 1))
    for axis, along, angle in (("A", "X", a), ("C", "Z", c)):
        if axis in TURNS_AFTER[place]:
            vector = Rotation.from_rotvec(np.outer(angle, DIRECTIONS[along])).apply(vector)
    return vector


@pytest.mark.parametrize(
    ("effect", "rival"),
    [
        ("EZ0A@warmup20min", "EZZ:const@warmup20min"),
        ("EY0A@warmup20min", "EYY:const@warmup20min"),
        ("EX0C@warmup20min", "EXA:const@warmup20min"),
        ("EX0C@warmup20min", "EXX:const@warmup20min"),
        ("EY0C@warmup20min", "EYY:const@warmup20min"),
        ("EZ0A@warmup20min", "EZC:const@warmup20min"),
        ("EZZ:const@warmup20min", "EYY:const@warmup20min"),
    ],
)
def test_shifts_are_alike_where_the_matrices_say_so(fitted, effect: str, rival: str) -> None:
    """EZ0A and a growth of Z: "index A and Z to other angles" was advised, which nothing comes of."""
    rng = np.random.default_rng(4)
    a, c = rng.uniform(-1.5, 1.5, 50), rng.uniform(-3.0, 3.0, 50)
    first, second = (seen_from_table(text, a, c) for text in (effect, rival))
    size = np.sum(first * second) / np.sum(second**2)
    alike = bool(np.abs(first - size * second).max() < 1e-9)
    parsed = [parse_effect(text, fitted.problem.context.chain) for text in (effect, rival)]
    separation = separating_poses(fitted, parsed[0], np.array([0.006]), parsed[1:])
    assert separation.together == (((effect, rival),) if alike else ())


@pytest.mark.parametrize(
    ("rival", "alike"),
    [("EAA:const@warmup20min", True), ("EBA:const@warmup20min", False), ("EAC:const@warmup20min", False)],
)
def test_turns_about_one_line_are_alike(fitted, rival: str, alike: bool) -> None:
    """What a turn does depends on where is touched, too: the zero of A and a turn about A are one for all of that."""
    effect, other = (parse_effect(text, fitted.problem.context.chain) for text in ("EA0A@warmup20min", rival))
    separation = separating_poses(fitted, effect, np.array([1e-5]), [other])
    assert separation.together == ((("EA0A@warmup20min", rival),) if alike else ())


@pytest.mark.parametrize("driver", ["harmonic1", "compliance@gravity"])
@pytest.mark.parametrize("offset_mm", [0.0, 5.0])
def test_a_shoulder_on_the_line_of_the_base_is_told_by_no_pose(fitted, driver: str, offset_mm: float) -> None:
    """EBJ1 turns J1's arm about its Y axis, EBJ2 the shoulder about its own, which stands on that line or beside it."""
    chain = chain_of_axes(
        [
            ChainAxis("J1", "rotary", "tool", (0.0, 0.0, 1.0), (0.0, 0.0, 200.0)),
            ChainAxis("J2", "rotary", "tool", (0.0, 1.0, 0.0), (offset_mm, 0.0, 0.0)),
            ChainAxis("J3", "rotary", "tool", (0.0, 1.0, 0.0), (0.0, 0.0, 250.0)),
        ],
        {}, (0.0, 0.0, -1.0),
    )  # fmt: skip
    context = replace(fitted.problem.context, chain=chain)
    base, shoulder, elbow = (parse_effect(f"EB{joint}:{driver}", chain) for joint in ("J1", "J2", "J3"))
    coefficients = np.array([1e-5, 2e-5])[: 2 if driver == "harmonic1" else 1]
    # A harmonic goes with the angle of its own joint, a compliance with the torque about its line.
    assert moves_alike(context, base, coefficients, shoulder, {}) == (driver[0] == "c" and offset_mm == 0.0)
    assert not moves_alike(context, shoulder, coefficients, elbow, {})
