"""Any serial machine seen by a tracker, simulated exactly and written as a campaign folder; nothing shared with the
product.

Chains that are no elbow robots: a selective compliance arm, a pan and tilt head whose axes intersect, a measuring
machine with a turning head, a single rotary table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .robot import frames, point

Z, Y, X = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
TARGETS = {"R1": (120.0, 60.0, 20.0), "R2": (130.0, -70.0, 40.0), "R3": (90.0, 10.0, -95.0)}
#: What a joint turns or shifts beyond its reading: a function of readings (n,) in rad or mm.
Motion = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Axis:
    """Name, kind (linear, rotary), direction, offset in mm from the axis before, range in degrees or mm."""

    name: str
    kind: str
    direction: tuple[float, float, float]
    offset: tuple[float, float, float]
    limits: tuple[float, float]

    @property
    def column(self) -> str:
        """The column of its readings."""
        return f"{self.name.lower()}_{'mm' if self.kind == 'linear' else 'deg'}"


MACHINES: Mapping[str, tuple[Axis, ...]] = {
    "scara": (
        Axis("J1", "rotary", Z, (0.0, 0.0, 300.0), (-130.0, 130.0)),
        Axis("J2", "rotary", Z, (350.0, 0.0, 0.0), (-140.0, 140.0)),
        Axis("J3", "linear", Z, (300.0, 0.0, 0.0), (-180.0, 0.0)),
    ),
    "scara with wrist": (
        Axis("J1", "rotary", Z, (0.0, 0.0, 300.0), (-130.0, 130.0)),
        Axis("J2", "rotary", Z, (350.0, 0.0, 0.0), (-140.0, 140.0)),
        Axis("J3", "linear", Z, (300.0, 0.0, 0.0), (-180.0, 0.0)),
        Axis("J4", "rotary", Z, (0.0, 0.0, 0.0), (-170.0, 170.0)),
    ),
    "pan and tilt": (
        Axis("P", "rotary", Z, (0.0, 0.0, 0.0), (-170.0, 170.0)),
        Axis("T", "rotary", Y, (0.0, 0.0, 0.0), (-80.0, 80.0)),
    ),
    "measuring machine with head": (
        Axis("X", "linear", X, (0.0, 0.0, 0.0), (0.0, 900.0)),
        Axis("Y", "linear", Y, (0.0, 0.0, 0.0), (0.0, 1200.0)),
        Axis("Z", "linear", Z, (0.0, 0.0, 0.0), (-700.0, 0.0)),
        Axis("H1", "rotary", Z, (0.0, 0.0, -80.0), (-180.0, 180.0)),
        Axis("H2", "rotary", X, (0.0, 0.0, 0.0), (-105.0, 105.0)),
    ),
    "one turning axis": (Axis("J1", "rotary", Z, (0.0, 0.0, 0.0), (-180.0, 180.0)),),
    "positioner": (
        Axis("E1", "linear", X, (0.0, 0.0, 0.0), (0.0, 2000.0)),
        Axis("E2", "rotary", Y, (0.0, 0.0, 500.0), (-90.0, 90.0)),
        Axis("E3", "rotary", Z, (0.0, 0.0, 200.0), (-180.0, 180.0)),
    ),
}


@dataclass(frozen=True)
class Scene:
    """``along``: error motion of a joint along or about its own axis by its readings; ``noise_um`` of a coordinate;
    ``indexed`` joints that only stop at multiples of so many degrees."""

    along: Mapping[str, Motion] = field(default_factory=dict)
    noise_um: float = 15.0
    indexed: Mapping[str, float] = field(default_factory=dict)


def write(
    folder: Path,
    axes: Sequence[Axis],
    rng: np.random.Generator,
    scene: Scene | None = None,
    *,
    poses: int = 150,
    visits: int = 1,
    targets: Sequence[str] = tuple(TARGETS),
) -> Path:
    """The campaign folder of one run of random poses, all of them visited so many times one after the other."""
    scene = scene or Scene()
    numbers = {axis.name: np.tile(np.round(rng.uniform(*axis.limits, poses), 3), visits) for axis in axes}
    poses *= visits
    for name, step in scene.indexed.items():
        numbers[name] = step * np.round(numbers[name] / step)
    readings = {
        axis.name: numbers[axis.name] if axis.kind == "linear" else np.deg2rad(numbers[axis.name])
        for axis in axes
    }
    joints = [
        {"name": axis.name, "kind": axis.kind, "axis": axis.direction, "offset": axis.offset, "sign": 1}
        for axis in axes
    ]
    location = {
        axis.name: np.concatenate([rng.normal(0.0, 0.3, 3), rng.normal(0.0, 5e-4, 3)]) for axis in axes
    }
    motion = {
        axis.name: np.concatenate(
            [
                np.zeros((poses, 3)),
                np.outer(scene.along[axis.name](readings[axis.name]), axis.direction),
            ][:: -1 if axis.kind == "linear" else 1],
            axis=1,
        )
        for axis in axes
        if axis.name in scene.along
    }
    tool = frames(joints, readings, location, motion)[-1]
    stand, away = Rotation.random(random_state=rng), rng.normal(0.0, 1500.0, 3)
    folder.mkdir(parents=True)
    text = [
        "format = 1",
        f'campaign = "{folder.name}"',
        'method = "tracker"',
        "",
        "[machine]",
        'id = "machine-1"',
    ]
    for axis in axes:
        key = ("along" if axis.kind == "linear" else "about", "XYZ"[axis.direction.index(1.0)])
        text += ["", "[[machine.tool_chain]]", f'name = "{axis.name}"', f'kind = "{axis.kind}"']
        text += [f'{key[0]} = "{key[1]}"', f"offset_mm = {list(axis.offset)}"]
    text += ["", "[probe]", 'id = "t"', 'model = "tracker"', f"standard_uncertainty_um = {scene.noise_um}"]
    (folder / "campaign.toml").write_text("\n".join(text) + "\n")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:30:00+01:00,1,false,21.3\n"
    )
    columns = ",".join(axis.column for axis in axes)
    lines = [f"run,sequence,time_s,target,{columns},tracker_x_mm,tracker_y_mm,tracker_z_mm"]
    for pose in range(poses):
        at = ",".join(f"{numbers[axis.name][pose]:.3f}" for axis in axes)
        for name in targets:
            seen = stand.inv().apply(point(tool[pose : pose + 1], np.array(TARGETS[name]))[0] - away)
            seen = seen + rng.normal(0.0, scene.noise_um / 1e3, 3)
            row = len(lines)
            lines.append(f"1,{row},{5.0 * row:.1f},{name},{at}," + ",".join(f"{value:.5f}" for value in seen))
    (folder / "probings.csv").write_text("\n".join(lines) + "\n")
    return folder
