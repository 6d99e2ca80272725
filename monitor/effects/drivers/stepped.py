"""``@stepped(run 1, sequence 51)``: what slipped or was lost at one moment of one run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from monitor.effects.context import Context
from monitor.effects.description import OF_RUNS, OWN_DOCUMENT, Explanation
from monitor.effects.driver import DescribedDriver
from monitor.effects.joint_error import JointError
from monitor.effects.slip import moment_of
from monitor.exceptions import EffectError
from monitor.records import Array


@dataclass(frozen=True)
class Stepped(DescribedDriver):
    """One from a reading (``sequence``) of a ``run`` on to its end; zero before it and in all other runs."""

    run: int
    sequence: int
    # The moment may lack, so that its lack can be told; the text of a driver is kept as it is written.
    pattern: ClassVar[str] = r"stepped(?:\(run (?P<run>\d+), sequence (?P<sequence>\d+)\))?"

    @classmethod
    def of(cls, groups: Mapping[str, str]) -> Self:
        return cls(*moment_of(groups, "@stepped"))

    @property
    def text(self) -> str:
        """The driver as written."""
        return f"stepped(run {self.run}, sequence {self.sequence})"

    @property
    def phrase(self) -> str:
        return f", stepping once within run {self.run}, from reading {self.sequence} on"

    def columns(self, context: Context, joint: int | None) -> Array:
        of_run = context.run == self.run
        if not of_run.any():
            raise EffectError(f"'@{self.text}': this campaign has no run {self.run}")
        return np.asarray((of_run & (context.sequence >= self.sequence)).astype(float)[:, None])

    def explanation(self, error: JointError) -> Explanation:
        return Explanation(
            "something slipped, gave way or was touched at that moment, or an encoder lost its zero",
            "see what was touched or came loose then, fasten it and repeat the run; or give the readings from there on "
            "as a run of their own",
            OWN_DOCUMENT,
            OF_RUNS,
        )


REGISTERED = (Stepped,)
