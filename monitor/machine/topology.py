"""A serial machine: its joints from the bed outwards, as the machine file places them or as letters.

``w C B X b Z Y (C1) t`` (ISO 10791-1) is read from the workpiece to the tool: ``b`` is the bed, an axis in
brackets the spindle. X, Y, Z (and U, V, W parallel to them) are linear, A, B, C rotary about X, Y, Z; a digit
after the letter tells axes of the same letter apart. ``V [w C B X b Z S t]`` (ISO 10791-6) is read,
too. The letters are a short form: they are first written out
as axes that pass through the machine's origin along X, Y or Z, and one function makes the chain of either.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from monitor.exceptions import TopologyError
from monitor.records import Branch, ChainAxis, Kind, Vector
from monitor.topology_text import plain_topology, topology_of

X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)

# ISO 841: U, V, W are parallel to X, Y, Z; A, B, C turn about X, Y, Z.
LINEAR: dict[str, Vector] = {"X": X, "Y": Y, "Z": Z, "U": X, "V": Y, "W": Z}
ROTARY: dict[str, Vector] = {"A": X, "B": Y, "C": Z}
TOKEN = re.compile(r"\(([A-Z]\d*)\)|([A-Z]\d*)|([wbt])|(\S)")
# Rounding of a unit vector that was divided by its length leaves a few 1e-16.
UNIT_TOLERANCE = 1e-12
EXAMPLE = "an example is 'w C B X b Z Y (C1) t'"


@dataclass(frozen=True)
class Joint:
    """One axis: ``direction`` is the unit vector of its travel or rotation in its own frame at zero.

    ``sign`` turns a reading into the physical displacement of the carriage, q = sign * reading. ``offset``
    (mm) leads from the frame of the axis before to this one's at all zero.
    """

    name: str
    kind: Kind
    direction: Vector
    branch: Branch
    sign: int
    offset: Vector = (0.0, 0.0, 0.0)

    @property
    def turns(self) -> bool:
        """Whether the joint rotates."""
        return self.kind != "linear"

    @property
    def main(self) -> int:
        """The machine's direction (0 X, 1 Y, 2 Z) that the axis lies closest to, the first of equals."""
        return max(range(3), key=lambda axis: (round(abs(self.direction[axis]), 9), -axis))


@dataclass(frozen=True)
class Chain:
    """A serial chain. ``joints`` holds the work branch from the bed outwards, then the tool branch.

    ``down`` is the direction of gravity in the machine's frame where somebody said it.
    """

    topology: str
    work: tuple[Joint, ...]
    tool: tuple[Joint, ...]
    down: Vector | None = None
    joints: tuple[Joint, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", self.work + self.tool)
        names = [joint.name for joint in self.joints]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise TopologyError(
                f"topology '{self.topology}': axis {twice[0]} appears twice; name each axis once"
            )

    def index(self, name: str) -> int:
        """The place of an axis in ``joints``; TopologyError if the chain has no such axis."""
        for index, joint in enumerate(self.joints):
            if joint.name == name:
                return index
        raise TopologyError(
            f"topology '{self.topology}' has no axis {name}; it has {', '.join(j.name for j in self.joints)}"
        )

    def joint(self, name: str) -> Joint:
        """The axis of that name."""
        return self.joints[self.index(name)]

    def of_kind(self, kind: Kind) -> tuple[Joint, ...]:
        """All joints of a kind, in the order of ``joints``."""
        return tuple(joint for joint in self.joints if joint.kind == kind)

    @property
    def gravity(self) -> Vector:
        """The direction of gravity in the machine frame at all axes zero.

        A topology does not state it. The linear axis next to the tool is taken as the vertical one, as on
        horizontal machines (Y carries the spindle head) and vertical ones (Z does); Z without such an axis.
        """
        if self.down is not None:
            return self.down
        for joint in reversed(self.tool):
            if joint.kind == "linear":
                x, y, z = joint.direction
                return (-x, -y, -z)
        return (0.0, 0.0, -1.0)


def _tokens(text: str) -> list[tuple[str, bool]]:
    tokens = []
    for match in TOKEN.finditer(text):
        spindle, axis, mark, wrong = match.groups()
        if wrong:
            raise TopologyError(f"topology '{text}': '{wrong}' has no meaning here; {EXAMPLE}")
        tokens.append((spindle or axis or mark, spindle is not None))
    return tokens


def _letter_axis(text: str, name: str, spindle: bool, branch: Branch) -> ChainAxis:
    letter = name[0]
    if letter in LINEAR and not spindle:
        return ChainAxis(name, "linear", branch, LINEAR[letter])
    if letter in ROTARY:
        return ChainAxis(name, "spindle" if spindle else "rotary", branch, ROTARY[letter])
    allowed = "A, B, C" if spindle else "X, Y, Z, U, V, W (linear) and A, B, C (rotary)"
    what = "a spindle" if spindle else "an axis"
    raise TopologyError(f"topology '{text}': {what} cannot be called {name}; the letters are {allowed}")


def _joint(axis: ChainAxis, sign: int) -> Joint:
    if sign not in (1, -1):
        raise TopologyError(f"axis {axis.name}: sign must be +1 or -1, not {sign}")
    length = sum(part * part for part in axis.direction)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise TopologyError(
            f"axis {axis.name}: its direction {list(axis.direction)} is no unit vector; divide it by its length"
        )
    x, y, z = axis.direction
    if (x, y, z) in (opposite(X), opposite(Y), opposite(Z)):
        # The same axis said the other way round, so that every axis along X, Y or Z has a positive direction.
        x, y, z = opposite((x, y, z))
        sign = -sign
    return Joint(axis.name, axis.kind, (x + 0.0, y + 0.0, z + 0.0), axis.branch, sign, axis.offset)


def opposite(direction: Vector) -> Vector:
    """The vector of the other sign, without negative zeros."""
    x, y, z = direction
    return (0.0 - x, 0.0 - y, 0.0 - z)


def chain_of_axes(
    axes: Sequence[ChainAxis], signs: Mapping[str, int] | None = None, gravity: Vector | None = None
) -> Chain:
    """The chain of axes, the work branch from the bed outwards, then the tool branch, both in order.

    ``signs`` gives +1 or -1 for axes that have none of their own; without one ISO 841 holds. Raises
    TopologyError for a sign that is neither, a direction that is no unit vector, an axis named twice.
    """
    stated = dict(signs or {})
    joints = []
    for axis in axes:
        # ISO 841: a positive reading moves the tool relative to the workpiece positively.
        usual = 1 if axis.branch == "tool" else -1
        joints.append(_joint(axis, stated.get(axis.name, usual) if axis.sign is None else axis.sign))
    work = tuple(joint for joint in joints if joint.branch == "work")
    tool = tuple(joint for joint in joints if joint.branch == "tool")
    return Chain(topology_of(axes), work, tool, gravity)


def parse_topology(text: str, signs: Mapping[str, int] | None = None, gravity: Vector | None = None) -> Chain:
    """The chain of a topology string.

    ``signs`` gives +1 or -1 for axes whose machine file says so; without one ISO 841 holds. ``gravity`` is its
    direction in the machine's frame where it is known. Raises
    TopologyError, with what would be right, for a string that cannot be parsed, an axis named twice, a
    spindle that is not next to the tool, or a chain without any axis.
    """
    plain, down = plain_topology(text)
    tokens = _tokens(plain)
    names = [name for name, _ in tokens]
    if any(names.count(end) != 1 for end in ("w", "b", "t")):
        raise TopologyError(
            f"topology '{text}' must name w (workpiece), b (bed) and t (tool) once each; {EXAMPLE}"
        )
    bed = names.index("b")
    if names[0] != "w" or names[-1] != "t":
        raise TopologyError(f"topology '{text}' must begin with w and end with t; {EXAMPLE}")
    if len(names) == 3:
        raise TopologyError(f"topology '{text}' has no axis; {EXAMPLE}")
    spindles = [index for index, (_, spindle) in enumerate(tokens) if spindle]
    if len(spindles) > 1 or (spindles and (spindles[0] < bed or spindles[0] != len(tokens) - 2)):
        raise TopologyError(f"topology '{text}': the spindle in brackets belongs just before t; {EXAMPLE}")
    axes = [_letter_axis(text, name, spin, "work") for name, spin in reversed(tokens[1:bed])]
    axes += [_letter_axis(text, name, spin, "tool") for name, spin in tokens[bed + 1 : -1]]
    return chain_of_axes(axes, signs, down if gravity is None else gravity)
