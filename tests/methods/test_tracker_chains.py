"""A tracker looks at any chain: machine tools, swivel heads, arms of four and seven joints, by naive matrices."""

from __future__ import annotations

import importlib
from datetime import UTC, datetime
from types import ModuleType

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.methods.model import chain_of
from monitor.methods.tracker.method import METHOD as tracker
from monitor.records import Artefact, Campaign, ChainAxis, Machine, Probe, Probings, Run

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
REFLECTORS = {"a": (50.0, 20.0, -120.0), "b": (-60.0, 30.0, -110.0), "c": (10.0, -70.0, -90.0)}
NOISE = 5e-3
ARM = (
    *(("J1", "rotary", Z, (0, 0, 400)), ("J2", "rotary", Y, (0, 0, 0)), ("J3", "rotary", Y, (0, 0, 400))),
    *(("J4", "rotary", X, (0, 0, 30)), ("J5", "rotary", Y, (400, 0, 0)), ("J6", "rotary", X, (80, 0, 0))),
)
SCARA = (
    *(("A1", "rotary", Z, (0, 0, 0)), ("A2", "rotary", Z, (300, 0, 0))),
    *(("Q", "linear", (0.0, 0.0, -1.0), (0, 0, 0)), ("A4", "rotary", Z, (250, 0, 0))),
)


def placed(rows) -> Machine:
    """A machine of freely placed axes."""
    chain = tuple(
        ChainAxis(name, kind, "tool", direction, tuple(map(float, offset)))
        for name, kind, direction, offset in rows
    )
    return Machine("m", "w b " + " ".join(axis.name for axis in chain) + " t", chain=chain)


@pytest.mark.parametrize(
    ("machine", "errors"),
    [
        # Three squarenesses and three gains; nothing else of a machine of three axes is constant.
        (Machine("m", "w b X Y Z t"), 6),
        # 4 a rotary axis, 2 a linear one, 6 for the whole, less frame and points, and the gains.
        (Machine("m", "w b X Y Z C B t"), 11),
        (Machine("m", "w b X Y Z C A (C1) t"), 15),
        # Of the work side a tracker beside the machine sees nothing.
        (Machine("m", "w C B X b Z Y (C1) t"), 5),
        (placed(SCARA), 10),
        (placed(ARM), 18),
        (placed((("rail", "linear", (0.6, 0.8, 0.0), (0, 0, 0)), *ARM)), 21),
        (placed((*ARM, ("J7", "rotary", Z, (50, 0, 0)))), 22),
    ],
    ids=lambda value: value.topology if isinstance(value, Machine) else str(value),
)
def test_any_chain_is_identified_to_the_noise(simulator: ModuleType, machine: Machine, errors: int) -> None:
    robot = importlib.import_module(f"{simulator.__name__}.robot")
    rng = np.random.default_rng(errors)
    chain = chain_of(machine)
    poses = 150
    half = {joint.name: 1.5 if joint.turns else 250.0 for joint in chain.joints}
    readings = {name: rng.uniform(-limit, limit, poses) for name, limit in half.items()}
    joints = [
        {"name": j.name, "kind": j.kind, "axis": j.direction, "offset": j.offset, "sign": j.sign}
        for j in chain.tool
    ]
    location = {j.name: np.r_[rng.normal(0.0, 0.1, 3), rng.normal(0.0, 3e-4, 3)] for j in chain.tool}
    motion = {
        j.name: 1e-4 * (j.sign * readings[j.name])[:, None] * np.eye(6)[j.main]
        for j in chain.tool
        if not j.turns
    }
    tool = robot.frames(joints, readings, location, motion)[-1]
    seen = np.stack([robot.point(tool, np.array(place)) for place in REFLECTORS.values()], axis=1).reshape(
        -1, 3
    )
    seen = Rotation.random(random_state=rng).apply(seen - [3000.0, 500.0, -200.0])
    seen += rng.normal(0.0, NOISE, seen.shape)
    count = len(seen)
    campaign = Campaign(
        name="c",
        method="tracker",
        machine=machine,
        probe=Probe("p", "m", NOISE),
        artefact=Artefact("", ()),
        runs=(Run(1, datetime(2026, 3, 2, tzinfo=UTC), 1, False),),
        probings=Probings(
            run=np.ones(count, dtype=np.int64),
            sequence=np.arange(1, count + 1),
            time=np.arange(float(count)),
            target=np.array(list(REFLECTORS) * poses),
            readings={name: np.repeat(values, 3) for name, values in readings.items()},
            channels={f"tracker_{axis}_mm": seen[:, place] for place, axis in enumerate("xyz")},
        ),
    )
    found = tracker.identify(campaign)
    run = found.runs[0]
    assert len(found.parameters) == errors
    assert run.refused == ()
    # Five standard deviations of chi-square with some 1300 degrees of freedom, and products of errors: 1e-4 of each.
    assert abs(run.chi_square / run.degrees_of_freedom - 1.0) < 5.0 * np.sqrt(2.0 / run.degrees_of_freedom)
    gains = {
        name: value for name, value in zip(found.parameters, run.estimate, strict=True) if "0" not in name
    }
    u = dict(zip(found.parameters, np.sqrt(np.diag(run.covariance)), strict=True))
    for name, value in gains.items():
        assert abs(value - 1e-4) < 5.0 * u[name]
