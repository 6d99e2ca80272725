"""Names a parameter as the shop floor does: ``squareness X-Y`` for what a table calls an orientation about Z."""

from __future__ import annotations

import re

from monitor.reporting.symbols import describe

_LOCATION = re.compile(r"E(?P<direction>[XYZABC])0(?P<axis>[XYZUVWABC]\d*)")
#: The directions of the machine frame, and about which of them each letter of a rotation turns.
_FRAME = "XYZ"
_ABOUT = dict(zip("ABC", _FRAME, strict=True))
#: The direction along which an axis moves, or about which it turns.
_ALONG = {**dict(zip("XYZ", _FRAME, strict=True)), **dict(zip("UVW", _FRAME, strict=True)), **_ABOUT}


def plain_name(symbol: str) -> str:
    """Name the parameter ``symbol`` in shop-floor words; its table description where there are none.

    An orientation of a linear axis is the squareness to the other axis of the plane in which it turns, that of a
    rotary axis or spindle its squareness to the linear axis of that plane (ISO 230-1:2012, 3.7 and Annex A).
    """
    location = _LOCATION.fullmatch(symbol)
    if location is None or location["direction"] not in _ABOUT:
        return describe(symbol)
    about, axis = _ABOUT[location["direction"]], location["axis"]
    along = _ALONG[axis[0]]
    if about == along:
        return describe(symbol)
    (other,) = set(_FRAME) - {about, along}
    if axis[0] not in _ABOUT:
        return "squareness " + "-".join(sorted((axis, other), key=lambda name: _ALONG[name]))
    return f"squareness of {'spindle' if len(axis) > 1 else 'axis'} {axis} to {other}"
