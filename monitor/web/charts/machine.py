"""The machine in three dimensions: its axes as the topology says, around the places that were probed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.web.charts.chart import Trace, in_template

if TYPE_CHECKING:
    from monitor.workflow.explain.residual_vectors import AxisPlace, ResidualsAnswer

#: An error is drawn as a shift of so much of what was probed, or a turn of so many radians.
SHIFT, SWING = 0.08, 0.1
#: Points of the arc that says how a rotary axis turns, which leaves a part of the circle open.
ARC, TURN = 40, np.radians(300.0)


def machine_traces(residuals: ResidualsAnswer) -> list[Trace]:
    """Draw every axis: a linear one as a bar, a rotary one as its line with the arc of its positive turn; the table
    that turns, and the nose of the spindle, so that one sees which end is which.

    Lengths follow what was probed, because a topology has none. A machine seen from outside whose axes lie apart (a
    robot) is drawn as its arm with all axes at zero.
    """
    places = np.array(residuals.place_mm)
    low, high = places.min(axis=0), places.max(axis=0)
    span = max(float((high - low).max()), 1.0)
    arm = [axis for axis in residuals.machine if any(axis.at_mm)]
    traces = [] if not arm else [_arm(residuals.machine)]
    bodies: list[Trace] = []
    corner = low - 0.12 * span
    for axis in residuals.machine:
        direction = np.array(axis.direction)
        if axis.kind == "linear":
            traces.append(_line(axis, corner, corner + 0.26 * span * direction))
        elif arm:
            at = np.array(axis.at_mm)
            traces.append(_line(axis, at, at + 0.06 * span * direction))
            traces.append(_arc(axis, at, 0.045 * span))
        elif axis.kind == "spindle":
            top = (low + high) / 2.0 + direction * (
                float((high - low) @ np.abs(direction)) / 2.0 + 0.1 * span
            )
            traces.append(_line(axis, top, top + 0.3 * span * direction))
            traces.append(_arc(axis, top + 0.24 * span * direction, 0.09 * span))
            bodies.append(_nose(axis, top, direction, 0.2 * span))
        else:
            along = places @ direction
            ends = [np.array(axis.at_mm) + direction * level for level in _ends(along, span)]
            # Named at the end where its arc is: the other one may lie in the spindle.
            traces.append(_line(axis, ends[1], ends[0]))
            traces.append(_arc(axis, ends[0], 0.22 * span))
            if axis is _table_axis(residuals.machine):
                bodies.append(_disc(axis, ends[0], 0.22 * span))
    return [*traces, *bodies]


@dataclass(frozen=True)
class Motion:
    """How the drawing moves where an axis has an error: the ``axes`` that move with it, the ``shift`` in mm and the
    ``turn`` in rad about ``about``, both far larger than the error, and what that is in a ``sentence``."""

    axes: tuple[str, ...]
    shift: tuple[float, ...]
    turn: tuple[float, ...]
    about: tuple[float, ...]
    sentence: str


def motion_of(residuals: ResidualsAnswer) -> Motion | None:
    """Return how an effect moves the machine: the axis of its error, and all that this axis carries.

    The second letter of a term of ISO 230-1 says how: EXB is a shift of B along X, EAB a turn about X. None for an
    effect that is no error of an axis.
    """
    term = re.match(r"E([XYZABC])", residuals.effect or "")
    names = [axis.name for axis in residuals.machine]
    if term is None or residuals.effect_axis not in names:
        return None
    places = np.array(residuals.place_mm)
    span = max(float(np.ptp(places, axis=0).max()), 1.0)
    first = names.index(residuals.effect_axis)
    moving = residuals.machine[first]
    moved = [axis.name for axis in residuals.machine[first:] if axis.carries == moving.carries]
    turns, along = divmod("XYZABC".index(term[1]), 3)
    unit = np.eye(3)[along]
    others = [name for name in moved if name != moving.name]
    carried = (
        f", and with it {', '.join(others)} and the {moving.carries}"
        if others
        else f" and the {moving.carries}"
    )
    return Motion(
        axes=tuple(moved),
        shift=tuple((SHIFT * span * unit).tolist()) if not turns else (0.0, 0.0, 0.0),
        turn=tuple((SWING * unit).tolist()) if turns else (0.0, 0.0, 0.0),
        about=tuple((places.min(axis=0) + places.max(axis=0)) / 2.0)
        if moving.kind != "rotary"
        else moving.at_mm,
        sentence=f"{moving.name} {'turns about' if turns else 'shifts along'} {'XYZ'[along]}{carried}",
    )


def _table_axis(machine: Sequence[AxisPlace]) -> AxisPlace | None:
    """The axis that the workpiece is clamped to, where there is one."""
    return next((axis for axis in reversed(machine) if axis.carries == "workpiece"), None)


def _ends(along: Array, span: float) -> tuple[float, float]:
    """Where a rotary axis is drawn from and to: a little further than what was probed along it."""
    return min(float(along.min()), 0.0) - 0.14 * span, max(float(along.max()), 0.0) + 0.14 * span


def _line(axis: AxisPlace, start: Array, end: Array) -> Trace:
    what = in_template(f"{axis.name}, {axis.kind}, carries the {axis.carries}")
    return {
        "type": "scatter3d", "mode": "lines+text", **_points([start, end]), "text": ["", axis.name],
        "meta": axis.name, "line": {"color": "@mid", "width": 7 if axis.kind == "linear" else 4},
        "textfont": {"color": "@ink", "size": 15}, "hovertemplate": what + "<extra></extra>", "showlegend": False,
    }  # fmt: skip


def _arc(axis: AxisPlace, centre: Array, radius: float) -> Trace:
    """Part of a circle about an axis in the sense of its positive turn, with an arrow's head at its end."""
    direction = np.array(axis.direction)
    across, further = _square_to(direction)
    angles = np.linspace(0.0, TURN, ARC)
    points = list(_round(centre, direction, radius, angles))
    back = points[-1] - 0.35 * radius * (-np.sin(TURN) * across + np.cos(TURN) * further)
    outwards = (points[-1] - centre) / radius
    head = [back + 0.16 * radius * outwards, points[-1], back - 0.16 * radius * outwards]
    return {
        "type": "scatter3d", "mode": "lines", **_points([*points, *head]), "meta": axis.name,
        "line": {"color": "@mid", "width": 4}, "hoverinfo": "skip", "showlegend": False,
    }  # fmt: skip


def _square_to(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors square to a direction; with it they are right-handed."""
    across = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    across /= np.linalg.norm(across)
    return across, np.cross(direction, across)


def _round(centre: Array, direction: Array, radius: float, angles: Array) -> Array:
    """Points about an axis at the angles (n, 3)."""
    across, further = _square_to(direction)
    return centre + radius * (np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * further)


def _disc(axis: AxisPlace, centre: Array, radius: float) -> Trace:
    """The table that turns with an axis."""
    rim = _round(centre, np.array(axis.direction), radius, np.linspace(0.0, 2.0 * np.pi, ARC, endpoint=False))
    corners = np.arange(1, ARC + 1)
    return _body(axis, [centre, *rim], [np.zeros(ARC, np.int64), corners, np.roll(corners, -1)])


def _nose(axis: AxisPlace, tip: Array, direction: Array, length: float) -> Trace:
    """The nose of a spindle, which narrows towards the tool."""
    angles = np.linspace(0.0, 2.0 * np.pi, ARC, endpoint=False)
    near = _round(tip, direction, 0.12 * length, angles)
    far = _round(tip + length * direction, direction, 0.45 * length, angles)
    low = np.arange(ARC)
    after, up = np.roll(low, -1), low + ARC
    triangles = [np.concatenate(pair) for pair in ((low, up), (after, after + ARC), (up, after))]
    return _body(axis, [*near, *far], triangles)


def _body(axis: AxisPlace, points: Sequence[Array], triangles: Sequence[npt.NDArray[np.int64]]) -> Trace:
    """A surface that one can look through, of triangles given by the numbers of their corners."""
    corners = {name: numbers.tolist() for name, numbers in zip("ijk", triangles, strict=True)}
    return {
        "type": "mesh3d", **_points(points), **corners, "meta": axis.name, "color": "@mid", "opacity": 0.22,
        "hoverinfo": "skip", "showlegend": False,
    }  # fmt: skip


def _arm(machine: Sequence[AxisPlace]) -> Trace:
    """The arm of a machine whose axes lie apart: from the bed from axis to axis, all at zero."""
    points = [np.zeros(3), *(np.array(axis.at_mm) for axis in machine if axis.carries == "tool")]
    return {
        "type": "scatter3d", "mode": "lines", **_points(points), "line": {"color": "@rule", "width": 12},
        "hoverinfo": "skip", "showlegend": False, "name": "arm",
    }  # fmt: skip


def _points(points: Sequence[Array]) -> dict[str, list[float]]:
    rounded = np.round(np.array(points), 3) + 0.0
    return {name: rounded[:, index].tolist() for index, name in enumerate("xyz")}
