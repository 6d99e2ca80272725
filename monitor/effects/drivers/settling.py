"""``@settling`` and ``@settling10min``: what begins anew with every run, and settles exponentially."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.driver import ExponentialDriver
from monitor.records import Array


@dataclass(frozen=True)
class Settling(ExponentialDriver):
    """The driver 1 - exp(-t / tau), t since the run began: what cools down in the pause before every run."""

    pattern: ClassVar[str] = r"settling(?:(?P<minutes>\d+(?:\.\d+)?)min)?"
    name: ClassVar[str] = "settling"
    # A spindle that stood still for a while, or a probe that was put in, grows within some ten minutes.
    typical_time_constant_s: ClassVar[float] = 600.0

    @property
    def phrase(self) -> str:
        return ", settling exponentially after the begin of every run"

    def time(self, context: Context) -> Array:
        return context.time


REGISTERED = (Settling,)
