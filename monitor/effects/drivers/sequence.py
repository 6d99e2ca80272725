"""``@sequence``: the order of the readings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from monitor.effects.context import Context
from monitor.effects.driver import HeatDriver
from monitor.records import Array


@dataclass(frozen=True)
class Sequence(HeatDriver):
    """From 0 at a run's first reading to 1 at its last, by their order: for runs whose times were not recorded."""

    pattern: ClassVar[str] = r"sequence"

    @property
    def phrase(self) -> str:
        return ", drifting evenly from reading to reading within every run"

    def columns(self, context: Context, joint: int | None) -> Array:
        return context.run_order[:, None]


REGISTERED = (Sequence,)
