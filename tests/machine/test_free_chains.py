"""Axes placed freely: the same chain code as the letters, against matrices of another make and a published robot."""

from __future__ import annotations

import importlib
import re
from types import ModuleType

import numpy as np
import pytest

from monitor.exceptions import EffectError, TopologyError
from monitor.machine import chain_of_axes, evaluate, gravity_in_joint_frames, parse_term, parse_topology
from monitor.machine.chain import rotation_about
from monitor.records import ChainAxis

LETTERS = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
# P. Corke, Robotics, Vision and Control, 2nd edition 2017, 7.1 and 7.2: the Puma 560 in standard Denavit-Hartenberg
# parameters, a, d in m, alpha in rad.
PUMA_A = (0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0)
PUMA_D = (0.0, 0.0, 0.15005, 0.4318, 0.0, 0.0)
PUMA_ALPHA = (np.pi / 2, 0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, 0.0)
# The same axes as a machine file would place them, worked out by hand from the figure of the robot at zero.
PUMA = tuple(
    ChainAxis(f"J{number}", "rotary", "tool", direction, offset)
    for number, (direction, offset) in enumerate(
        [
            ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
            ((0.0, -1.0, 0.0), (0.0, 0.0, 0.0)),
            ((0.0, -1.0, 0.0), (431.8, 0.0, 0.0)),
            ((0.0, 0.0, 1.0), (20.3, -150.05, 0.0)),
            ((0.0, -1.0, 0.0), (0.0, 0.0, 431.8)),
            ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
        ],
        start=1,
    )
)


@pytest.fixture(scope="module")
def robot(simulator: ModuleType) -> ModuleType:
    """The simulator of any serial chain."""
    return importlib.import_module(f"{simulator.__name__}.robot")


def tip_of(chain, degrees) -> np.ndarray:
    """Where the origin of the last joint's frame is, by readings (n, J) in degrees."""
    positions = np.deg2rad(degrees) * [joint.sign for joint in chain.joints]
    none = np.zeros((len(positions), len(chain.joints), 2, 6))
    return evaluate(chain, positions, none, np.zeros(3), np.zeros(3)).residual


def denavit_hartenberg(degrees) -> np.ndarray:
    """The flange's place (3,) in mm, by the product of Denavit and Hartenberg's matrices."""
    product = np.eye(4)
    for theta, a, d, alpha in zip(np.deg2rad(degrees), PUMA_A, PUMA_D, PUMA_ALPHA, strict=True):
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        product = product @ [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    return 1e3 * product[:3, 3]


@pytest.mark.parametrize(
    ("degrees", "published_m"),
    [
        # Printed in 7.2.1 of the book as fkine(qz), fkine(qr) and fkine(qn), to four digits.
        ((0, 0, 0, 0, 0, 0), (0.4521, -0.1500, 0.4318)),
        ((0, 90, -90, 0, 0, 0), (0.0203, -0.1500, 0.8636)),
        ((0, 45, 180, 0, 45, 0), (0.5963, -0.1501, -0.01435)),
    ],
)
def test_corke_2017_7_2_published_poses_of_the_puma_560(degrees, published_m):
    found = tip_of(chain_of_axes(PUMA), np.array([degrees], dtype=float))[0]
    np.testing.assert_allclose(found / 1e3, published_m, atol=1.01e-4)


def test_corke_2017_7_1_any_pose_agrees_with_denavit_and_hartenberg():
    degrees = np.random.default_rng(1).uniform(-180.0, 180.0, (50, 6))
    expected = np.array([denavit_hartenberg(row) for row in degrees])
    np.testing.assert_allclose(tip_of(chain_of_axes(PUMA), degrees), expected, atol=1e-9)


def any_axes(rng: np.random.Generator, work: int, tool: int) -> tuple[ChainAxis, ...]:
    """Axes of any kind, direction and place."""
    made = []
    for number in range(work + tool):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        made.append(
            ChainAxis(
                f"J{number + 1}",
                "linear" if rng.random() < 0.3 else "rotary",
                "work" if number < work else "tool",
                tuple(direction.tolist()),
                tuple(rng.uniform(-500.0, 500.0, 3).tolist()),
                int(rng.choice([-1, 1])),
            )
        )
    return tuple(made)


@pytest.mark.parametrize(("work", "tool"), [(0, 6), (0, 9), (2, 6), (3, 3), (4, 0), (0, 1)])
def test_any_chain_agrees_with_matrices_of_another_make(robot, work, tool):
    rng = np.random.default_rng(100 * work + tool)
    axes = any_axes(rng, work, tool)
    chain = chain_of_axes(axes)
    count = 20
    readings = {axis.name: rng.uniform(-3.0, 3.0, count) for axis in axes}
    errors = rng.normal(0.0, 0.02, (count, len(axes), 2, 6))
    target, tip = rng.uniform(-100.0, 100.0, (count, 3)), rng.uniform(-100.0, 100.0, 3)
    joints = [
        {"name": a.name, "kind": a.kind, "axis": a.direction, "offset": a.offset, "sign": a.sign}
        for a in axes
    ]
    location = {axis.name: errors[:, place, 0] for place, axis in enumerate(axes)}
    motion = {axis.name: errors[:, place, 1] for place, axis in enumerate(axes)}
    ends = []
    for part in (joints[:work], joints[work:]):
        made = robot.frames(part, readings, location, motion) if part else []
        ends.append(made[-1] if made else np.tile(np.eye(4), (count, 1, 1)))
    in_bed = robot.point(ends[1], tip)
    expected = robot.point(np.linalg.inv(ends[0]), in_bed) - target
    positions = np.stack([joint.sign * readings[joint.name] for joint in chain.joints], axis=1)
    seen = evaluate(chain, positions, errors, target, tip, jacobian=True)
    np.testing.assert_allclose(seen.residual, expected, atol=1e-9)
    # The analytic Jacobian against differences, for every error of every joint.
    step = 1e-6
    for place in range(len(axes)):
        for stage in range(2):
            for component in range(6):
                high, low = errors.copy(), errors.copy()
                high[:, place, stage, component] += step
                low[:, place, stage, component] -= step
                slope = (
                    evaluate(chain, positions, high, target, tip).residual
                    - evaluate(chain, positions, low, target, tip).residual
                ) / (2 * step)
                np.testing.assert_allclose(
                    seen.by_error[:, :, place, stage, component], slope, rtol=1e-6, atol=1e-4
                )


def test_letters_are_a_short_form_of_the_tables():
    text = "w C B X b Z Y (C1) t"
    kinds = {"X": "linear", "Y": "linear", "Z": "linear", "B": "rotary", "C": "rotary", "C1": "spindle"}
    about = {"B": "Y", "C": "Z", "C1": "Z"}
    axes = [
        ChainAxis(name, kinds[name], branch, LETTERS[about.get(name, name)])
        for branch, names in (("work", "X B C"), ("tool", "Z Y C1"))
        for name in names.split()
    ]
    assert chain_of_axes(axes) == parse_topology(text)
    assert chain_of_axes(axes, {"X": 1}) == parse_topology(text, {"X": 1})


def test_an_axis_against_x_y_or_z_is_the_same_axis_with_the_other_sign():
    one = chain_of_axes([ChainAxis("J1", "rotary", "tool", (0.0, 0.0, -1.0), sign=1)])
    other = chain_of_axes([ChainAxis("J1", "rotary", "tool", (0.0, 0.0, 1.0), sign=-1)])
    assert one == other
    assert one.joints[0].direction == (0.0, 0.0, 1.0)


def test_gravity_of_the_machine_file_wins():
    axes = [ChainAxis("J1", "rotary", "tool", (0.0, 1.0, 0.0))]
    assert chain_of_axes(axes).gravity == (0.0, 0.0, -1.0)
    hanging = chain_of_axes(axes, gravity=(0.0, 0.0, 1.0))
    np.testing.assert_allclose(
        gravity_in_joint_frames(hanging, np.array([[np.pi / 2]]))[0, 0],
        rotation_about((0.0, 1.0, 0.0), np.array(np.pi / 2)).T @ [0.0, 0.0, 1.0],
        atol=1e-15,
    )
    assert parse_topology("w X b Y t", gravity=(1.0, 0.0, 0.0)).gravity == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("component", "XYZABC")
@pytest.mark.parametrize("name", ["J1", "J11", "rail", "A", "C1"])
def test_every_term_exists_for_every_joint(component, name):
    names = ["J1", "J11", "J", "rail", "A", "C1", "C"]
    chain = chain_of_axes([ChainAxis(one, "rotary", "tool", LETTERS["Z"]) for one in names])
    for stage, zero in ((0, "0"), (1, "")):
        term = parse_term(f"E{component}{zero}{name}", chain)
        assert chain.joints[term.joint].name == name
        assert (term.stage, "XYZABC"[term.component]) == (stage, component)


def test_a_term_of_no_joint_is_refused_with_those_there_are():
    with pytest.raises(
        EffectError, match=re.escape("one of its axes J1, J2, J3, J4, J5, J6, for example EX0J6")
    ):
        parse_term("EXJ7", chain_of_axes(PUMA))


@pytest.mark.parametrize(
    ("axis", "words"),
    [
        (
            ChainAxis("J1", "rotary", "tool", (0.0, 0.6, 0.6)),
            "axis J1: its direction [0.0, 0.6, 0.6] is no unit",
        ),
        (ChainAxis("J1", "rotary", "tool", (0.0, 0.0, 1.0), sign=2), "axis J1: sign must be +1 or -1, not 2"),
    ],
)
def test_refusals_of_an_axis_say_what_would_be_right(axis, words):
    with pytest.raises(TopologyError, match=re.escape(words)):
        chain_of_axes([axis])
