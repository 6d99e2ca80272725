"""What the ISO 230-1 symbol of a parameter means, in the few words that a table has room for."""

from __future__ import annotations

import re

#: Direction letter of a symbol: the axis of the machine frame, and whether the error turns.
_DIRECTIONS = {
    "X": ("X", False),
    "Y": ("Y", False),
    "Z": ("Z", False),
    "A": ("X", True),
    "B": ("Y", True),
    "C": ("Z", True),
}
_SYMBOL = re.compile(r"E(?P<direction>[XYZABC])(?P<location>0?)(?P<axis>[XYZUVWABC]\d*)(?::(?P<rest>.+))?")


def describe(symbol: str) -> str:
    """A symbol such as ``EA0B``, ``EXX`` or ``EYX:poly2`` in words; a symbol of another kind stays as it is.

    Location errors after ISO 230-1:2012 3.7 (orientation and position of an axis), error motions after 3.4
    to 3.6. A first-order positioning error of a linear axis is its gain.
    """
    match = _SYMBOL.fullmatch(symbol)
    if match is None:
        return symbol
    direction, turns = _DIRECTIONS[match["direction"]]
    axis, rest = match["axis"], match["rest"]
    if match["location"]:
        if turns:
            kind = "zero angle" if match["direction"] == axis[0] else f"orientation about {direction}"
        else:
            kind = f"position in {direction}"
        return f"{kind} of {_named(axis)}{_shape(rest)}"
    rotary = axis[0] in "ABC"
    if match["direction"] == axis[0]:
        if not rotary and rest in (None, "poly1"):
            return f"positioning gain of {_named(axis)}"
        kind = "angular positioning error" if rotary else "positioning error"
    elif turns:
        kind = "roll" if direction == axis[0] else f"tilt about {direction}"
    elif rotary:
        kind = (
            "axial displacement"
            if "XYZ"["ABC".index(axis[0])] == direction
            else f"displacement in {direction}"
        )
    else:
        kind = f"straightness error in {direction}"
    return f"{kind} of {_named(axis)}{_shape(rest)}"


def _named(axis: str) -> str:
    return f"spindle {axis}" if len(axis) > 1 and axis[0] in "ABC" else f"axis {axis}"


def _shape(rest: str | None) -> str:
    return f" ({rest})" if rest else ""
