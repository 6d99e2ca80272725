"""Axes that ``campaign.toml`` positions freely: ``[[machine.work_chain]]`` and ``[[machine.tool_chain]]``."""

from __future__ import annotations

import math
import re

from monitor.readers.axes import FARTHEST_MM, PARALLEL_KINEMATICS
from monitor.readers.faults import quoted
from monitor.readers.toml_table import Table
from monitor.records import Branch, ChainAxis, Kind, Vector

#: More joints than any serial robot on a rail has; a longer list is a slip.
MOST_JOINTS = 9
# A name stands inside ISO 230-1 symbols (EA0J2) and in columns (j2_deg): it begins with a letter, so that the
# 0 of a location error before it stays readable.
NAME = re.compile(r"[A-Za-z][A-Za-z0-9]{0,15}")
#: What people call the axes of parallel kinematics.
STRUTS = ("strut", "leg", "parallel")
KINDS: tuple[Kind, ...] = ("linear", "rotary", "spindle")
LETTERS: dict[str, Vector] = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
#: A vector typed with four decimals is a unit vector to a ten-thousandth; further off it is something else.
TYPED_TO = 1e-3
ROUNDING = 1e-12
UP = "write X, Y, Z or a unit vector such as [0.0, 0.7071, 0.7071]"


def read_chain(machine: Table) -> tuple[ChainAxis, ...] | None:
    """Read the axes of both branches, bed outwards, the work branch first; empty where there is no such table.

    None if anything in them is wrong; the faults are noted.
    """
    before = len(machine.faults)
    rows = [(row, _axis(row, "work")) for row in machine.tables("work_chain")]
    rows += [(row, _axis(row, "tool")) for row in machine.tables("tool_chain")]
    if len(machine.faults) > before:
        return None
    axes = [(row, axis) for row, axis in rows if axis is not None]
    names: set[str] = set()
    for row, axis in axes:
        if axis.name.casefold() in names:
            row.fault(
                "name",
                f"axis {axis.name} appears twice (small and capital letters are the same in columns); "
                "name each axis once",
            )
        names.add(axis.name.casefold())
    for row, _ in axes[MOST_JOINTS:]:
        row.fault(
            None, f"the chain has {len(axes)} joints; a serial machine here has at most {MOST_JOINTS} of them"
        )
    for row, axis in axes:
        if axis.kind == "spindle" and (axis.branch == "work" or axis is not axes[-1][1]):
            row.fault("kind", "a spindle is the last axis of the tool chain; write rotary, or put it last")
    return None if len(machine.faults) > before else tuple(axis for _, axis in axes)


def _axis(table: Table, branch: Branch) -> ChainAxis | None:
    name = table.text("name", required=True, example='"J1"')
    if name is not None and not NAME.fullmatch(name):
        table.fault(
            "name", f"{quoted(name)} cannot name an axis: write a letter, then letters and digits, such as J1"
        )
        name = None
    kind = _kind(table)
    direction = _direction(table, kind)
    offset = table.numbers("offset_mm", 3, largest=FARTHEST_MM, unit="mm", example="[0.0, 0.0, 400.0]")
    sign = table.sign("sign")
    table.finish()
    if name is None or kind is None or direction is None:
        return None
    x, y, z = offset or (0.0, 0.0, 0.0)
    return ChainAxis(name, kind, branch, direction, (x, y, z), sign)


def _kind(table: Table) -> Kind | None:
    value = table.text("kind", required=True, example='"rotary"')
    for kind in KINDS:
        if value == kind:
            return kind
    if value in STRUTS:
        table.fault("kind", f"{quoted(value)} is no kind of axis: {PARALLEL_KINEMATICS}")
    elif value is not None:
        table.fault("kind", f"{quoted(value)} is no kind of axis; write linear, rotary or spindle")
    return None


def _direction(table: Table, kind: Kind | None) -> Vector | None:
    key, other = ("along", "about") if kind == "linear" else ("about", "along")
    if kind is None:
        table.raw("along", required=False, example="")
        table.raw("about", required=False, example="")
        return None
    if other in table.data:
        does = "travels along" if kind == "linear" else "turns about"
        table.fault(other, f"a {kind} axis {does} a direction: write {key} = ... instead of {other}")
        table.raw(key, required=False, example="")
        table.raw(other, required=False, example="")
        return None
    value = table.raw(key, required=True, example='"Z"')
    if value is None:
        return None
    if isinstance(value, str):
        if value not in LETTERS:
            table.fault(key, f"{quoted(value)} is no direction; {UP}")
        return LETTERS.get(value)
    return unit_vector(table, key)


def unit_vector(table: Table, key: str) -> Vector | None:
    """Read the unit vector under a key, its length made 1 to the last bit where it was typed with a few decimals."""
    if not isinstance(table.data.get(key), list) or len(table.data[key]) != 3:
        table.fault(key, f"{quoted(table.data.get(key))} is no direction; {UP}")
        return None
    vector = table.numbers(key, 3, largest=FARTHEST_MM, unit="1", example="[0.0, 0.0, 1.0]")
    if vector is None:
        return None
    length = math.hypot(*vector)
    if abs(length - 1.0) > TYPED_TO:
        if length == 0.0:
            message = f"the direction has no length; {UP}"
        else:
            right = ", ".join(f"{part / length:.6g}" for part in vector)
            message = f"the direction has the length {length:.6g}; a unit vector has 1: write [{right}]"
        table.fault(key, message)
        return None
    # Divided once: a vector that is of length 1 but for rounding stays as it is, so that it reads back the same.
    if abs(length - 1.0) > ROUNDING:
        vector = tuple(part / length for part in vector)
    return (vector[0], vector[1], vector[2])
