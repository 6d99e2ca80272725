"""``tracker:shift`` and ``tracker:turn``: the drift of a tracker or camera that observes the machine from outside.

Its frame is free in every run, so only a change within a run can be seen. Turns are about the tracker itself, in the
machine's directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.effects.registry import BuiltIn
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MICROMETRE, MICRORADIAN, Unit

#: The columns of the points that a tracker measures, mm in its frame.
TRACKER_COLUMNS = ("tracker_x_mm", "tracker_y_mm", "tracker_z_mm")


def measured_points(context: Context) -> Array:
    """Return the points (n, 3) mm in the tracker's frame. Raises EffectError where there is no tracker."""
    if any(name not in context.columns for name in TRACKER_COLUMNS):
        raise EffectError(
            f"nothing was tracked in this campaign: it has no columns {', '.join(TRACKER_COLUMNS)}"
        )
    return np.column_stack([context.columns[name] for name in TRACKER_COLUMNS])


def _described(motion: str, driven: str) -> Description:
    return Description(
        f"the frame of the tracker {motion}{driven}",
        "the tracker's stand or the floor gives way, the tracker or the air warms up, or the robot's base moves",
        "warm the tracker up, fix its stand and the robot's base, measure fixed reflectors in between, and measure in "
        "shorter runs",
        "ISO 10360-10:2021 (laser trackers); docs/effects.md",
    )


@dataclass(frozen=True)
class TrackerShift(BuiltIn):
    """A shift of the tracker's frame along the machine's X, Y, Z, in proportion to its driver."""

    text: str = "tracker:shift"
    unit: Unit = MICROMETRE
    pattern: ClassVar[str] = r"tracker:shift"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".x", ".y", ".z")

    def shifts(self, context: Context) -> Array:
        measured_points(context)
        return np.tile(np.eye(3), (len(context), 1, 1))

    def described(self, driven: str) -> Description:
        return _described("shifts", driven)


@dataclass(frozen=True)
class TrackerTurn(BuiltIn):
    """A turn of the tracker's frame about the tracker, about the machine's X, Y, Z, in proportion to its driver."""

    text: str = "tracker:turn"
    unit: Unit = MICRORADIAN
    pattern: ClassVar[str] = r"tracker:turn"

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".a", ".b", ".c")

    def shifts(self, context: Context) -> Array:
        points = measured_points(context)
        arms = np.zeros((len(context), 3))
        # The nominal points are the measured ones in the machine's frame: a rigid motion in every run.
        for run in np.unique(context.run):
            rows = context.run == run
            measured, nominal = points[rows], context.nominal[rows]
            u, _, vt = np.linalg.svd((nominal - nominal.mean(axis=0)).T @ (measured - measured.mean(axis=0)))
            turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
            arms[rows] = measured @ turn.T
        shifts: Array = np.stack([np.cross(axis, arms) for axis in np.eye(3)], axis=-1)
        return shifts

    def described(self, driven: str) -> Description:
        return _described("turns", driven)


REGISTERED = (TrackerShift, TrackerTurn)
