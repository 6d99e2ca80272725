"""Names a parameter as the shop floor does: ``squareness X-Y`` for what a table calls an orientation about Z."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import lru_cache

from monitor.reporting.symbols import describe
from monitor.topology_text import plain_topology

_LOCATION = re.compile(r"E(?P<direction>[ABC])0(?P<axis>[XYZUVWABC]\d*)")
_AXIS = re.compile(r"\(?([XYZUVWABC]\d*)\)?")
#: The directions of the machine frame, and about which of them each letter of a rotation turns.
_FRAME = "XYZ"
_ABOUT = dict(zip("ABC", _FRAME, strict=True))
#: The direction along which an axis moves, or about which it turns.
_ALONG = {**dict(zip("XYZ", _FRAME, strict=True)), **dict(zip("UVW", _FRAME, strict=True)), **_ABOUT}


def plain_name(symbol: str, topology: str, parameters: Collection[str]) -> str:
    """Name the parameter ``symbol`` in shop-floor words; its table description where there are none.

    An orientation of an axis is stated relative to the axis before it in its branch of the ``topology``, and rotations
    add along the branch (docs/conventions.md). It is therefore the squareness (ISO 230-1:2012, 3.7) to that axis of
    the plane which turns by all of the ``parameters`` before it, and by no other: on ``w C b X Y Z t`` EB0Z is that of
    Z to X, and EB0X that of X to the axis of the table. Where no such axis is, or the chain is not known, nothing is
    claimed: an axis that is merely parallel to it gives a parallelism.
    """
    location = _LOCATION.fullmatch(symbol)
    if location is None or not topology:
        return describe(symbol)
    about, axis = location["direction"], location["axis"]
    partner = _partner(axis, about, topology, frozenset(parameters) | {symbol})
    if partner is None:
        return describe(symbol)
    return _between(axis, partner)


def _between(axis: str, partner: str) -> str:
    """The name of the angle between two axes."""
    kind = "parallelism" if _ALONG[axis[0]] == _ALONG[partner[0]] else "squareness"
    if kind == "squareness" and not _turns(axis) and not _turns(partner):
        return "squareness " + "-".join(sorted((axis, partner), key=lambda name: _ALONG[name[0]]))
    what = f"{'spindle' if len(axis) > 1 else 'axis'} {axis}" if _turns(axis) else axis
    return f"{kind} of {what} to {f'axis {partner}' if _turns(partner) else partner}"


def _turns(axis: str) -> bool:
    return axis[0] in _ABOUT


@lru_cache(maxsize=4096)
def _partner(axis: str, about: str, topology: str, parameters: frozenset[str]) -> str | None:
    """The axis that the orientation of ``axis`` is an angle to; None where there is none."""
    branches = _branches(topology)
    if branches is None or not any(axis in branch for branch in branches) or _ALONG[axis[0]] == _ABOUT[about]:
        return None
    turned: dict[str, frozenset[str]] = {}
    for branch in branches:
        # What turns each axis about this direction: its own orientation, and those of the axes between it and the bed.
        for number, name in enumerate(branch):
            turned[name] = frozenset(f"E{about}0{before}" for before in branch[: number + 1]) & parameters
    before = turned[axis] - {f"E{about}0{axis}"}
    others = [
        name
        for name, by in turned.items()
        if name != axis and by == before and _ALONG[name[0]] != _ABOUT[about]
    ]
    # Squareness before parallelism, linear axes before rotary ones; of equals the first from the bed.
    others.sort(key=lambda name: (_ALONG[name[0]] == _ALONG[axis[0]], _turns(name)))
    return others[0] if others else None


def _branches(topology: str) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """The axes of both branches from the bed outwards; None of a machine whose axes letters do not place."""
    text, _ = plain_topology(topology)
    names = text.split()
    if names.count("b") != 1 or names[0] != "w" or names[-1] != "t":
        return None
    bed = names.index("b")
    axes = [_AXIS.fullmatch(name) for name in (*names[1:bed], *names[bed + 1 : -1])]
    if any(match is None for match in axes):
        return None
    letters = [match[1] for match in axes if match is not None]
    return tuple(reversed(letters[: bed - 1])), tuple(letters[bed - 1 :])
