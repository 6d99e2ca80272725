"""``@run_time``: the time since a run began."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.driver import HeatDriver
from monitor.records import Array


@dataclass(frozen=True)
class RunTime(HeatDriver):
    """From 0 at a run's first probing to 1 at its last."""

    pattern: ClassVar[str] = r"run_time"

    @property
    def phrase(self) -> str:
        return ", drifting evenly within every run"

    def columns(self, context: Context, joint: int | None) -> Array:
        return context.run_time[:, None]


REGISTERED = (RunTime,)
