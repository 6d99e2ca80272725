"""The tip-to-target vector and its Jacobian, against homogeneous 4x4 products written out here.

Conventions, section Chain: each axis adds L_j M_j(q_j) E_j, small rotations multiplied as R_C R_B R_A, and
r = (T_work T_p)^-1 T_tool tip. Nothing of the product's geometry is used to make the expectation.
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from monitor.machine import LOCATION, MOTION, Chain, evaluate, parse_topology
from monitor.machine.chain import rotation_about
from monitor.records import Array

TOPOLOGIES = [
    "w C B X b Z Y (C1) t",
    "w C A Y X b Z (C1) t",
    "w C A b X Y Z (C1) t",
    "w b X Y Z t",
    "w X Y Z b t",
    "w X b Y Z C B (C1) t",
    "w b X Y Z C A t",
    "w B X b Z Y A (C1) t",
    "w X b Y Z (A) t",
    "w A X Y b Z (B1) t",
    "w C b t",
    "w B U b V X W Z (C1) t",
]
# An exact residual differs from another order of the same products by rounding only: 1e-16 times 1 m times
# some tens of operations.
ROUNDING_MM = 1e-10


def _rigid(rotation: Array, translation: Array) -> Array:
    frame = np.eye(4)
    frame[:3, :3] = rotation
    frame[:3, 3] = translation
    return frame


def _small(six: Array) -> Array:
    """R_C R_B R_A is, in scipy's words, extrinsic turns about x, then y, then z."""
    return _rigid(Rotation.from_euler("xyz", six[3:]).as_matrix(), six[:3])


def _motion(name: str, q: float) -> Array:
    along = {"X": 0, "U": 0, "A": 0, "Y": 1, "V": 1, "B": 1, "Z": 2, "W": 2, "C": 2}[name[0]]
    vector = np.eye(3)[along] * q
    if name[0] in "ABC":
        return _rigid(Rotation.from_rotvec(vector).as_matrix(), np.zeros(3))
    return _rigid(np.eye(3), vector)


def explicit(topology: str, q: Array, errors: Array, target: Array, tip: Array) -> Array:
    """One pose: q (J,), errors (J, 2, 6), in the order work branch from the bed, tool branch from the bed."""
    work_text, tool_text = topology[1:-1].split("b")
    work = [part.strip("()") for part in reversed(work_text.split())]
    tool = [part.strip("()") for part in tool_text.split()]
    frames = []
    for names, first in ((work, 0), (tool, len(work))):
        frame = np.eye(4)
        for place, name in enumerate(names, start=first):
            frame = frame @ _small(errors[place, 0]) @ _motion(name, q[place]) @ _small(errors[place, 1])
        frames.append(frame)
    to_target = frames[0] @ _rigid(np.eye(3), target)
    return (np.linalg.inv(to_target) @ frames[1] @ np.append(tip, 1.0))[:3]


def _poses(
    chain: Chain, rng: np.random.Generator, count: int, turn: float, shift: float
) -> tuple[Array, ...]:
    """Random positions, errors, targets and tips; errors up to ``turn`` rad and ``shift`` mm."""
    joints = len(chain.joints)
    reach = np.array([np.pi if joint.turns else 400.0 for joint in chain.joints])
    errors = rng.uniform(-1.0, 1.0, (count, joints, 2, 6)) * np.repeat([shift, turn], 3)
    return (
        rng.uniform(-reach, reach, (count, joints)),
        errors,
        rng.uniform(-200.0, 200.0, (count, 3)),
        rng.uniform(-200.0, 200.0, (count, 3)),
    )


@pytest.mark.parametrize(("turn", "shift"), [(0.0, 0.0), (20e-6, 0.01), (1e-3, 1.0), (0.8, 60.0)])
@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_conventions_chain_equals_explicit_products(topology: str, turn: float, shift: float) -> None:
    chain = parse_topology(topology)
    q, errors, target, tip = _poses(chain, np.random.default_rng(3), 7, turn, shift)
    found = evaluate(chain, q, errors, target, tip)
    expected = [explicit(topology, *pose) for pose in zip(q, errors, target, tip, strict=True)]
    np.testing.assert_allclose(found.residual, expected, rtol=0, atol=ROUNDING_MM)
    assert found.by_error is None


@pytest.mark.parametrize("topology", TOPOLOGIES[:4])
def test_conventions_one_error_alone_equals_explicit_products(topology: str) -> None:
    # The chain leaves out frames without errors: a single non-zero number must bring its frame back.
    chain = parse_topology(topology)
    rng = np.random.default_rng(4)
    q, _, target, tip = (a[0] for a in _poses(chain, rng, 1, 0.0, 0.0))
    for place in range(len(chain.joints)):
        for stage in (LOCATION, MOTION):
            for component in range(6):
                errors = np.zeros((len(chain.joints), 2, 6))
                errors[place, stage, component] = 0.3
                np.testing.assert_allclose(
                    evaluate(chain, q, errors, target, tip).residual,
                    explicit(topology, q, errors, target, tip),
                    rtol=0,
                    atol=ROUNDING_MM,
                )


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("topology", [t for t in TOPOLOGIES if not set("UVW") & set(t)])
def test_the_simulator_sees_the_same_gap(simulator: ModuleType, topology: str, sign: int) -> None:
    names = [joint.name for joint in parse_topology(topology).joints]
    chain = parse_topology(topology, dict.fromkeys(names, sign))
    readings, errors, target, tip = _poses(chain, np.random.default_rng(5), 6, 1e-3, 1.0)
    theirs = simulator.chain.read_topology(topology, dict.fromkeys(names, float(sign)))
    arguments = (
        {name: readings[:, place] for place, name in enumerate(names)},
        {name: errors[:, place, 0] for place, name in enumerate(names)},
        {name: errors[:, place, 1] for place, name in enumerate(names)},
        len(readings),
    )
    work = simulator.chain.branch_matrix(theirs.work, *arguments)
    tool = simulator.chain.branch_matrix(theirs.tool, *arguments)
    gap = simulator.chain.carried(tool, tip) - simulator.chain.carried(work, target)
    ours = evaluate(chain, sign * readings, errors, target, tip)
    np.testing.assert_allclose(ours.work_rotation, work[:, :3, :3], rtol=0, atol=1e-13)
    in_bed = np.einsum("nij,nj->ni", ours.work_rotation, ours.residual)
    np.testing.assert_allclose(in_bed, gap, rtol=0, atol=ROUNDING_MM)


@pytest.mark.parametrize(("turn", "shift"), [(0.0, 0.0), (1e-3, 1.0), (0.5, 30.0)])
@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_jacobian_equals_central_differences_of_every_term(topology: str, turn: float, shift: float) -> None:
    chain = parse_topology(topology)
    q, errors, target, tip = _poses(chain, np.random.default_rng(6), 3, turn, shift)
    seen = evaluate(chain, q, errors, target, tip, jacobian=True)
    assert seen.by_error is not None
    # Steps of 1e-5: truncation h^2/6 of 1 m is 2e-8 mm, rounding 1e-13 mm / h is 1e-8 mm.
    step, agreement = 1e-5, 2e-7
    numeric = np.empty_like(seen.by_error)
    for place in np.ndindex(*errors.shape[1:]):
        moved = np.zeros(errors.shape[1:])
        moved[place] = step
        ahead = evaluate(chain, q, errors + moved, target, tip).residual
        behind = evaluate(chain, q, errors - moved, target, tip).residual
        numeric[(slice(None), slice(None), *place)] = (ahead - behind) / (2 * step)
    np.testing.assert_allclose(seen.by_error, numeric, rtol=0, atol=agreement)
    for axis in range(3):
        unit = np.eye(3)[axis]
        plus = evaluate(chain, q, errors, target, tip + unit).residual
        np.testing.assert_allclose(seen.by_tip[:, :, axis], plus - seen.residual, rtol=0, atol=ROUNDING_MM)
        farther = evaluate(chain, q, errors, target + unit, tip).residual
        np.testing.assert_allclose(farther - seen.residual, -np.tile(unit, (3, 1)), rtol=0, atol=ROUNDING_MM)


def test_poses_runs_and_trials_broadcast() -> None:
    topology = TOPOLOGIES[0]
    chain = parse_topology(topology)
    rng = np.random.default_rng(7)
    q, _, target, _ = _poses(chain, rng, 5, 0.0, 0.0)
    _, errors, _, tip = _poses(chain, rng, 4, 1e-2, 1.0)
    seen = evaluate(chain, q, errors[:, None], target, tip[:, None], jacobian=True)
    assert seen.residual.shape == (4, 5, 3)
    assert seen.by_error is not None
    assert seen.by_error.shape == (4, 5, 3, 6, 2, 6)
    for trial in range(4):
        one = evaluate(
            chain, q, np.broadcast_to(errors[trial], (5, 6, 2, 6)), target, tip[trial], jacobian=True
        )
        np.testing.assert_allclose(seen.residual[trial], one.residual, rtol=0, atol=ROUNDING_MM)
        assert one.by_error is not None
        np.testing.assert_allclose(seen.by_error[trial], one.by_error, rtol=0, atol=ROUNDING_MM)


def test_targets_alone_may_have_more_dimensions() -> None:
    chain = parse_topology(TOPOLOGIES[1])
    q, errors, target, tip = _poses(chain, np.random.default_rng(8), 6, 1e-2, 1.0)
    seen = evaluate(chain, q[0], errors[0], target, tip[0], jacobian=True)
    assert seen.by_error is not None
    assert seen.by_error.shape == (6, 3, 6, 2, 6)
    for row in range(6):
        one = evaluate(chain, q[0], errors[0], target[row], tip[0], jacobian=True)
        np.testing.assert_array_equal(seen.residual[row], one.residual)
        np.testing.assert_array_equal(seen.by_error[row], one.by_error)


def test_no_poses_give_no_vectors() -> None:
    chain = parse_topology(TOPOLOGIES[0])
    seen = evaluate(
        chain, np.zeros((0, 6)), np.zeros((0, 6, 2, 6)), np.zeros((0, 3)), np.zeros(3), jacobian=True
    )
    assert seen.residual.shape == (0, 3)
    assert seen.by_error is not None
    assert seen.by_error.shape == (0, 3, 6, 2, 6)


def test_the_inputs_are_left_alone() -> None:
    chain = parse_topology(TOPOLOGIES[0])
    given_ = _poses(chain, np.random.default_rng(9), 4, 1e-2, 1.0)
    before = [values.copy() for values in given_]
    evaluate(chain, *given_, jacobian=True)
    for values, kept in zip(given_, before, strict=True):
        np.testing.assert_array_equal(values, kept)


numbers = st.floats(-1.0, 1.0, allow_nan=False)
PROPERTY = settings(max_examples=60, deadline=None, derandomize=True, database=None)


@PROPERTY
@given(angle=st.floats(-50.0, 50.0), direction=st.tuples(numbers, numbers, numbers))
def test_rodrigues_turns_properly_and_leaves_its_axis(
    angle: float, direction: tuple[float, float, float]
) -> None:
    length = float(np.linalg.norm(direction))
    unit = (0.0, 0.0, 1.0) if length < 0.1 else tuple(float(v) / length for v in direction)
    turned = rotation_about((unit[0], unit[1], unit[2]), np.array(angle))
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), rtol=0, atol=1e-13)
    assert np.linalg.det(turned) == pytest.approx(1.0, abs=1e-13)
    np.testing.assert_allclose(turned @ unit, unit, rtol=0, atol=1e-13)


@PROPERTY
@given(seed=st.integers(0, 2**32 - 1), topology=st.sampled_from(TOPOLOGIES[:4] + TOPOLOGIES[5:10]))
def test_a_motion_of_the_whole_machine_changes_nothing(seed: int, topology: str) -> None:
    # The bed's frame is a choice: the same frame before both branches drops out of r.
    chain = parse_topology(topology)
    rng = np.random.default_rng(seed)
    q, errors, target, tip = (a[0] for a in _poses(chain, rng, 1, 0.3, 20.0))
    firsts = [0, len(chain.work)] if chain.work else [0]
    for first in firsts:
        errors[first, LOCATION] = 0.0
    plain = evaluate(chain, q, errors, target, tip).residual
    moved = errors.copy()
    for first in firsts:
        moved[first, LOCATION] = rng.uniform(-1.0, 1.0, 6) if first == 0 else moved[0, LOCATION]
    after = evaluate(chain, q, moved, target, tip).residual
    if len(firsts) == 2:
        np.testing.assert_allclose(after, plain, rtol=0, atol=ROUNDING_MM)
    else:
        # With an empty work branch the frame is the target's own: the machine has moved against it.
        assert np.abs(after - plain).max() > 1e-3


@PROPERTY
@given(seed=st.integers(0, 2**32 - 1), topology=st.sampled_from(TOPOLOGIES))
def test_a_shift_of_the_target_is_subtracted(seed: int, topology: str) -> None:
    chain = parse_topology(topology)
    rng = np.random.default_rng(seed)
    q, errors, target, tip = (a[0] for a in _poses(chain, rng, 1, 0.3, 20.0))
    shift = rng.uniform(-5.0, 5.0, 3)
    before = evaluate(chain, q, errors, target, tip).residual
    after = evaluate(chain, q, errors, target + shift, tip).residual
    np.testing.assert_allclose(before - after, shift, rtol=0, atol=ROUNDING_MM)
