"""Gravity in the frame of every axis: by hand on the HU40, and against the simulator on other chains."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from monitor.machine import gravity_in_joint_frames, parse_topology

EXACT = 1e-15


def test_hu40_tables_turn_gravity_about_their_own_axes() -> None:
    chain = parse_topology("w C B X b Z Y (C1) t")
    quarter = np.pi / 2
    seen = gravity_in_joint_frames(chain, np.array([[5.0, quarter, quarter, 7.0, -3.0, quarter]]))[0]
    # Y carries the head, so gravity is -Y; B turns about Y and leaves it; C by +90 degrees sees -Y as -X.
    np.testing.assert_allclose(seen[[0, 1]], [[0, -1, 0]] * 2, rtol=0, atol=EXACT)
    np.testing.assert_allclose(seen[2], [-1, 0, 0], rtol=0, atol=EXACT)
    np.testing.assert_allclose(seen[[3, 4]], [[0, -1, 0]] * 2, rtol=0, atol=EXACT)
    np.testing.assert_allclose(seen[5], [-1, 0, 0], rtol=0, atol=EXACT)


@pytest.mark.parametrize("topology", ["w C B X b Z Y (C1) t", "w C A Y X b Z (C1) t", "w X b Y Z C B (C1) t"])
def test_the_simulator_feels_the_same_gravity(simulator: ModuleType, topology: str) -> None:
    chain = parse_topology(topology)
    rng = np.random.default_rng(1)
    positions = rng.uniform(-3.0, 3.0, (8, len(chain.joints)))
    theirs = simulator.chain.read_topology(topology, {joint.name: 1.0 for joint in chain.joints})
    readings = {joint.name: positions[:, place] for place, joint in enumerate(chain.joints)}
    seen = simulator.chain.gravity_seen(theirs, readings, np.array(chain.gravity))
    ours = gravity_in_joint_frames(chain, positions)
    for place, joint in enumerate(chain.joints):
        np.testing.assert_allclose(ours[:, place], seen[joint.name], rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(ours, axis=-1), 1.0, rtol=0, atol=1e-14)
