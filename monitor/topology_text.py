"""The texts of topologies: the letters of ISO 10791-1, made of freely placed axes or of the spelling of ISO 10791-6."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import count

from monitor.records import ChainAxis, Vector


def topology_of(axes: Sequence[ChainAxis]) -> str:
    """The names of freely placed axes from the workpiece to the tool, the spindle in brackets: ``w b J1 J2 t``."""
    work = [axis.name for axis in axes if axis.branch == "work"]
    tool = [
        f"({axis.name})" if axis.kind == "spindle" else axis.name for axis in axes if axis.branch == "tool"
    ]
    return " ".join(["w", *reversed(work), "b", *tool, "t"])


#: ISO 10791-6: H or V (horizontal or vertical spindle), then the code in brackets, a prime behind work axes, S.
_STRUCTURAL_CODE = re.compile(r"\s*(?P<spindle>[HV])?\s*\[(?P<chain>[^\[\]]*)\]\s*")
_SPINDLE = re.compile(r"\(?S\d*\)?(?=\s*t)")


def plain_topology(text: str) -> tuple[str, Vector | None]:
    """A topology in the letters of ISO 10791-1, and the direction of gravity where the spelling states it.

    ``V [w C A Y X b Z S t]`` (ISO 10791-6) is ``w C A Y X b Z (C1) t`` with gravity along -Z; of a horizontal
    spindle (H) gravity is along -Y: ISO 841 gives Z to the spindle and Y to the vertical direction then.
    """
    code = _STRUCTURAL_CODE.fullmatch(text)
    chain = re.sub("(?<=[A-Z0-9])['′’]", "", text if code is None else code["chain"])
    names = re.findall(r"C\d*", chain)
    spindle = next(name for name in (f"C{number}" for number in count(1)) if name not in names)
    down = {"V": (0.0, 0.0, -1.0), "H": (0.0, -1.0, 0.0)}.get((code["spindle"] or "") if code else "")
    return _SPINDLE.sub(f"({spindle})", chain), down
