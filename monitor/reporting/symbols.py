"""Describes the ISO 230-1 symbol of a parameter, in the few words that a table has room for."""

from __future__ import annotations

import re
from decimal import Decimal

from monitor.reporting.texts import Texts, texts_of

#: Direction letter of a symbol: the axis of the machine frame, and whether the error turns.
_DIRECTIONS = {
    "X": ("X", False),
    "Y": ("Y", False),
    "Z": ("Z", False),
    "A": ("X", True),
    "B": ("Y", True),
    "C": ("Z", True),
}
#: An error of a table at a node, ``EXX(-88)``, and a point of a shape, ``shape(W7)``.
_AT = re.compile(r"(?P<symbol>E[XYZABC]0?(?P<axis>[XYZUVWABC]\d*))\((?P<place>[^()]+)\)")
_SHAPE = re.compile(r"shape\((?P<point>.+)\)")
_TEETH = re.compile(r"sawtooth(?P<pitch>[\d.]+)mm\((?P<edge>-?[\d.]+)\)")
#: A step, or the one of several that a number is of: ``step8mm(-60,110).110mm``.
_STEP = re.compile(r"step(?:(?P<width>[\d.]+)mm)?\((?P<places>[-\d.,]+)\)(?:\.(?P<of_several>-?[\d.]+)mm)?")
#: ``J2`` is a joint of a robot, ``DEC`` an axis of a mount: such names do not say along which direction an axis lies.
_SYMBOL = re.compile(
    r"E(?P<direction>[XYZABC])(?P<location>0?)(?P<axis>[XYZUVWABC]\d*|J\d+|[A-Z]{2,}\d*)(?::(?P<rest>.+))?"
)
_TELLS_ITS_DIRECTION = re.compile(r"[XYZUVWABC]\d*")


def describe(symbol: str, texts: Texts | None = None) -> str:
    """Describe a symbol such as ``EA0B``, ``EXX`` or ``EYX:poly2``; a symbol of another kind stays as it is.

    Location errors after ISO 230-1:2012 3.7 (orientation and position of an axis), error motions after 3.4
    to 3.6. A first-order positioning error of a linear axis is its gain. In English without ``texts``.
    """
    say = texts or texts_of()
    if (point := _SHAPE.fullmatch(symbol)) is not None:
        return say("terms.shape", point=point["point"])
    if (at := _AT.fullmatch(symbol)) is not None:
        unit = "deg" if at["axis"][0] in "ABC" else "mm"
        plain = describe(f"{at['symbol']}:table", texts).removesuffix(" (table)")
        return f"{plain} {say(f'terms.at_{unit}', place=at['place'])}"
    match = _SYMBOL.fullmatch(symbol)
    if match is None:
        return symbol
    direction, turns = _DIRECTIONS[match["direction"]]
    axis, rest = match["axis"], match["rest"]
    knows_direction = _TELLS_ITS_DIRECTION.fullmatch(axis) is not None
    spindle = knows_direction and len(axis) > 1 and axis[0] in "ABC"
    named = say("terms.spindle" if spindle else "terms.axis", name=axis)
    if match["location"]:
        kind = _location(match["direction"], axis if knows_direction else "", turns)
    elif knows_direction:
        kind = _motion(match["direction"], axis, turns, rest)
    else:
        kind = "turn" if turns else "displacement"  # the name does not say which are its roll and its tilts
    shape = "" if kind == "gain" or not rest else f" ({_in_words(rest, say)})"
    return say(f"terms.{kind}", direction=direction, axis=named) + shape


def _in_words(shape: str, say: Texts) -> str:
    """A shape as written; of teeth and steps what their number is the size of."""
    if (teeth := _TEETH.fullmatch(shape)) is not None:
        pitch, edge = (say.number(Decimal(teeth[name])) for name in ("pitch", "edge"))
        return say("terms.teeth", pitch=pitch, edge=edge)
    step = _STEP.fullmatch(shape)
    if step is None:
        return shape
    reading = step["of_several"] or step["places"]
    if "," in reading:
        return shape
    at_reading = say.number(Decimal(reading))
    if step["width"] is None:
        return say("terms.step", place=at_reading)
    return say("terms.step_over", place=at_reading, width=say.number(Decimal(step["width"])))


def _location(direction: str, axis: str, turns: bool) -> str:
    if not turns:
        return "position"
    return "zero_angle" if direction == axis[:1] else "orientation"


def _motion(direction: str, axis: str, turns: bool, rest: str | None) -> str:
    rotary = axis[0] in "ABC"
    if direction == axis[0]:
        if not rotary and rest in (None, "poly1"):
            return "gain"
        return "angular_positioning" if rotary else "positioning"
    if turns:
        return "roll" if _DIRECTIONS[direction][0] == axis[0] else "tilt"
    if rotary:
        return "axial" if "XYZ"["ABC".index(axis[0])] == direction else "displacement"
    return "straightness"
