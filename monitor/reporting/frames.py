"""What a parameter refers to, in words: the machine frame, the axis before it in the chain, or the frame of its own
axis."""

from __future__ import annotations

from collections.abc import Mapping

from monitor.records import FrameKind, FrameOfReference
from monitor.reporting.numbers import MINUS
from monitor.reporting.texts import Texts


def frame_words(frame: FrameOfReference | None) -> str:
    """What a parameter refers to in the few words of a table; nothing for one that is no error of the chain."""
    if frame is None:
        return ""
    if frame.kind is FrameKind.MACHINE:
        return "machine"
    return f"axis {frame.axis}" + (" itself" if frame.kind is FrameKind.OWN_AXIS else "")


def referred(description: str, frame: FrameOfReference | None, texts: Texts) -> str:
    """A description of a parameter with what it refers to, in the language of ``texts``."""
    if frame is None:
        return description
    key = {
        FrameKind.MACHINE: "terms.in_machine_frame",
        FrameKind.PRECEDING_AXIS: "terms.relative_to",
        FrameKind.OWN_AXIS: "terms.in_own_frame",
    }[frame.kind]
    axis = texts("terms.axis", name=frame.axis)
    return texts(key, description=description, axis=axis)


def sum_words(terms: Mapping[str, float], decimal_sign: str = ".") -> str:
    """A sum of parameters: ``EA0B + EA0C``, factors of levers (µm by µrad) with four digits."""
    formula = ""
    for name, factor in terms.items():
        sign = MINUS if factor < 0.0 else "+"
        size = (
            ""
            if abs(factor) == 1.0
            else f"{abs(factor):.4g}".replace(".", decimal_sign) + "\N{NO-BREAK SPACE}"
        )
        formula += f" {sign} {size}{name}" if formula or factor < 0.0 else f"{size}{name}"
    return formula.strip()
