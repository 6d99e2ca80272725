"""A robot as measured ones are, simulated exactly; nothing shared with the product.

The elbow robot of ``robot_campaign`` with what measured robots have together: joints that give way under payload and
links, joint curves of many lines (strain wave gears, eccentric encoders, lines of no catalogue), angles at which it
comes to rest anew each time, a robot that warms up before a tracker that stands still, or the other way round, and
rows of a beam that was lost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .robot import frames, point
from .robot_campaign import ELBOW, FIXED, JOINTS, REFLECTORS, Tracked, errors_of_robot, write_tracked

NAMES = tuple(name for name, *_ in ELBOW)
#: Weight in kg and distance from its joint in mm along the link, for the torques of links.
LINKS = {"J2": (12.0, 220.0), "J3": (9.0, 150.0), "J4": (6.0, 210.0), "J5": (2.0, 40.0), "J6": (0.5, 20.0)}
PAYLOAD_KG, PAYLOAD_MM = 7.0, (60.0, 25.0, 10.0)
GRAVITY = 9.81
#: Reductions of strain wave gears.
RATIOS = {"J1": 121.0, "J2": 160.0, "J3": 121.0, "J4": 101.0, "J5": 100.0, "J6": 51.0}


@dataclass(frozen=True)
class Line:
    """One line of a joint curve: ``order`` periods a turn of the joint, amplitude in rad, phase in rad."""

    order: float
    amplitude: float
    phase: float


@dataclass(frozen=True)
class Scene:
    """What the robot and the tracker do besides their geometry.

    ``softness`` rad per N m by joint; ``curves`` lines by joint; ``zeros`` drift of joint zeros in rad and ``growth``
    strain of the links, both over the session with ``tau`` (part of it); ``shift_mm`` drift of the tracker's frame with
    the same. ``rest_rad`` standard deviation of the angle at which each joint rests, ``noise_um`` of the tracker.
    """

    softness: Mapping[str, float] = field(default_factory=dict)
    curves: Mapping[str, Sequence[Line]] = field(default_factory=dict)
    zeros: Mapping[str, float] = field(default_factory=dict)
    growth: float = 0.0
    shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tau: float = 0.4
    rest_rad: float = 12e-6
    noise_um: float = 12.0


@dataclass(frozen=True)
class Session:
    """A simulated session: its rows as the tracker saw them, and as they would be without noise and rest."""

    tracked: Tracked
    exact: np.ndarray
    pose: np.ndarray

    @property
    def noise_mm(self) -> float:
        """Root mean square of what no model can predict, on reflectors of the tool."""
        tool = ~np.isin(self.tracked.target, list(FIXED))
        return float(np.sqrt(np.mean((self.tracked.points - self.exact)[tool] ** 2)))

    def part(self, rows: np.ndarray) -> Session:
        """The session of some rows (marks)."""
        index = np.flatnonzero(rows)
        tracked = replace(
            self.tracked,
            target=[self.tracked.target[row] for row in index],
            readings=self.tracked.readings[index],
            points=self.tracked.points[index],
        )
        return Session(tracked, self.exact[index], self.pose[index])


def harmonic_drives(rng: np.random.Generator, joints: Sequence[str] = NAMES) -> dict[str, list[Line]]:
    """Joint curves of several lines of tens to some 100 µrad: eccentric encoders at the output (1, 2) and the motor
    (the ratio), the two waves of the generator, its teeth, and two lines of no catalogue."""
    curves = {}
    for name in joints:
        ratio = RATIOS[name]
        orders = [1.0, 2.0, ratio, 2.0 * ratio, *rng.choice(np.arange(5.0, 60.0), 2, replace=False)]
        sizes = [120e-6, 60e-6, 50e-6, 90e-6, 40e-6, 40e-6]
        curves[name] = [
            Line(order, size * rng.uniform(0.6, 1.4), rng.uniform(0.0, 2.0 * np.pi))
            for order, size in zip(orders, sizes, strict=True)
        ]
    return curves


def torques(readings: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Torque in N m about every joint's axis of the payload and of the links further out."""
    stand = frames(JOINTS, readings)
    weights = {name: (kg, point(frame, (0.0, 0.0, mm) if name in ("J2",) else (mm, 0.0, 0.0)))
               for (name, (kg, mm)), frame in zip(LINKS.items(), stand[1:], strict=True)}  # fmt: skip
    load = point(stand[-1], np.array(PAYLOAD_MM))
    result = {}
    for index, (joint, frame) in enumerate(zip(JOINTS, stand, strict=True)):
        axis = frame[:, :3, :3] @ np.array(joint["axis"])
        place = frame[:, :3, 3]
        pulls = [(PAYLOAD_KG, load), *(weights[name] for name in NAMES[index:] if name in weights)]
        result[str(joint["name"])] = sum(
            np.sum(axis * np.cross(at - place, (0.0, 0.0, -kg * GRAVITY)), axis=1) / 1e3 for kg, at in pulls
        )
    return result


def _errors(
    scene: Scene, readings: Mapping[str, np.ndarray], location: Mapping[str, np.ndarray], late: np.ndarray,
    rest: np.ndarray,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:  # fmt: skip
    """Location (N, 6) and motion (N, 6) errors of every joint; ``rest`` (N, 6) angles, ``late`` (N,) how warm it is."""
    pulls = torques(readings)
    where, motion = {}, {}
    for index, joint in enumerate(JOINTS):
        name = str(joint["name"])
        q = float(joint["sign"]) * readings[name]
        turn = (
            rest[:, index] + scene.softness.get(name, 0.0) * pulls[name] + scene.zeros.get(name, 0.0) * late
        )
        for line in scene.curves.get(name, ()):
            turn = turn + line.amplitude * np.cos(line.order * q - line.phase)
        motion[name] = np.concatenate(
            [np.zeros((len(q), 3)), turn[:, None] * np.array(joint["axis"])], axis=1
        )
        where[name] = np.tile(location[name], (len(q), 1))
        where[name][:, :3] += scene.growth * late[:, None] * np.array(joint["offset"])
    return where, motion


def measure(
    rng: np.random.Generator,
    scene: Scene,
    *,
    poses: int = 1000,
    fixed_every: int = 0,
    location: Mapping[str, np.ndarray] | None = None,
) -> Session:
    """One session of random poses of three reflectors each, with fixed ones every so many poses."""
    location = errors_of_robot(rng) if location is None else location
    low, high = np.array([limits for *_, limits in ELBOW]).T
    degrees = np.round(rng.uniform(low, high, (poses, len(ELBOW))), 4)
    readings = {name: np.deg2rad(degrees[:, index]) for index, name in enumerate(NAMES)}
    late = -np.expm1(-np.linspace(0.0, 1.0, poses) / scene.tau)
    rest = rng.normal(0.0, scene.rest_rad, degrees.shape)
    stand, away = Rotation.random(random_state=rng), rng.uniform(-1.0, 1.0, 3)
    away *= 3000.0 / np.linalg.norm(away)

    def tool(angles: np.ndarray) -> np.ndarray:
        return frames(JOINTS, readings, *_errors(scene, readings, location, late, angles))[-1]

    noisy, exact = tool(rest), tool(np.zeros_like(rest))
    rows: list[tuple[int, str, np.ndarray, np.ndarray]] = []
    for pose in range(poses):
        if fixed_every and pose % fixed_every == 0:
            rows += [(pose, name, np.array(at), np.array(at)) for name, at in FIXED.items()]
        rows += [
            (
                pose,
                name,
                point(noisy[pose : pose + 1], np.array(at))[0],
                point(exact[pose : pose + 1], np.array(at))[0],
            )
            for name, at in REFLECTORS.items()
        ]
    pose_of = np.array([pose for pose, *_ in rows])
    drift = late[pose_of][:, None] * np.array(scene.shift_mm)

    def seen(points: list[np.ndarray]) -> np.ndarray:
        return np.asarray(stand.inv().apply(np.array(points) - away)) + drift

    true = seen([row[3] for row in rows])
    points = seen([row[2] for row in rows]) + rng.normal(0.0, scene.noise_um / 1e3, true.shape)
    tracked = Tracked([row[1] for row in rows], degrees[pose_of], np.round(points, 5), location)
    return Session(tracked, true, pose_of)


def lose_beam(session: Session, rows: Sequence[int]) -> Session:
    """The session with rows 0, 0, 0, as a tracker writes them whose beam was lost."""
    points = session.tracked.points.copy()
    points[list(rows)] = 0.0
    return replace(session, tracked=replace(session.tracked, points=points))


def write_session(folder: Path, session: Session, noise_um: float = 20.0) -> Path:
    """The campaign folder of a session."""
    return write_tracked(folder, session.tracked, noise_um)
