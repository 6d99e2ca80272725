"""A virtual tracked robot: an elbow robot with errors that we choose, seen by a tracker in a frame of its own.

For rehearsal. Tests of the identification use another simulator, which shares no code with this package.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from monitor.effects import parse_effect
from monitor.effects.artefact.tracker import TRACKER_COLUMNS
from monitor.exceptions import EffectError
from monitor.machine import Chain, evaluate
from monitor.machine.chain import rotation_about
from monitor.methods.model import chain_of
from monitor.methods.tracker.assembly import problem_of
from monitor.records import (
    Array,
    Artefact,
    AxisSettings,
    Campaign,
    ChainAxis,
    Machine,
    Probe,
    Probings,
    Reflector,
    Run,
)
from monitor.topology_text import topology_of
from monitor.units import DEGREE

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# Links and ranges of a robot of 0.9 m reach, the size of those that machine shops load their machines with.
AXES = (
    ("J1", Z, (0.0, 0.0, 400.0), 160.0),
    ("J2", Y, (25.0, 0.0, 0.0), 75.0),
    ("J3", Y, (0.0, 0.0, 455.0), 90.0),
    ("J4", X, (0.0, 0.0, 35.0), 150.0),
    ("J5", Y, (420.0, 0.0, 0.0), 110.0),
    ("J6", X, (80.0, 0.0, 0.0), 170.0),
)
REFLECTORS = {"R1": (120.0, 60.0, 20.0), "R2": (130.0, -70.0, 40.0), "R3": (90.0, 10.0, -95.0)}
POSES, SECONDS_A_POSE = 500, 12.0
# Zeros of some hundredths of a degree to tenths, shifts of tenths of a millimetre: a robot that was mastered once.
ZERO, TILT, SHIFT = np.deg2rad(0.1), 5e-4, 0.3
STAND_MM = (2500.0, -1500.0, 400.0)


def _blank(name: str, noise: float, rng: np.random.Generator) -> Campaign:
    """The campaign without points."""
    chain = tuple(ChainAxis(axis, "rotary", "tool", about, offset) for axis, about, offset, _ in AXES)
    half = np.array([limit for *_, limit in AXES])
    degrees = np.round(rng.uniform(-half, half, (POSES, len(AXES))), 4)
    rows = len(REFLECTORS) * POSES
    return Campaign(
        name=name,
        method="tracker",
        machine=Machine(
            id="virtual robot",
            topology=topology_of(chain),
            axes={
                axis: AxisSettings(axis, stroke=(-DEGREE.to_internal(limit), DEGREE.to_internal(limit)))
                for axis, _, _, limit in AXES
            },
            chain=chain,
            gravity=(0.0, 0.0, -1.0),
        ),
        probe=Probe("virtual tracker", "virtual", noise),
        artefact=Artefact(
            "three reflectors", (), None, tuple(Reflector(reflector) for reflector in REFLECTORS)
        ),
        runs=(Run(1, datetime(2026, 3, 2, 8, 30, tzinfo=UTC), 1, False, {"ambient_degC": 21.5}),),
        probings=Probings(
            run=np.ones(rows, dtype=np.int64),
            sequence=np.arange(1, rows + 1),
            time=np.repeat(np.arange(POSES) * SECONDS_A_POSE, len(REFLECTORS)),
            target=np.array(list(REFLECTORS) * POSES),
            readings={
                axis: np.repeat(degrees[:, index] * DEGREE.factor, len(REFLECTORS))
                for index, (axis, *_) in enumerate(AXES)
            },
        ),
    )


def _locations(chain: Chain, rng: np.random.Generator, count: int) -> Array:
    """Errors (n, J, 2, 6) of a robot without the effect."""
    errors = np.zeros((count, len(chain.joints), 2, 6))
    for index, joint in enumerate(chain.joints):
        errors[:, index, 0, :3] = rng.normal(0.0, SHIFT, 3)
        errors[:, index, 0, 3:] = rng.normal(0.0, TILT, 3)
        errors[:, index, 0, 3 + joint.main] = rng.normal(0.0, ZERO)
    return errors


def virtual_robot(
    name: str, rng: np.random.Generator, *, effect: str | None = None, peak: float = 0.0, noise: float = 0.02
) -> Campaign:
    """A campaign of one run of 500 poses of three reflectors. ``peak`` (mm) is the largest displacement that the
    hidden effect causes at any reflector, ``noise`` (mm) the standard deviation of a coordinate.

    Raises EffectError for an effect that the robot does not have or that does nothing at these poses.
    """
    campaign = _blank(name, noise, rng)
    chain = chain_of(campaign.machine)
    count = len(campaign.probings)
    errors = _locations(chain, rng, count)
    turn = np.eye(3)
    for axis, angle in zip((Z, Y, X), rng.uniform(-np.pi, np.pi, 3), strict=True):
        turn = turn @ rotation_about(axis, angle)
    tip = np.array([REFLECTORS[str(target)] for target in campaign.probings.target])
    positions = np.stack(
        [joint.sign * campaign.probings.readings[joint.name] for joint in chain.joints], axis=1
    )

    def observed(moved: Array, shift: Array) -> Campaign:
        """The campaign with the points that the tracker sees."""
        points = evaluate(chain, positions, moved, shift, tip).residual
        inside = (points - STAND_MM) @ turn
        channels = {column: inside[:, axis] for axis, column in enumerate(TRACKER_COLUMNS)}
        return replace(campaign, probings=replace(campaign.probings, channels=channels))

    plain = observed(errors, np.zeros((count, 3)))
    shift = np.zeros((count, 3))
    if effect is not None:
        context = problem_of(plain).context
        basis = parse_effect(effect, context.chain).basis(context)
        at = evaluate(chain, positions, errors, shift, tip, jacobian=True)
        assert at.by_error is not None
        largest = float(np.linalg.norm(basis.displacement(at.by_error) @ np.ones(basis.size), axis=1).max())
        if largest == 0.0:
            raise EffectError(
                f"{effect} does nothing at the poses of the virtual robot; choose another effect"
            )
        basis.apply(np.full(basis.size, peak / largest), errors, shift)
    exact = observed(errors, shift)
    # A tracker prints a hundredth of a micrometre.
    noisy = {
        column: np.round(values + rng.normal(0.0, noise, count), 5)
        for column, values in exact.probings.channels.items()
    }
    return replace(campaign, probings=replace(campaign.probings, channels=noisy))
