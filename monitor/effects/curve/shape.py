"""What a shape of a curve's effect is. Another one is one more file of ``shapes``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from monitor.effects.curve.effect import SEQUENCE, CurveEffect, Inputs
from monitor.effects.description import Description
from monitor.records import Array

# Where the shapes and their treatment are described.
CALIBRATION = "NIST/SEMATECH e-Handbook 2.3.6 (instrument calibration over a regime)"
FIT = "NIST/SEMATECH e-Handbook 4.6.1 (load cell calibration)"
DRIFT = "NIST/SEMATECH e-Handbook 2.3.7 and 2.2 (statistical control of a measurement process)"
PERIODIC = "NIST/SEMATECH e-Handbook 1.4.2.5 (beam deflections)"
GROUPS = "NIST/SEMATECH e-Handbook 2.6 (case studies: probes, runs, days); ISO 5725-2:2019"


@dataclass(frozen=True)
class Subject:
    """What a description is about: an effect, the response, the unit of the input, whether the input is the time."""

    effect: CurveEffect
    response: str
    unit: str
    is_time: bool

    @property
    def course(self) -> str:
        """How the response follows the input."""
        return "from row to row" if self.effect.column == SEQUENCE else f"with {self.effect.column}"


class CurveShape(Protocol):
    """What every shape offers."""

    def columns(self, effect: CurveEffect, inputs: Inputs, value: float | None) -> Array:
        """Return the columns (n, k) of an effect; ``value`` is that of a shape that has one."""
        ...

    def names(self, effect: CurveEffect, inputs: Inputs) -> tuple[str, ...]:
        """Return a name for each coefficient."""
        ...

    def described(self, subject: Subject) -> Description:
        """Describe an effect in words."""
        ...
