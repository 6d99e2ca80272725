"""The drivers, one a file; no driver means 1.

``@warmup`` without a time constant has one that is searched; with one (``@warmup45min``) it is fixed, and so for
``@settling`` and ``@lagged_x_axis_degC``. A driver of no other name is a recorded channel.
"""

from __future__ import annotations

from monitor.effects.driver import Driver, SettlingDriver
from monitor.effects.drivers.always import Always
from monitor.effects.drivers.channel import Channel
from monitor.effects.drivers.each_run import EachRun
from monitor.effects.drivers.lagged import LaggedTemperature
from monitor.effects.drivers.run_time import RunTime
from monitor.effects.drivers.sequence import Sequence
from monitor.effects.drivers.settling import Settling
from monitor.effects.drivers.stepped import Stepped
from monitor.effects.drivers.warmup import WarmUp
from monitor.effects.registry import parse, plug_in_patterns, plug_ins
from monitor.exceptions import EffectError, did_you_mean
from monitor.units import COLUMN_UNITS, column_unit

__all__ = [
    "Always",
    "Channel",
    "Driver",
    "EachRun",
    "LaggedTemperature",
    "RunTime",
    "Sequence",
    "Settling",
    "SettlingDriver",
    "Stepped",
    "WarmUp",
    "parse_driver",
]


def parse_driver(text: str) -> Driver:
    """Return the driver of a name (without its @). Raises EffectError, listing what there is, for an unknown one.

    Only the data show whether a channel was recorded; ``Channel.columns`` refuses one that was not.
    """
    driver: Driver | None = parse(text, __name__, plug_ins("monitor.drivers"))
    if driver is not None:
        return driver
    if column_unit(text) is None:
        hint = did_you_mean(
            text, ("warmup", "settling", "run_time", "sequence", "gravity", "each_run", "stepped")
        )
        raise EffectError(
            f"there is no driver '@{text}'; {hint}there are @warmup (or @warmup45min), @settling, @run_time, "
            "@sequence, @gravity, @each_run, @stepped(run 7, sequence 23), @lagged_ with a recorded temperature, and "
            "every recorded channel, whose name ends in a unit "
            f"({', '.join('_' + suffix for suffix in COLUMN_UNITS)}){plug_in_patterns('monitor.drivers')}"
        )
    return Channel(text)
