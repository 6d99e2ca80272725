"""The axes that a topology string names, and the columns of their readings.

Only the parts of the string are checked here; the room ``machine`` gives the chain its meaning.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from monitor.readers.faults import quoted
from monitor.records import Kind, Machine
from monitor.units import DEGREE, MILLIMETRE, Unit

EXAMPLE = "an example is 'w C B X b Z Y (C1) t'"
# ISO 10791-1 notation; ISO 841 letters: X, Y, Z, U, V, W linear, A, B, C rotary.
TOKEN = re.compile(r"(\()?([A-Z][0-9]*)(?(1)\))|([wbt])|(\S)")
LINEAR = "XYZUVW"
ROTARY = "ABC"
#: Campaign format 1: without a stroke, a length beyond 100 m or an angle beyond 100 turns is refused.
FARTHEST_MM = 100_000.0
FARTHEST_DEG = 36_000.0


#: Words for machines whose axes carry the tool side by side.
PARALLEL = ("hexa", "delta", "tripod", "stewart", "parallel", "gough")
PARALLEL_KINEMATICS = (
    "the model of a machine is one serial chain, each axis carried by the one before it; hexapods, delta "
    "robots and other parallel kinematics cannot be identified here"
)


@dataclass(frozen=True)
class Axis:
    """One axis of the topology, with the unit that its readings have in a file."""

    name: str
    kind: Kind

    @property
    def unit(self) -> Unit:
        """The unit of the file: mm for a linear axis, degrees for one that turns."""
        return MILLIMETRE if self.kind == "linear" else DEGREE

    @property
    def suffix(self) -> str:
        """The end of the name of the axis' column."""
        return "mm" if self.kind == "linear" else "deg"

    @property
    def column(self) -> str:
        """The column of the axis' readings: ``x_mm``, ``c1_deg``."""
        return f"{self.name.lower()}_{self.suffix}"

    @property
    def farthest(self) -> float:
        """The largest reading without a stroke, in the unit of the file."""
        return FARTHEST_MM if self.kind == "linear" else FARTHEST_DEG


def axes_of_machine(machine: Machine) -> tuple[Axis, ...]:
    """Return the axes of a machine, freely positioned or named by letters; none where the topology cannot be read."""
    if machine.chain:
        return tuple(Axis(axis.name, axis.kind) for axis in machine.chain)
    return axes_of(machine.topology)[0]


def axes_of(topology: str) -> tuple[tuple[Axis, ...], str | None]:
    """Return the axes that a topology string names, and the fault of the string (None if there is none).

    With a fault the axes are those that could be read, none where that would mislead.
    """
    parts: list[str] = []
    axes: list[Axis] = []
    for bracket, name, mark, wrong in TOKEN.findall(topology):
        if wrong and any(word in topology.lower() for word in PARALLEL):
            return (), PARALLEL_KINEMATICS
        if wrong:
            return (), f"{quoted(wrong)} has no meaning in a topology; {EXAMPLE}"
        parts.append(mark or (f"({name})" if bracket else name))
        if not name:
            continue
        if name[0] not in (ROTARY if bracket else LINEAR + ROTARY):
            return (), _misnamed(name, spindle=bool(bracket))
        axes.append(Axis(name, "spindle" if bracket else "linear" if name[0] in LINEAR else "rotary"))
    fault = _fault_of(parts, axes)
    return (tuple(axes), None) if fault is None else ((), fault)


def _misnamed(name: str, *, spindle: bool) -> str:
    subject = "a spindle" if spindle else "an axis"
    letters = "A, B, C" if spindle else "X, Y, Z, U, V, W (linear) and A, B, C (rotary)"
    return f"{subject} cannot be called {name[:20]}; the letters are {letters}"


def _fault_of(parts: Sequence[str], axes: Sequence[Axis]) -> str | None:
    """Return the fault in the order of the parts of a topology; None if there is none."""
    names = [axis.name for axis in axes]
    twice = sorted({name for name in names if names.count(name) > 1})
    if [parts.count(mark) for mark in "wbt"] != [1, 1, 1]:
        return f"name w (workpiece), b (bed) and t (tool) once each; {EXAMPLE}"
    if parts[0] != "w" or parts[-1] != "t":
        return f"the topology must begin with w and end with t; {EXAMPLE}"
    if not axes:
        return f"the topology has no axis; {EXAMPLE}"
    if twice:
        return f"axis {twice[0][:20]} appears twice; name each axis once"
    spindles = [axis for axis in axes if axis.kind == "spindle"]
    if spindles and (len(spindles) > 1 or parts[-2] != f"({names[-1]})"):
        return f"the spindle in brackets stands once, just before t; {EXAMPLE}"
    return None
