"""How far the tool travels along a direction, seen from the work, when linear axes move: for exports of deviations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from monitor.records import Array, Machine, Vector

#: No machine is wrong by more than this part of its travel.
_LARGEST = 0.01
#: ISO 841: U, V, W are parallel to X, Y, Z.
_DIRECTIONS: Mapping[str, Vector] = {
    **dict.fromkeys("XU", (1.0, 0.0, 0.0)),
    **dict.fromkeys("YV", (0.0, 1.0, 0.0)),
    **dict.fromkeys("ZW", (0.0, 0.0, 1.0)),
}


def gains(machine: Machine, direction: Vector) -> dict[str, float]:
    """Return by linear axis how much r . n grows with its reading, all rotary axes at zero.

    r is the vector from the work point to the tool point, n the ``direction``; by ISO 841 a growing reading moves the
    tool in the axis' direction or the work against it.
    """
    if machine.chain:
        linear = [axis for axis in machine.chain if axis.kind == "linear"]
        along = {axis.name: axis.direction for axis in linear}
        on_work = {axis.name for axis in linear if axis.branch == "work"}
        signs = {axis.name: axis.sign for axis in linear if axis.sign is not None}
    else:
        work_side, _, _ = machine.topology.partition("b")
        names = [name for name in machine.topology.split() if name[0] in _DIRECTIONS]
        along = {name: _DIRECTIONS[name[0]] for name in names}
        on_work = {name for name in names if name in work_side.split()}
        signs = {}
    signs = {**{name: axis.sign for name, axis in machine.axes.items() if axis.sign is not None}, **signs}
    gain = {}
    for name, axis in along.items():
        side = -1 if name in on_work else 1
        gain[name] = side * signs.get(name, side) * float(np.dot(axis, direction))
    return gain


def exchanged(deviations: Array, along: Array) -> str | None:
    """Return a sentence where deviations (n) in µm range over a hundredth of the travel (n) in mm."""
    errors, way = float(np.ptp(deviations)), float(np.ptp(along))
    if errors <= 1e3 * way * _LARGEST:
        return None
    return f"deviations range over {errors:.4g} µm on {way:.4g} mm of travel: are columns or units exchanged?"


def travel(machine: Machine, direction: Vector, readings: Mapping[str, Array]) -> tuple[Array, float]:
    """Return the travel along the direction (n) in mm from the first row, and which way deviations count.

    The second number is -1 where one axis alone moves and its growing reading moves the tool against the direction:
    deviations are stated along the axis. Where several move (a diagonal) it is 1, 0 where nothing moves along it.
    """
    gain = gains(machine, direction)
    total = np.zeros(len(next(iter(readings.values()), np.zeros(0))))
    for name, values in readings.items():
        total = total + gain.get(name, 0.0) * (values - values[0])
    moving = [
        name for name, values in readings.items() if np.ptp(values) > 0.0 and abs(gain.get(name, 0.0)) > 1e-9
    ]
    if not moving:
        return total, 0.0
    return total, float(np.sign(gain[moving[0]])) if len(moving) == 1 else 1.0
