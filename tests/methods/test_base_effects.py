"""The complete and minimal set of location errors and gains of a chain, and that nothing is missing from it."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.machine import (
    COMPONENTS,
    LOCATION,
    MOTION,
    Chain,
    chain_of_axes,
    evaluate,
    parse_term,
    parse_topology,
    touching_positions,
)
from monitor.methods.chain.base_effects import base_effects
from monitor.records import Array, ChainAxis

# In the order of the conventions, section What SAMBA identifies; EXX is the first-order term of its motion.
THIRTEEN = (
    *("EA0B", "EC0B", "EX0C", "EA0C", "EB0C", "EB0Z", "EA0Y", "EC0Y", "EX0C1", "EY0C1"),
    *("EXX:poly1", "EYY:poly1", "EZZ:poly1"),
)
CHAINS = {
    "w C B X b Z Y (C1) t": 13,
    "w C A Y X b Z (C1) t": 13,
    "w C A b X Y Z (C1) t": 13,
    "w X b Y Z C B (C1) t": 13,
    "w b X Y Z C B (C1) t": 13,
    "w C b X Y Z B (C1) t": 13,
    "w C B X b Z Y t": 11,
}


def columns_of(topology: str, seed: int) -> tuple[Array, dict[tuple[str, int], Array]]:
    """Nuisance and gains (m, p), and every location error's column (m,), at poses of this test's own."""
    chain = parse_topology(topology)
    rng = np.random.default_rng(seed)
    poses, balls = 60, 5
    turning = np.array([joint.turns for joint in chain.joints])
    spread = np.where(turning, 1.4, 0.0)
    positions = np.repeat(rng.uniform(-spread, spread, (poses, len(turning))), balls, axis=0)
    target = np.tile(rng.uniform(-200.0, 200.0, (balls, 3)), (poses, 1))
    tip, none = np.array([0.0, 0.0, -120.0]), np.zeros((len(target), len(turning), 2, 6))
    positions = touching_positions(chain, positions, none, target, tip)
    seen = evaluate(chain, positions, none, target, tip, jacobian=True)
    assert seen.by_error is not None
    ball = np.zeros((len(target), 3, 3 * balls))
    for row in range(len(target)):
        ball[row, :, 3 * (row % balls) : 3 * (row % balls) + 3] = -np.eye(3)
    gains = [
        seen.by_error[:, :, place, MOTION, joint.direction.index(1.0)] * positions[:, place, None]
        for place, joint in enumerate(chain.joints)
        if not joint.turns
    ]
    known = np.concatenate([ball, seen.by_tip, np.stack(gains, axis=-1)], axis=-1).reshape(
        3 * len(target), -1
    )
    every = {
        (joint.name, component): seen.by_error[:, :, place, LOCATION, component].reshape(-1)
        for place, joint in enumerate(chain.joints)
        for component in range(6)
    }
    return known, every


def rank(columns: list[Array]) -> int:
    table = np.column_stack(columns)
    norms = np.linalg.norm(table, axis=0)
    return int(np.linalg.matrix_rank(table / np.where(norms > 0, norms, 1.0), tol=1e-9))


def test_conventions_samba_identifies_thirteen_in_this_order() -> None:
    assert base_effects(parse_topology("w C B X b Z Y (C1) t")) == THIRTEEN


@pytest.mark.parametrize("topology", CHAINS)
def test_the_set_is_of_full_rank_and_nothing_can_be_added(topology: str) -> None:
    chain = parse_topology(topology)
    effects = base_effects(chain)
    assert len(effects) == CHAINS[topology]
    known, every = columns_of(topology, seed=11)
    terms = [parse_term(text, chain) for text in effects if ":" not in text]
    chosen = [every[(chain.joints[term.joint].name, term.component)] for term in terms]
    plain = rank([known])
    assert rank([known, *chosen]) == plain + len(chosen)
    # A turn of the spindle's axis shows on a stylus off that axis only; the conventions leave it out.
    rest = [
        v for (name, component), v in every.items() if component < 3 or chain.joint(name).kind != "spindle"
    ]
    assert rank([known, *rest]) == plain + len(chosen)


@pytest.mark.parametrize("topology", CHAINS)
def test_signs_do_not_change_the_set(topology: str) -> None:
    names = [joint.name for joint in parse_topology(topology).joints]
    assert base_effects(parse_topology(topology, dict.fromkeys(names, -1))) == base_effects(
        parse_topology(topology)
    )


@pytest.mark.parametrize("topology", CHAINS)
def test_every_linear_axis_has_its_gain_and_the_frame_has_no_error(topology: str) -> None:
    chain = parse_topology(topology)
    effects = base_effects(chain)
    assert effects[-3:] == ("EXX:poly1", "EYY:poly1", "EZZ:poly1")
    frame = (chain.work or chain.tool)[0].name
    assert [
        text for text in effects if text[1:3] in {f"{c}0" for c in COMPONENTS} and text[3:] == frame
    ] == []


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# An elbow robot: parallel shoulder and elbow, an in-line wrist.
ELBOW = (
    (Z, (0, 0, 290)),
    (Y, (0, 0, 0)),
    (Y, (0, 0, 270)),
    (X, (0, 0, 70)),
    (Y, (302, 0, 0)),
    (X, (72, 0, 0)),
)
# A selective compliance arm: three parallel turning axes and a lift.
SCARA = ((Z, (0, 0, 0)), (Z, (250, 0, 0)), (Z, (0, 0, 0)), (Z, (200, 0, 0)))
# A collaborating arm of seven joints.
SEVEN = tuple((Z if place % 2 == 0 else Y, (0, 0, 200)) for place in range(7))


def free_chain(
    rows: tuple[tuple[tuple[float, ...], tuple[int, ...]], ...], linear: tuple[int, ...] = ()
) -> Chain:
    return chain_of_axes(
        [
            ChainAxis(
                f"J{n + 1}",
                "linear" if n in linear else "rotary",
                "tool",
                direction,
                tuple(map(float, offset)),
            )
            for n, (direction, offset) in enumerate(rows)
        ]
    )


@pytest.mark.parametrize(
    "chain",
    [
        free_chain(ELBOW),
        free_chain(SEVEN),
        free_chain(SCARA, (2,)),
        free_chain(((Y, (0, 0, 0)), *ELBOW), (0,)),
        free_chain(((Y, (0, 0, 0)), (X, (0, 0, 0)), *ELBOW[:3]), (0, 1)),
    ],
    ids=["elbow", "seven", "scara", "elbow on a rail", "two rails"],
)
def test_everett_1987_four_numbers_a_rotary_joint_and_two_a_linear_one(chain: Chain) -> None:
    effects = base_effects(chain)
    # Independent of each other and of frame, points and gains, at poses of this test's own; and none can be added.
    rng = np.random.default_rng(5)
    poses, points = 80, 3
    turning = np.array([joint.turns for joint in chain.joints])
    spread = np.where(turning, 2.5, 400.0)
    positions = np.repeat(rng.uniform(-spread, spread, (poses, len(turning))), points, axis=0)
    tip = np.tile(rng.uniform(-200.0, 200.0, (points, 3)), (poses, 1))
    none = np.zeros((len(tip), len(turning), 2, 6))
    seen = evaluate(chain, positions, none, np.zeros(3), tip, jacobian=True)
    assert seen.by_error is not None
    place = np.zeros((len(tip), 3, 3 * points))
    for row in range(len(tip)):
        place[row, :, 3 * (row % points) : 3 * (row % points) + 3] = seen.by_tip[row]
    turned = np.stack([np.cross(np.eye(3)[axis], seen.residual) for axis in range(3)], axis=-1)
    frame = np.concatenate([np.tile(np.eye(3), (len(tip), 1, 1)), turned], axis=-1)
    gains = [
        (seen.by_error[:, :, joint, MOTION, chain.joints[joint].main] * positions[:, joint, None]).reshape(-1)
        for joint in np.flatnonzero(~turning)
    ]
    known = np.concatenate([place, frame], axis=-1).reshape(3 * len(tip), -1)
    every = seen.by_error[:, :, :, LOCATION].reshape(3 * len(tip), -1)
    terms = [parse_term(text, chain) for text in effects if ":" not in text]
    chosen = [seen.by_error[:, :, term.joint, LOCATION, term.component].reshape(-1) for term in terms]
    plain = rank([known, *gains])
    # 4 R + 2 P + 6 with frame and tool; three points have three distances besides, each linear axis a gain.
    whole = 4 * int(turning.sum()) + 2 * len(gains) + 6 + 3 + len(gains)
    assert rank([known, *gains, *chosen]) == plain + len(chosen) == whole
    assert rank([known, *gains, every]) == whole


def test_the_zeros_of_the_joints_between_the_first_and_the_last_are_among_them() -> None:
    assert {"EB0J2", "EB0J3", "EA0J4", "EB0J5"} <= set(base_effects(free_chain(ELBOW)))


def test_a_swivel_head_placed_freely_has_the_errors_of_its_letters() -> None:
    named = dict(zip("XYZCB", (X, Y, Z, Z, Y), strict=True))
    axes = [
        ChainAxis(name, "linear" if name in "XYZ" else "rotary", "tool", direction)
        for name, direction in named.items()
    ]
    assert base_effects(chain_of_axes(axes)) == base_effects(parse_topology("w b X Y Z C B t"))
    # A head that swivels about a slanted axis: as many.
    slanted = [*axes[:-1], ChainAxis("B", "rotary", "tool", (0.0, 2**-0.5, 2**-0.5))]
    assert len(base_effects(chain_of_axes(slanted))) == len(base_effects(chain_of_axes(axes)))
