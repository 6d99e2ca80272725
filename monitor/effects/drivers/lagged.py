"""``@lagged_x_axis_degC`` and ``@lagged45min_x_axis_degC``: a part that follows a recorded temperature late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.driver import SettlingDriver
from monitor.effects.drivers.channel import Channel
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import KELVIN, MINUTE, Unit

# A slide or a column follows its sensor in minutes to an hour; where the constant is neither given nor searched yet,
# this is the start.
TYPICAL_TIME_CONSTANT_S = 1800.0


@dataclass(frozen=True)
class LaggedTemperature(SettlingDriver):
    """What follows a temperature with one time constant, less 20 °C: tau dy/dt = T - y.

    Between two readings, and over the gaps between the runs of a day, the temperature is taken as a straight line; at
    the first reading of a day everything has settled. Both limits matter only within some time constants of a gap.
    """

    channel: str
    pattern: ClassVar[str] = r"lagged(?:(?P<minutes>\d+(?:\.\d+)?)min)?_(?P<channel>\w+_degC)"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        if "minutes" not in groups:
            return cls(groups["channel"])
        minutes = float(groups["minutes"])
        if minutes == 0:
            raise EffectError(
                f"the time constant of @lagged must be above 0 min; without one: @{groups['channel']}"
            )
        return cls(groups["channel"], time_constant_s=MINUTE.to_internal(minutes))

    @property
    def settled(self) -> str:
        return self.channel

    @property
    def phrase(self) -> str:
        return f", following {self.channel} late"

    def columns(self, context: Context, joint: int | None) -> Array:
        temperature = Channel(self.channel).columns(context, joint)[:, 0]
        tau = TYPICAL_TIME_CONSTANT_S if self.time_constant_s is None else self.time_constant_s
        step = np.diff(context.day_time)
        # Of a step that goes back in time nothing is left: another day began.
        part = np.where(step >= 0.0, np.exp(-np.maximum(step, 0.0) / tau), 0.0)
        change = np.diff(temperature)
        length = np.maximum(step, 1e-9) / tau
        # How much further behind a straight change of temperature leaves it.
        behind = np.where(step > 0.0, change * -np.expm1(-length) / length, change * (step == 0.0))
        lag, late = 0.0, np.zeros(len(temperature))
        for row, (keep, more) in enumerate(zip(part.tolist(), behind.tolist(), strict=True), 1):
            lag = lag * keep + more
            late[row] = lag
        return (temperature - late)[:, None]

    def unit(self) -> Unit:
        return KELVIN


REGISTERED = (LaggedTemperature,)
