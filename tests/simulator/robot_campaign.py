"""A tracked robot, simulated exactly and written as a campaign folder; nothing shared with the product.

An elbow robot of six joints with errors of every joint's zero, place and direction, whose joints may also give way
under a load at the flange, have gears that are not round, or be read while they still move. A tracker metres away, in
any orientation, sees reflectors on the tool, and some beside the robot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .robot import frames, point

Z, Y, X = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
#: A robot of 0.9 m reach: axis, offset from the joint before in mm, sign, range in degrees.
ELBOW = (
    ("J1", Z, (0.0, 0.0, 400.0), 1, (-160.0, 160.0)),
    ("J2", Y, (25.0, 0.0, 0.0), 1, (-60.0, 90.0)),
    ("J3", Y, (0.0, 0.0, 455.0), 1, (-120.0, 60.0)),
    ("J4", X, (0.0, 0.0, 35.0), -1, (-150.0, 150.0)),
    ("J5", Y, (420.0, 0.0, 0.0), 1, (-110.0, 110.0)),
    ("J6", X, (80.0, 0.0, 0.0), -1, (-170.0, 170.0)),
)
JOINTS = tuple(
    {"name": name, "kind": "rotary", "axis": axis, "offset": offset, "sign": sign}
    for name, axis, offset, sign, _ in ELBOW
)
#: Reflectors in the frame of the last joint, mm; the product is not told.
REFLECTORS = {"R1": (120.0, 60.0, 20.0), "R2": (130.0, -70.0, 40.0), "R3": (90.0, 10.0, -95.0)}
FIXED = {"F1": (900.0, -700.0, 50.0), "F2": (-500.0, 900.0, 30.0)}


@dataclass(frozen=True)
class Hidden:
    """What the robot hides besides its geometry; angles in rad about a joint's own axis (as it turns).

    ``compliance``: rad per metre of lever of a load at the flange. ``harmonic``: (order, amplitude, phase).
    ``lag``: part of the last move that is missing. ``reversal``: half the jump when the joint turns back.
    ``hanging``: shift in mm along X of a joint's own frame as gravity turns from across X to along it.
    ``drift_mm`` and ``drift_rad`` (3,): how the tracker's frame moves over the run, in its own axes.
    """

    compliance: Mapping[str, float] = field(default_factory=dict)
    harmonic: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    lag: Mapping[str, float] = field(default_factory=dict)
    reversal: Mapping[str, float] = field(default_factory=dict)
    hanging: Mapping[str, float] = field(default_factory=dict)
    drift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drift_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Tracked:
    """Rows of a simulated run: (n,) poses, targets, (n, 6) readings in degrees, (n, 3) points in mm; the truth."""

    target: list[str]
    readings: np.ndarray
    points: np.ndarray
    location: Mapping[str, np.ndarray]


def errors_of_robot(rng: np.random.Generator, scale: float = 1.0) -> dict[str, np.ndarray]:
    """Location errors X Y Z A B C of every joint: zeros of 0.3 degrees, tilts of 1 mrad, shifts of 0.5 mm."""
    made = {}
    for joint in JOINTS:
        six = np.concatenate([rng.normal(0.0, 0.5, 3), rng.normal(0.0, 1e-3, 3)])
        six[3:] += np.abs(np.array(joint["axis"])) * rng.normal(0.0, np.deg2rad(0.3))
        made[str(joint["name"])] = scale * six
    return made


def lever_arms(readings: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Torque in m about every joint's axis (the positive one of X, Y, Z) of a unit weight at the flange."""
    made = frames(JOINTS, readings)
    flange = made[-1][:, :3, 3]
    found = {}
    for joint, frame in zip(JOINTS, made, strict=True):
        axis = frame[:, :3, :3] @ np.array(joint["axis"])
        arm = flange - frame[:, :3, 3]
        found[str(joint["name"])] = np.sum(axis * np.cross(arm, (0.0, 0.0, -1.0)), axis=1) / 1e3
    return found


def track(
    rng: np.random.Generator,
    hidden: Hidden | None = None,
    *,
    poses: int = 1000,
    noise_um: float = 20.0,
    location: Mapping[str, np.ndarray] | None = None,
    fixed_every: int = 0,
    reflectors: Sequence[str] = ("R1", "R2", "R3"),
    ranges: Mapping[str, tuple[float, float]] | None = None,
    repeatability_urad: float = 0.0,
) -> Tracked:
    """Simulate one run of random poses; with ``fixed_every`` the fixed reflectors are seen each so many poses.

    ``ranges`` narrows the range of joints, in degrees; ``repeatability_urad`` is the standard deviation of the angle at
    which every joint comes to rest, the same for all reflectors of a pose.
    """
    hidden = hidden or Hidden()
    location = errors_of_robot(rng) if location is None else location
    low, high = np.array([(ranges or {}).get(name, limits) for name, *_, limits in ELBOW]).T
    degrees = np.round(rng.uniform(low, high, (poses, len(ELBOW))), 4)
    readings = {str(joint["name"]): np.deg2rad(degrees[:, place]) for place, joint in enumerate(JOINTS)}
    arms = lever_arms(readings)
    motion = {}
    nominal = frames(JOINTS, readings) if hidden.hanging else []
    for place, joint in enumerate(JOINTS):
        name = str(joint["name"])
        q = float(joint["sign"]) * readings[name]
        turn = rng.normal(0.0, 1e-6 * repeatability_urad, poses) if repeatability_urad else np.zeros(poses)
        turn += hidden.compliance.get(name, 0.0) * arms[name]
        if name in hidden.harmonic:
            order, amplitude, phase = hidden.harmonic[name]
            turn += amplitude * np.cos(order * q - phase)
        moves = np.diff(q, prepend=q[:1])
        turn += hidden.lag.get(name, 0.0) * moves
        signs = np.sign(moves)
        signs[0] = np.sign(q[0])
        turn += hidden.reversal.get(name, 0.0) * signs
        motion[name] = np.concatenate([np.zeros((poses, 3)), turn[:, None] * np.array(joint["axis"])], axis=1)
        if name in hidden.hanging:
            # The third row of a rotation is the bed's Z in the frame: gravity is its negative.
            motion[name][:, 0] -= hidden.hanging[name] * nominal[place][:, 2, 0]
    tool = frames(JOINTS, readings, location, motion)[-1]
    stand = Rotation.random(random_state=rng)
    away = rng.uniform(-1.0, 1.0, 3)
    away *= 3000.0 / np.linalg.norm(away)
    targets: list[str] = []
    rows: list[int] = []
    there: list[np.ndarray] = []
    carried = {name: point(tool, np.array(REFLECTORS[name])) for name in reflectors}
    for pose in range(poses):
        if fixed_every and pose % fixed_every == 0:
            for name, place in FIXED.items():
                targets.append(name)
                rows.append(pose)
                there.append(np.array(place))
        for name in reflectors:
            targets.append(name)
            rows.append(pose)
            there.append(carried[name][pose])
    seen = stand.inv().apply(np.array(there) - away)
    part = np.linspace(0.0, 1.0, len(seen))[:, None]
    seen = Rotation.from_rotvec(part * np.array(hidden.drift_rad)).apply(seen) + part * np.array(
        hidden.drift_mm
    )
    seen = seen + rng.normal(0.0, noise_um / 1e3, seen.shape)
    return Tracked(targets, degrees[rows], np.round(seen, 5), location)


def campaign_text(name: str, noise_um: float, fixed: bool) -> str:
    """The robot's ``campaign.toml``."""
    lines = ["format = 1", f'campaign = "{name}"', 'method = "tracker"', "", "[machine]", 'id = "elbow-1"']
    for joint, axis, offset, sign, _ in ELBOW:
        about = "XYZ"[axis.index(1.0)]
        lines += ["", "[[machine.tool_chain]]", f'name = "{joint}"', 'kind = "rotary"', f'about = "{about}"']
        lines += [f"offset_mm = {list(offset)}"] + (["sign = -1"] if sign < 0 else [])
    lines += [
        "",
        "[probe]",
        'id = "tracker-1"',
        'model = "laser tracker"',
        f"standard_uncertainty_um = {noise_um}",
    ]
    if fixed:
        for reflector in (*REFLECTORS, *FIXED):
            lines += ["", "[[artefact.reflectors]]", f'id = "{reflector}"']
            lines += ["fixed = true"] if reflector in FIXED else []
    return "\n".join(lines) + "\n"


def write_tracked(folder: Path, tracked: Tracked, noise_um: float = 20.0) -> Path:
    """The campaign folder of one run."""
    folder.mkdir(parents=True)
    fixed = any(name in FIXED for name in tracked.target)
    (folder / "campaign.toml").write_text(campaign_text(folder.name, noise_um, fixed))
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:30:00+01:00,1,false,21.3\n"
    )
    columns = ",".join(f"{joint.lower()}_deg" for joint, *_ in ELBOW)
    lines = [f"run,sequence,time_s,target,{columns},tracker_x_mm,tracker_y_mm,tracker_z_mm"]
    for row, (name, degrees, seen) in enumerate(
        zip(tracked.target, tracked.readings, tracked.points, strict=True)
    ):
        numbers = ",".join(f"{value:.4f}" for value in degrees) + "," + ",".join(f"{v:.5f}" for v in seen)
        lines.append(f"1,{row + 1},{5.0 * row:.1f},{name},{numbers}")
    (folder / "probings.csv").write_text("\n".join(lines) + "\n")
    return folder
