"""Where the linear axes must stand so that the tip touches: a zero vector, and the simulator's own readings."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.machine import evaluate, parse_topology, touching_positions

FIVE_AXES = [
    "w C B X b Z Y (C1) t",
    "w C A Y X b Z (C1) t",
    "w C A b X Y Z (C1) t",
    "w X b Y Z C B (C1) t",
    "w b X Y Z t",
    "w U X Y b Z C t",
]


@pytest.mark.parametrize(("turn", "shift"), [(0.0, 0.0), (20e-6, 0.01), (1e-3, 5.0)])
@pytest.mark.parametrize("topology", FIVE_AXES)
def test_the_tip_sits_on_the_target(topology: str, turn: float, shift: float) -> None:
    chain = parse_topology(topology)
    rng = np.random.default_rng(1)
    joints, count = len(chain.joints), 9
    start = np.where([joint.turns for joint in chain.joints], rng.uniform(-3.0, 3.0, (count, joints)), 0.0)
    errors = rng.uniform(-1.0, 1.0, (count, joints, 2, 6)) * np.repeat([shift, turn], 3)
    target, tip = rng.uniform(-150.0, 150.0, (count, 3)), rng.uniform(-150.0, 150.0, 3)
    found = touching_positions(chain, start, errors, target, tip)
    # A touch that is exact to a nanometre is a hundred times finer than a controller prints.
    assert np.abs(evaluate(chain, found, errors, target, tip).residual).max() < 1e-6
    turning = [joint.turns for joint in chain.joints]
    np.testing.assert_array_equal(found[:, turning], start[:, turning])


def test_the_simulator_reads_the_same_positions(simulator: ModuleType) -> None:
    rng = np.random.default_rng(2)
    plan, schedule = simulator.five_days_plan(), simulator.working_days(rng, 1, 1)
    machine = simulator.hu40()
    told = simulator.simulate(plan, machine, schedule, rng, 0.0, decimals=None)
    chain = parse_topology(machine.topology, {name: int(sign) for name, sign in machine.signs.items()})
    exact = np.column_stack(
        [
            np.radians(told["exact"][joint.name]) if joint.turns else told["exact"][joint.name]
            for joint in chain.joints
        ]
    )
    start = exact * [joint.turns for joint in chain.joints]
    errors = np.zeros((len(exact), len(chain.joints), 2, 6))
    for text, value in machine.terms.items():
        symbol = text.partition(":")[0]
        component, located, name = "XYZABC".index(symbol[1]), symbol[2] == "0", symbol[2:].lstrip("0")
        place = chain.index(name)
        # A gain stands at the exact position: the errors are evaluated where the axis is.
        errors[:, place, int(not located), component] = value * (1.0 if located else exact[:, place])
    target = np.array([told["balls"][name] for name in told["target"]])
    found = touching_positions(chain, start, errors, target, told["tip_mm"])
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-8)


def test_fewer_than_three_linear_axes_cannot_touch() -> None:
    chain = parse_topology("w C X b Z t")
    with pytest.raises(DataError, match="has 2 linear axes; a touch needs three to reach its target"):
        touching_positions(chain, np.zeros((1, 3)), np.zeros((1, 3, 2, 6)), np.zeros((1, 3)), np.zeros(3))


def test_axes_in_one_plane_cannot_reach_every_target() -> None:
    chain = parse_topology("w X b U Y t")
    with pytest.raises(DataError, match=r"cannot reach every target: 7 mm are left"):
        touching_positions(
            chain, np.zeros((1, 3)), np.zeros((1, 3, 2, 6)), np.array([[1.0, 2.0, 7.0]]), np.zeros(3)
        )
