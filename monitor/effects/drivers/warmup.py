"""``@warmup`` and ``@warmup45min``: the exponential approach to a thermal equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.driver import ExponentialDriver
from monitor.records import Array


@dataclass(frozen=True)
class WarmUp(ExponentialDriver):
    """The driver 1 - exp(-t / tau), t since the first run of the day began."""

    pattern: ClassVar[str] = r"warmup(?:(?P<minutes>\d+(?:\.\d+)?)min)?"
    name: ClassVar[str] = "warmup"
    # A machine tool reaches thermal equilibrium in some tens of minutes to hours.
    typical_time_constant_s: ClassVar[float] = 3600.0

    @property
    def phrase(self) -> str:
        return ", settling exponentially after the day's first start"

    def time(self, context: Context) -> Array:
        return context.day_time


REGISTERED = (WarmUp,)
