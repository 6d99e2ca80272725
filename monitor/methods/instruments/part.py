"""The rows of one setup: what its kind reads, and the drift of what it reads.

A zero that drifts while a setup is measured (sensors, holder, spindle or table warm up) is an unknown of every run
where the setup states how large it may be: one for every number of a row, in proportion to the time from the setup's
first row of the run to its last. It begins as known to be zero with the stated standard uncertainty, so that readings
which show it (a pose that is measured again) estimate it, and what they do not show stands in u of the parameters.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.methods.instruments.reading import Reading, Rows, Shown, Stance
from monitor.records import Array


@dataclass(frozen=True)
class Part:
    """The rows of one setup: its ``reading``, its ``rows`` as its kind knows them, their indices ``at`` (m,) among all
    rows, the ``instrument`` as people call it, and the standard uncertainty ``drift`` (mm, of angles what they come to
    at one metre) of what its numbers drift over a run, None where they do not."""

    id: str
    reading: Reading
    rows: Rows
    at: npt.NDArray[np.int64]
    instrument: str = ""
    drift: float | None = None

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the q unknowns of each run, drifts last."""
        return (*self.reading.unknowns, *self._drifts)

    @cached_property
    def _drifts(self) -> tuple[str, ...]:
        numbers = self.reading.numbers
        if self.drift is None:
            return ()
        return ("drift",) if len(numbers) == 1 else tuple(f"drift {number}" for number in numbers)

    def shared(self, name: str, alone: Hashable) -> Hashable:
        """What setups with the same value have an unknown in common; ``alone`` where it is the setup's own."""
        shared: Mapping[str, Hashable] = self.reading.shared
        return shared.get(name, alone)

    def start(self, runs: int) -> Array:
        """Where the search for the unknowns begins (R, q): without drift."""
        return np.hstack([self.reading.start(runs), np.zeros((runs, len(self._drifts)))])

    def prior(self) -> tuple[tuple[int, float], ...]:
        """Unknowns that are known with a standard uncertainty: index and u in mm or rad; they are 0 as stated."""
        first = len(self.reading.unknowns)
        u = 0.0 if self.drift is None else self.drift
        return (*self.reading.prior(), *((first + index, u) for index in range(len(self._drifts))))

    def shown(self, stance: Stance, values: Array) -> Shown:
        """What the instrument shows, for unknowns (m, q) row by row."""
        first = len(self.reading.unknowns)
        shown = self.reading.shown(stance, values[:, :first], self.rows)
        if not self._drifts:
            return shown
        elapsed = self.rows.elapsed
        drifted = np.eye(len(self._drifts)) * elapsed[:, None, None]
        by_own = np.zeros((*shown.residual.shape, 0)) if shown.by_own is None else shown.by_own
        return replace(
            shown,
            residual=shown.residual + elapsed[:, None] * values[:, first:],
            by_own=np.concatenate([by_own, drifted], axis=2),
        )
