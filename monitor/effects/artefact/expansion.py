"""``artefact:expansion``: an artefact that grows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.description import Description
from monitor.effects.registry import BuiltIn
from monitor.records import Array
from monitor.units import METRE, MICROMETRE, Unit


@dataclass(frozen=True)
class Expansion(BuiltIn):
    """Expansion of the artefact about the origin of the table's frame, in proportion to its driver."""

    text: str = "artefact:expansion"
    unit: Unit = MICROMETRE.per(METRE)  # noqa: RUF009 - an immutable constant
    pattern: ClassVar[str] = r"artefact:expansion"

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def shifts(self, context: Context) -> Array:
        return context.nominal[:, :, None]

    def described(self, driven: str) -> Description:
        return Description(
            f"the artefact expands{driven}",
            "the artefact's temperature changes while it is probed",
            "let the artefact take the machine's temperature, or give its expansion coefficient",
            "ISO 230-3:2020; ISO/TR 16015:2003",
        )


REGISTERED = (Expansion,)
