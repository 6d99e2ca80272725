"""``@run_time``: the time since a run began; ``@run_time(3)``: that of run 3 alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.driver import HeatDriver
from monitor.records import Array


@dataclass(frozen=True)
class RunTime(HeatDriver):
    """From 0 at a run's first probing to 1 at its last; of one ``run`` alone 0 in all others."""

    run: int | None = None
    pattern: ClassVar[str] = r"run_time(?:\((?P<run>\d+)\))?"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(int(groups["run"])) if "run" in groups else cls()

    @property
    def phrase(self) -> str:
        if self.run is not None:
            return f", drifting evenly in run {self.run} alone"
        return ", drifting evenly within every run"

    def columns(self, context: Context, joint: int | None) -> Array:
        acts = np.True_ if self.run is None else context.run == self.run
        return np.asarray((context.run_time * acts)[:, None])


REGISTERED = (RunTime,)
