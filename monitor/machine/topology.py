"""A serial machine: its joints from the bed outwards, read from a topology string in ISO 10791-1 notation.

``w C B X b Z Y (C1) t`` is read from the workpiece to the tool: ``b`` is the bed, an axis in brackets the
spindle. X, Y, Z (and U, V, W parallel to them) are linear, A, B, C rotary about X, Y, Z; a digit after the
letter tells axes of the same letter apart.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from monitor.exceptions import TopologyError

Kind = Literal["linear", "rotary", "spindle"]
Branch = Literal["work", "tool"]
Vector = tuple[float, float, float]

X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)

# ISO 841: U, V, W are parallel to X, Y, Z; A, B, C turn about X, Y, Z.
LINEAR: dict[str, Vector] = {"X": X, "Y": Y, "Z": Z, "U": X, "V": Y, "W": Z}
ROTARY: dict[str, Vector] = {"A": X, "B": Y, "C": Z}
TOKEN = re.compile(r"\(([A-Z]\d*)\)|([A-Z]\d*)|([wbt])|(\S)")
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


@dataclass(frozen=True)
class Chain:
    """A serial chain. ``joints`` holds the work branch from the bed outwards, then the tool branch."""

    topology: str
    work: tuple[Joint, ...]
    tool: tuple[Joint, ...]
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
        for place, joint in enumerate(self.joints):
            if joint.name == name:
                return place
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

        The topology does not tell it. The linear axis next to the tool is taken as the vertical one, as on
        horizontal machines (Y carries the spindle head) and vertical ones (Z does); Z without such an axis.
        """
        for joint in reversed(self.tool):
            if joint.kind == "linear":
                x, y, z = joint.direction
                return (-x, -y, -z)
        return (0.0, 0.0, -1.0)


def _tokens(text: str) -> list[tuple[str, bool]]:
    found = []
    for match in TOKEN.finditer(text):
        spindle, axis, mark, wrong = match.groups()
        if wrong:
            raise TopologyError(f"topology '{text}': '{wrong}' has no meaning here; {EXAMPLE}")
        found.append((spindle or axis or mark, spindle is not None))
    return found


def _joint(text: str, name: str, spindle: bool, branch: Branch, signs: Mapping[str, int]) -> Joint:
    letter = name[0]
    if letter in LINEAR and not spindle:
        kind: Kind = "linear"
        direction = LINEAR[letter]
    elif letter in ROTARY:
        kind = "spindle" if spindle else "rotary"
        direction = ROTARY[letter]
    else:
        allowed = "A, B, C" if spindle else "X, Y, Z, U, V, W (linear) and A, B, C (rotary)"
        what = "a spindle" if spindle else "an axis"
        raise TopologyError(f"topology '{text}': {what} cannot be called {name}; the letters are {allowed}")
    # ISO 841: a positive reading moves the tool relative to the workpiece positively.
    sign = signs.get(name, 1 if branch == "tool" else -1)
    if sign not in (1, -1):
        raise TopologyError(f"axis {name}: sign must be +1 or -1, not {sign}")
    return Joint(name, kind, direction, branch, sign)


def parse_topology(text: str, signs: Mapping[str, int] | None = None) -> Chain:
    """The chain of a topology string.

    ``signs`` gives +1 or -1 for axes whose machine file says so; without one ISO 841 holds. Raises
    TopologyError, with what would be right, for a string that cannot be parsed, an axis named twice, a
    spindle that is not next to the tool, or a chain without any axis.
    """
    tokens = _tokens(text)
    names = [name for name, _ in tokens]
    if names.count("w") != 1 or names.count("b") != 1 or names.count("t") != 1:
        raise TopologyError(
            f"topology '{text}' must name w (workpiece), b (bed) and t (tool) once each; {EXAMPLE}"
        )
    bed = names.index("b")
    if names[0] != "w" or names[-1] != "t":
        raise TopologyError(f"topology '{text}' must begin with w and end with t; {EXAMPLE}")
    if len(names) == 3:
        raise TopologyError(f"topology '{text}' has no axis; {EXAMPLE}")
    spindles = [place for place, (_, spindle) in enumerate(tokens) if spindle]
    if len(spindles) > 1 or (spindles and (spindles[0] < bed or spindles[0] != len(tokens) - 2)):
        raise TopologyError(f"topology '{text}': the spindle in brackets belongs just before t; {EXAMPLE}")
    given = dict(signs or {})
    work = tuple(_joint(text, name, spin, "work", given) for name, spin in reversed(tokens[1:bed]))
    tool = tuple(_joint(text, name, spin, "tool", given) for name, spin in tokens[bed + 1 : -1])
    return Chain(" ".join(f"({name})" if spindle else name for name, spindle in tokens), work, tool)
