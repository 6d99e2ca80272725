"""``@each_run``: what differs between runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OF_RUNS, THERMAL, Explanation
from monitor.effects.driver import DescribedDriver
from monitor.effects.joint_error import JointError
from monitor.records import Array


@dataclass(frozen=True)
class EachRun(DescribedDriver):
    """One multiplier a run: what varies from run to run and follows no recorded column."""

    pattern: ClassVar[str] = r"each_run"

    @property
    def phrase(self) -> str:
        return ", of another size in every run"

    def labels(self, context: Context) -> tuple[str, ...]:
        return tuple(f".run{run}" for run in np.unique(context.run))

    def columns(self, context: Context, joint: int | None) -> Array:
        indicator: Array = (context.run[:, None] == np.unique(context.run)).astype(float)
        return indicator

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            "something that differs between runs and was not recorded",
            "record more conditions (temperatures, coolant, load, operator) with the next campaign",
            THERMAL,
            OF_RUNS,
        )


REGISTERED = (EachRun,)
