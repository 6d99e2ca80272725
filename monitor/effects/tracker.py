"""Effects of what looks at the machine from outside: a tracker or camera whose frame drifts.

Its frame is free in every run, so what changes within a run is all that can be seen. Turns are about the tracker
itself, in the machine's directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects.context import Context
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MICROMETRE, MICRORADIAN, Unit

#: The columns of what a tracker measures, mm in its own frame.
TRACKER_COLUMNS = ("tracker_x_mm", "tracker_y_mm", "tracker_z_mm")


def measured_points(context: Context) -> Array:
    """Points (n, 3) mm in the tracker's frame; EffectError where there is no tracker."""
    if any(name not in context.columns for name in TRACKER_COLUMNS):
        raise EffectError(
            f"nothing was tracked in this campaign: it has no columns {', '.join(TRACKER_COLUMNS)}"
        )
    return np.column_stack([context.columns[name] for name in TRACKER_COLUMNS])


@dataclass(frozen=True)
class TrackerShift:
    """The tracker's frame shifts along the machine's X, Y, Z, in proportion to its driver."""

    text: str = "tracker:shift"
    unit: Unit = MICROMETRE

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".x", ".y", ".z")

    def shifts(self, context: Context) -> Array:
        measured_points(context)
        return np.tile(np.eye(3), (len(context), 1, 1))


@dataclass(frozen=True)
class TrackerTurn:
    """The tracker's frame turns about the tracker, about the machine's X, Y, Z, in proportion to its driver."""

    text: str = "tracker:turn"
    unit: Unit = MICRORADIAN

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".a", ".b", ".c")

    def shifts(self, context: Context) -> Array:
        points = measured_points(context)
        arms = np.zeros((len(context), 3))
        # The nominal points are the measured ones in the machine's frame: a rigid motion in every run.
        for run in np.unique(context.run):
            rows = context.run == run
            own, there = points[rows], context.nominal[rows]
            u, _, vt = np.linalg.svd((there - there.mean(axis=0)).T @ (own - own.mean(axis=0)))
            turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
            arms[rows] = own @ turn.T
        shifts: Array = np.stack([np.cross(axis, arms) for axis in np.eye(3)], axis=-1)
        return shifts
