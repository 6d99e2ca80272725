"""Which axes and errors a plane of probing sees: two linear axes, the rotary table, their tables and conditions.

Two linear axes u and v span the plane; the table turns about the third direction w. On a vertical machining centre
u, v, w are X, Y, Z and the table is C. The yaw that the plane sees is that of the linear axis that carries something
in the plane: the one on the work side, or the inner one where both stand on one side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from monitor.effects.shapes import nodes_text
from monitor.exceptions import DataError
from monitor.machine import Chain, Joint
from monitor.records import SelfCalibration

LETTERS = "XYZ"
TURNS = "ABC"
#: The boundary conditions that put the frame into the workpiece instead of the table's first angle.
WORKPIECE_CONDITIONS = ("shape shift u", "shape shift v", "shape turn")


@dataclass(frozen=True)
class Plane:
    """The axes of a plane of probing: ``u`` and ``v`` (joints), the ``table``, and which of u, v carries the other."""

    u: Joint
    v: Joint
    table: Joint
    carrier: Joint

    @property
    def carried(self) -> Joint:
        """The linear axis that the other one carries, or that stands opposite to it."""
        return self.v if self.carrier is self.u else self.u

    def letter(self, joint: Joint) -> str:
        """The direction of a joint: X, Y or Z."""
        return LETTERS[_direction(joint)]

    @property
    def turn(self) -> str:
        """The rotation in the plane: A, B or C."""
        return TURNS[_direction(self.table)]

    def term(self, direction: Joint | None, axis: Joint, *, location: bool = False) -> str:
        """The ISO 230-1 symbol of an error of ``axis`` along ``direction``, or in the plane's rotation for None."""
        letter = self.turn if direction is None else self.letter(direction)
        return f"E{letter}{'0' * location}{axis.name}"

    @property
    def axis_terms(self) -> dict[str, Joint]:
        """The tables of the linear axes: symbol to axis, in the order of Table 1 of the paper."""
        return {
            self.term(self.u, self.u): self.u,
            self.term(self.v, self.u): self.u,
            self.term(self.u, self.v): self.v,
            self.term(self.v, self.v): self.v,
            self.term(None, self.carrier): self.carrier,
        }

    @property
    def table_terms(self) -> tuple[str, ...]:
        """The rotary table's errors at every angle: its place along u and v, and its turn."""
        return (
            self.term(self.u, self.table, location=True),
            self.term(self.v, self.table, location=True),
            self.term(None, self.table),
        )

    @property
    def squareness(self) -> str:
        """The squareness of the carried axis to its carrier."""
        return self.term(None, self.carried, location=True)


def plane_of(chain: Chain) -> Plane:
    """The plane in which a chain can probe a workpiece that its table turns. Raises DataError where it has none."""
    if not chain.work or not chain.work[-1].turns:
        raise DataError(
            f"free-form needs a rotary table under the workpiece; in '{chain.topology}' the last axis before w is "
            f"{chain.work[-1].name if chain.work else 'none'}"
        )
    table = chain.work[-1]
    w = _direction(table)
    linear = [joint for joint in chain.joints if not joint.turns and _direction(joint) != w]
    if len(linear) != 2:
        raise DataError(
            f"free-form needs two linear axes across {table.name}; '{chain.topology}' has "
            f"{', '.join(joint.name for joint in linear) or 'none'}"
        )
    u = next(joint for joint in linear if _direction(joint) == (w + 1) % 3)
    v = next(joint for joint in linear if _direction(joint) == (w + 2) % 3)
    on_work = [joint for joint in chain.work if joint in linear]
    on_tool = [joint for joint in chain.tool if joint in linear]
    return Plane(u, v, table, (on_work or on_tool)[0])


def _direction(joint: Joint) -> int:
    if 1.0 not in joint.direction:
        raise DataError(f"free-form needs axes along X, Y or Z; {joint.name} stands across them")
    return joint.main


def at(symbol: str, position: float) -> str:
    """The name of an error at a place: ``EXX(-88)``."""
    return f"{symbol}({position:.9g})"


def all_conditions(plane: Plane, nodes: dict[str, tuple[float, ...]], first_angle: float) -> dict[str, str]:
    """The eleven boundary conditions of Eqs. (16) and (17) by parameter, each with what it fixes, in words.

    ``nodes`` (axis to readings) need one at 0 each, or the node nearest to 0 is taken.
    """
    u, v, table = plane.u.name, plane.v.name, plane.table.name
    first, second = plane.letter(plane.u), plane.letter(plane.v)
    meaning = {
        plane.term(plane.u, plane.u): f"where {u} counts its positioning error from",
        plane.term(plane.v, plane.u): f"the origin in {second} along {u}",
        plane.term(plane.u, plane.v): f"the origin in {first} along {v}",
        plane.term(plane.v, plane.v): f"where {v} counts its positioning error from",
        plane.term(
            None, plane.carrier
        ): f"the direction that {plane.carried.name} has where {plane.carrier.name} stands at its origin",
    }
    conditions = {
        at(symbol, min(nodes[axis.name], key=abs)): meaning[symbol]
        for symbol, axis in plane.axis_terms.items()
    }
    shift_u, shift_v, turn = plane.table_terms
    conditions |= {
        at(shift_u, first_angle): f"the origin in {first}: the axis of {table} at its first angle",
        at(shift_v, first_angle): f"the origin in {second}: the axis of {table} at its first angle",
        at(turn, first_angle): f"the angle of the workpiece on {table} at its first angle",
        at(
            plane.term(plane.v, plane.u), nodes[u][-1]
        ): f"the direction of {u}: a straight line through both conditions",
        at(
            plane.term(plane.u, plane.v), nodes[v][-1]
        ): f"the direction of {v}: a straight line through both conditions",
        at(
            plane.term(plane.u, plane.u), nodes[u][-1]
        ): "the unit of length, which must be measured by other means",
    }
    return conditions


def base_texts(
    plane: Plane, calibration: SelfCalibration, angles: Sequence[float], held: set[str]
) -> tuple[str, ...]:
    """The effects that are free in every run, with the nodes of ``held`` parameters fixed at zero."""

    def table(symbol: str, positions: Sequence[float]) -> str:
        return f"{symbol}:{nodes_text(positions, [position for position in positions if at(symbol, position) in held])}"

    return (
        *(table(symbol, calibration.nodes[axis.name]) for symbol, axis in plane.axis_terms.items()),
        plane.squareness,
        *(table(symbol, angles) for symbol in plane.table_terms),
        "shape",
    )
