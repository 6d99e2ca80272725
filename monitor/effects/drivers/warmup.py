"""``@warmup`` and ``@warmup45min``: the exponential approach to a thermal equilibrium."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.driver import SettlingDriver
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import MINUTE

# A machine tool reaches thermal equilibrium in some tens of minutes to hours; where the constant is neither
# given nor searched yet, this is the start.
TYPICAL_TIME_CONSTANT_S = 3600.0


@dataclass(frozen=True)
class WarmUp(SettlingDriver):
    """The driver 1 - exp(-t / tau), t since the first run of the day began."""

    pattern: ClassVar[str] = r"warmup(?:(?P<minutes>\d+(?:\.\d+)?)min)?"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        if "minutes" not in groups:
            return cls()
        minutes = float(groups["minutes"])
        if minutes == 0:
            raise EffectError("the time constant of @warmup must be above 0 min")
        return cls(time_constant_s=MINUTE.to_internal(minutes))

    @property
    def phrase(self) -> str:
        return ", settling exponentially after the day's first start"

    def columns(self, context: Context, joint: int | None) -> Array:
        tau = TYPICAL_TIME_CONSTANT_S if self.time_constant_s is None else self.time_constant_s
        return -np.expm1(-context.day_time / tau)[:, None]


REGISTERED = (WarmUp,)
