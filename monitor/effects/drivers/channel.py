"""A recorded channel: ``@x_axis_degC``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects.context import REFERENCE_TEMPERATURE_DEGC, Context
from monitor.effects.description import OF_DRIVER, THERMAL, Explanation
from monitor.effects.driver import DescribedDriver
from monitor.effects.joint_error import JointError
from monitor.exceptions import EffectError
from monitor.records import Array
from monitor.units import COLUMN_UNITS, KELVIN, Unit, column_unit


@dataclass(frozen=True)
class Channel(DescribedDriver):
    """A recorded channel less its reference: 20 °C for a temperature (ISO 1), else the campaign's mean."""

    name: str

    @property
    def is_temperature(self) -> bool:
        """Whether the channel is a temperature in degrees Celsius."""
        return self.name.endswith("_degC")

    @property
    def phrase(self) -> str:
        return f", in proportion to {self.name}"

    def columns(self, context: Context, joint: int | None) -> Array:
        if self.name not in context.columns:
            channels = [name for name in context.columns if column_unit(name) is not None]
            raise EffectError(f"no channel '{self.name}'; this campaign has {', '.join(sorted(channels))}")
        values = context.columns[self.name]
        empty = ~np.isfinite(values)
        if empty.any():
            raise EffectError(
                f"channel '{self.name}' is empty at {int(empty.sum())} of {len(values)} probings; "
                "an effect needs it at every one"
            )
        mean = float(context.scaling.columns[self.name].mean())
        return (values - (REFERENCE_TEMPERATURE_DEGC if self.is_temperature else mean))[:, None]

    def unit(self) -> Unit:
        suffix = self.name.rpartition("_")[2]
        return KELVIN if suffix == "degC" else Unit(COLUMN_UNITS[suffix].name, 1.0)

    def explanation(self, error: JointError) -> Explanation:
        if self.is_temperature:
            return error.explanation_of_heat()
        return Explanation(
            f"{self.name} acts on {error.name}",
            f"keep {self.name} steady or compensate from it",
            THERMAL,
            OF_DRIVER,
        )


# A name that no other driver has: ``parse_driver`` makes it, without a pattern.
REGISTERED = ()
