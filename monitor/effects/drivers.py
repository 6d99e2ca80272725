"""Drivers: what an effect is multiplied by; nothing means 1.

A driver is one small class like a shape. ``@warmup`` without a time constant has one that is searched; with
one (``@warmup45min``) it is fixed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from monitor.effects.context import REFERENCE_TEMPERATURE_DEGC, Context
from monitor.effects.registry import plug_ins
from monitor.exceptions import EffectError
from monitor.machine import Joint
from monitor.records import Array
from monitor.units import COLUMN_UNITS, KELVIN, MINUTE, ONE, Unit, column_unit

# A machine tool reaches thermal equilibrium in some tens of minutes to hours; where the constant is neither
# given nor searched yet, this is the start.
TYPICAL_TIME_CONSTANT_S = 3600.0


class Driver(Protocol):
    """What every driver offers."""

    def labels(self, context: Context) -> tuple[str, ...]:
        """A suffix for each multiplier."""
        ...

    def columns(self, context: Context, joint: int | None) -> Array:
        """Multipliers (n, m) at every probing; ``joint`` is None for effects of the artefact."""
        ...

    def unit(self) -> Unit:
        """The unit of the multiplier."""
        ...


@dataclass(frozen=True)
class Always:
    """No driver: the multiplier is 1."""

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def columns(self, context: Context, joint: int | None) -> Array:
        return np.ones((len(context), 1))

    def unit(self) -> Unit:
        return ONE


@dataclass(frozen=True)
class Channel:
    """A recorded channel less its reference: 20 °C for a temperature (ISO 1), else the campaign's mean."""

    name: str

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

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
        reference = REFERENCE_TEMPERATURE_DEGC if self.name.endswith("_degC") else float(values.mean())
        return (values - reference)[:, None]

    def unit(self) -> Unit:
        suffix = self.name.rpartition("_")[2]
        return KELVIN if suffix == "degC" else Unit(COLUMN_UNITS[suffix].name, 1.0)


@dataclass(frozen=True)
class WarmUp:
    """1 - exp(-t / tau), t since the first run of the day began."""

    time_constant_s: float | None = None

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def columns(self, context: Context, joint: int | None) -> Array:
        tau = TYPICAL_TIME_CONSTANT_S if self.time_constant_s is None else self.time_constant_s
        return -np.expm1(-context.day_time / tau)[:, None]

    def unit(self) -> Unit:
        return ONE


@dataclass(frozen=True)
class RunTime:
    """From 0 at a run's first probing to 1 at its last."""

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def columns(self, context: Context, joint: int | None) -> Array:
        return context.run_time[:, None]

    def unit(self) -> Unit:
        return ONE


@dataclass(frozen=True)
class Sequence:
    """From 0 at a run's first reading to 1 at its last, by their order: for runs whose times were not kept."""

    def labels(self, context: Context) -> tuple[str, ...]:
        return ("",)

    def columns(self, context: Context, joint: int | None) -> Array:
        return context.run_order[:, None]

    def unit(self) -> Unit:
        return ONE


@dataclass(frozen=True)
class Gravity:
    """The components of gravity in the frame of the axis, as parts of its full weight."""

    def labels(self, context: Context) -> tuple[str, ...]:
        return (".gx", ".gy", ".gz")

    def columns(self, context: Context, joint: int | None) -> Array:
        return context.gravity[:, len(context.chain.work) - 1 if joint is None else joint]

    def unit(self) -> Unit:
        return ONE


@dataclass(frozen=True)
class EachRun:
    """One multiplier a run: what varies from run to run and follows no recorded column."""

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f".run{run}" for run in np.unique(context.run))

    def columns(self, context: Context, joint: int | None) -> Array:
        chosen: Array = (context.run[:, None] == np.unique(context.run)).astype(float)
        return chosen

    def unit(self) -> Unit:
        return ONE


def parse_driver(text: str, joint: Joint | None = None) -> Driver:
    """The driver of a name (without its @); EffectError, listing what there is, for an unknown one.

    Whether a channel was recorded is known only with the data, and is refused there.
    """
    if text == "":
        return Always()
    match = re.fullmatch(r"warmup(?:(\d+(?:\.\d+)?)min)?", text)
    if match:
        if match.group(1) is None:
            return WarmUp()
        if float(match.group(1)) == 0:
            raise EffectError("the time constant of @warmup must be above 0 min")
        return WarmUp(MINUTE.to_internal(float(match.group(1))))
    if text == "run_time":
        return RunTime()
    if text == "sequence":
        return Sequence()
    if text == "gravity":
        return Gravity()
    if text == "each_run":
        return EachRun()
    for driver in plug_ins("monitor.drivers"):
        match = re.fullmatch(driver.pattern, text)
        if match:
            made: Driver = driver(**match.groupdict())
            return made
    if column_unit(text) is None:
        raise EffectError(
            f"there is no driver '@{text}'; there are @warmup (or @warmup45min), @run_time, @sequence, @gravity, "
            "@each_run and every recorded channel, whose name ends in a unit "
            f"({', '.join('_' + suffix for suffix in COLUMN_UNITS)})"
        )
    return Channel(text)
