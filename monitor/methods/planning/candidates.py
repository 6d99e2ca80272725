"""What may be chosen for a plan: balls, indexations and the time that they take, and plans made of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from monitor.machine import Chain
from monitor.methods.planning.expected import Expected, expected
from monitor.methods.planning.touches import Mask, Touches
from monitor.records import Array

# The grid of rotary positions; finer ones change the choice, not what it achieves.
STEP_RAD = math.pi / 6.0
SPINDLE = (0.0, math.pi / 2.0, math.pi, 1.5 * math.pi)


@dataclass(frozen=True)
class TimeModel:
    """Seconds for probing one target, and for going to another indexation besides."""

    probing_s: float
    indexation_s: float
    source: str

    def seconds(self, touched: Mask) -> float:
        """How long a plan (P, T) takes."""
        return self.probing_s * float(touched.sum()) + self.indexation_s * float(touched.any(axis=1).sum())


@dataclass(frozen=True)
class Choice:
    """A plan: ``poses`` and ``balls`` are places in the candidates, ``touched`` (P, T) what is probed."""

    poses: tuple[int, ...]
    balls: tuple[int, ...]
    touched: Mask
    expected: Expected
    seconds: float


@dataclass(frozen=True)
class Candidates:
    """What may be chosen: ``balls`` are places of targets that may be left out; ``bar_poses`` those of indexations
    at which the bar's ends are probed, which every plan keeps."""

    touches: Touches
    balls: tuple[int, ...]
    bar_poses: tuple[int, ...]
    time: TimeModel

    def touched(self, poses: tuple[int, ...], balls: tuple[int, ...]) -> Mask:
        """All balls at all poses that they can be reached at, and the bar at its own (P, T)."""
        touched = np.zeros(self.touches.reachable.shape, dtype=bool)
        touched[np.ix_(list(poses), list(balls))] = True
        touched &= self.touches.reachable
        for bar in self.touches.bars:
            touched[np.ix_(list(self.bar_poses), [bar.first, bar.second])] = True
        return touched

    def choice(self, poses: tuple[int, ...], balls: tuple[int, ...], touched: Mask | None = None) -> Choice:
        """A plan of the given poses and balls; ``touched`` where it is not all of them everywhere."""
        touched = self.touched(poses, balls) if touched is None else touched
        return Choice(
            tuple(sorted(poses)),
            tuple(sorted(balls)),
            touched,
            expected(self.touches, touched),
            self.time.seconds(touched),
        )


def pose_grid(chain: Chain, visited: Array, strokes: Mapping[str, tuple[float, float]]) -> Array:
    """Rotary poses (P, J) to choose from: steps of 30 degrees over the strokes (else the visited range) of the
    rotary axes, the spindle turned by quarters where the others stand at zero only."""
    rows = [np.zeros(len(chain.joints))]
    for index, joint in enumerate(chain.joints):
        if joint.kind != "rotary":
            continue
        low, high = strokes.get(joint.name, (float(visited[:, index].min()), float(visited[:, index].max())))
        if high - low >= 2.0 * math.pi:
            low, high = low, low + 2.0 * math.pi - STEP_RAD
        steps = STEP_RAD * np.arange(math.ceil(low / STEP_RAD - 1e-9), math.floor(high / STEP_RAD + 1e-9) + 1)
        rows = [np.where(np.arange(len(row)) == index, value, row) for row in rows for value in steps] or rows
    spindles = [index for index, joint in enumerate(chain.joints) if joint.kind == "spindle"]
    if spindles and np.ptp(visited[:, spindles]) > 0.0:
        for angle in SPINDLE[1:]:
            turned = np.zeros(len(chain.joints))
            turned[spindles] = angle
            rows.append(turned)
    return np.array(rows)


def more_balls(places: Array, count: int) -> Array:
    """``count`` further places (count, 3) mm within the cylinder about the table's axis that the given ones span.

    Golden-angle spiral (Vogel, Mathematical Biosciences 44 (1979) 179): spread evenly however many there are.
    """
    radius = np.linalg.norm(places[:, :2], axis=1)
    low, high = float(radius.min()) / 2.0, float(radius.max())
    bottom, top = float(places[:, 2].min()), float(places[:, 2].max())
    number = np.arange(count)
    share = (number + 0.5) / count
    distance = np.sqrt(low**2 + (high**2 - low**2) * share)
    angle = number * math.pi * (3.0 - math.sqrt(5.0)) + 0.5
    # Heights by the golden ratio too, so that height and radius do not go together.
    height = bottom + (top - bottom) * np.mod(number * (math.sqrt(5.0) - 1.0) / 2.0 + 0.25, 1.0)
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle), height])
