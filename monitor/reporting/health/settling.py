"""Words for a change that passes again: a parameter that begins off and settles, as one that warms up or runs in."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.documents import Sentence
from monitor.reporting.health.words import in_words

#: Time constants below this are said in hours.
_SHORT_DAYS = 2.0


@dataclass(frozen=True)
class ParameterSettled(Sentence):
    """A parameter began ``size`` with ``u`` off the value that it settles at, with a time constant in days."""

    parameter: str
    size: float
    u: float
    unit: str
    time_constant_days: float

    def __str__(self) -> str:
        size, u = in_words(abs(self.size), self.u)
        side = "above" if self.size > 0.0 else "below"
        days = self.time_constant_days
        time = f"{24.0 * days:.2g} h" if days < _SHORT_DAYS else f"{days:.2g} days"
        return (
            f"{self.parameter} began {size} {self.unit} (u = {u} {self.unit}) {side} where it settles, with a time "
            f"constant of about {time} (a transient, as of warming up or running in)"
        )
