"""The complete and minimal set of location errors and gains of a chain, and that nothing is missing from it."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.machine import (
    COMPONENTS,
    LOCATION,
    MOTION,
    evaluate,
    parse_term,
    parse_topology,
    touching_positions,
)
from monitor.methods.base_effects import base_effects
from monitor.records import Array

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
