"""The axes that a topology string names, and the column that each one's readings stand in.

Only the words of the string are checked here; what the chain means is the machine room's.
"""

from __future__ import annotations

import re
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
        """What the axis' column ends in."""
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
    """The axes of a machine, whether it places them freely or names them by letters; none where it cannot be read."""
    if machine.chain:
        return tuple(Axis(axis.name, axis.kind) for axis in machine.chain)
    return axes_of(machine.topology)[0]


def axes_of(topology: str) -> tuple[tuple[Axis, ...], str | None]:
    """The axes that a topology string names, and what is wrong with the string (None if nothing is).

    With a fault the axes are those that could be made out, none where that would mislead.
    """
    words: list[str] = []
    axes: list[Axis] = []
    for bracket, name, mark, wrong in TOKEN.findall(topology):
        if wrong:
            return (), f"{quoted(wrong)} has no meaning in a topology; {EXAMPLE}"
        words.append(mark or (f"({name})" if bracket else name))
        if not name:
            continue
        if name[0] not in (ROTARY if bracket else LINEAR + ROTARY):
            what = "a spindle" if bracket else "an axis"
            letters = "A, B, C" if bracket else "X, Y, Z, U, V, W (linear) and A, B, C (rotary)"
            return (), f"{what} cannot be called {name[:20]}; the letters are {letters}"
        axes.append(Axis(name, "spindle" if bracket else "linear" if name[0] in LINEAR else "rotary"))
    names = [axis.name for axis in axes]
    twice = sorted({name for name in names if names.count(name) > 1})
    if [words.count(mark) for mark in "wbt"] != [1, 1, 1]:
        return (), f"name w (workpiece), b (bed) and t (tool) once each; {EXAMPLE}"
    if words[0] != "w" or words[-1] != "t":
        return (), f"the topology must begin with w and end with t; {EXAMPLE}"
    if not axes:
        return (), f"the topology has no axis; {EXAMPLE}"
    if twice:
        return (), f"axis {twice[0][:20]} appears twice; name each axis once"
    spindles = [place for place, axis in enumerate(axes) if axis.kind == "spindle"]
    if spindles and (len(spindles) > 1 or words[-2] != f"({names[-1]})"):
        return (), f"the spindle in brackets stands once, just before t; {EXAMPLE}"
    return tuple(axes), None
