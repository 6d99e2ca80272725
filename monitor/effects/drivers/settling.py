"""``@settling`` and ``@settling10min``: what begins anew with every run, and settles exponentially."""

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

# A spindle that stood still for a while, or a probe that was put in, grows within some ten minutes; where the constant
# is neither given nor searched yet, this is the start.
TYPICAL_TIME_CONSTANT_S = 600.0


@dataclass(frozen=True)
class Settling(SettlingDriver):
    """The driver 1 - exp(-t / tau), t since the run began: what cools down in the pause before every run."""

    pattern: ClassVar[str] = r"settling(?:(?P<minutes>\d+(?:\.\d+)?)min)?"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        if "minutes" not in groups:
            return cls()
        minutes = float(groups["minutes"])
        if minutes == 0:
            raise EffectError("the time constant of @settling must be above 0 min")
        return cls(time_constant_s=MINUTE.to_internal(minutes))

    @property
    def phrase(self) -> str:
        return ", settling exponentially after the begin of every run"

    def columns(self, context: Context, joint: int | None) -> Array:
        tau = TYPICAL_TIME_CONSTANT_S if self.time_constant_s is None else self.time_constant_s
        return -np.expm1(-context.time / tau)[:, None]


REGISTERED = (Settling,)
