"""The rows of one setup: what its kind reads, and the drift of what it reads.

A zero that drifts while a setup is measured (sensors, holder, spindle or table warm up) is an unknown of every run
where the setup states how large it may be: one for every number of a row, in proportion to the time from the setup's
first row of the run to its last. It begins as known to be zero with the stated standard uncertainty, so that readings
which show it (a pose that is measured again) estimate it, and what they do not show stands in u of the parameters.

The tool point likewise, where the setup states an uncertainty of it: a head that turns shows it (the length from its
axis to the tool), and where no axis turns the tool it stands in u. Setups of one instrument with the same tool point
have one.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.methods.instruments.reading import Reading, Rows, Shown, Stance, mean_of_runs
from monitor.records import Array, Setup

#: What the tool point is off where it is stated with an uncertainty.
TOOL_POINT = ("tool point x", "tool point y", "tool point z")


def tool_id_of(setup: Setup) -> Hashable:
    """What setups of one instrument have in common that state the same tool point with the same uncertainty."""
    return (setup.instrument, setup.tool_point, setup.tool_point_uncertainty) if setup.instrument else None


@dataclass(frozen=True)
class Part:
    """The rows of one setup: its ``reading``, its ``rows`` as its kind knows them, their indices ``at`` (m,) among all
    rows, the ``instrument`` as people call it, and the standard uncertainty ``drift`` (mm, of angles what they come to
    at one metre) of what its numbers drift over a run, None where they do not; ``tool_point`` (mm) is that of each
    coordinate of the tool point, None where it is as stated; ``tool_id`` is the same for setups that have the same
    one."""

    id: str
    reading: Reading
    rows: Rows
    at: npt.NDArray[np.int64]
    instrument: str = ""
    drift: float | None = None
    tool_point: float | None = None
    tool_id: Hashable = None

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the q unknowns of each run: those of the kind, drifts, what the tool point is off."""
        return (*self.reading.unknowns, *self._drifts, *self._of_tool)

    @property
    def _of_tool(self) -> tuple[str, ...]:
        return () if self.tool_point is None else TOOL_POINT

    @cached_property
    def _drifts(self) -> tuple[str, ...]:
        numbers = self.reading.numbers
        if self.drift is None:
            return ()
        return ("drift",) if len(numbers) == 1 else tuple(f"drift {number}" for number in numbers)

    def shared(self, name: str, alone: Hashable) -> Hashable:
        """What setups with the same value have an unknown in common; ``alone`` where it is the setup's own."""
        if name in self._of_tool and self.tool_id is not None:
            return self.tool_id
        shared: Mapping[str, Hashable] = self.reading.shared
        return shared.get(name, alone)

    def start(self, runs: int) -> Array:
        """Where the search for the unknowns begins (R, q): without drift, the tool point as stated."""
        begin = self.reading.start(runs)
        return np.hstack([begin, np.zeros((runs, len(self.unknowns) - begin.shape[1]))])

    def ends(self, values: Array) -> tuple[Array, Array]:
        """Work point and tool point (m, 3) mm in the frames of the last axes, for unknowns (m, q) row by row."""
        work, tool = self.reading.ends(values[:, : len(self.reading.unknowns)], self.rows)
        return work, tool if self.tool_point is None else tool + values[:, -len(TOOL_POINT) :]

    def prior(self) -> tuple[tuple[int, float], ...]:
        """Unknowns that are known with a standard uncertainty: index and u in mm or rad; they are 0 as stated."""
        u_of = [*(self.drift for _ in self._drifts), *(self.tool_point for _ in self._of_tool)]
        stated = enumerate(u_of, start=len(self.reading.unknowns))
        return (*self.reading.prior(), *((index, u) for index, u in stated if u is not None))

    def shown(self, stance: Stance, values: Array) -> Shown:
        """What the instrument shows, for unknowns (m, q) row by row."""
        first, drifts = len(self.reading.unknowns), len(self._drifts)
        shown = self.reading.shown(stance, values[:, :first], self.rows)
        by_own = np.zeros((*shown.residual.shape, 0)) if shown.by_own is None else shown.by_own
        if self._drifts:
            elapsed = self.rows.elapsed
            drifted = shown.residual + elapsed[:, None] * values[:, first : first + drifts]
            shown = replace(shown, residual=drifted)
            by_own = np.concatenate([by_own, np.eye(drifts) * elapsed[:, None, None]], axis=2)
        if self._of_tool:
            assert shown.by_shift is not None  # the reader allows it for lengths alone
            by_point = shown.by_shift @ stance.turned
            if shown.by_mean is not None:
                by_point = by_point + shown.by_mean @ mean_of_runs(stance.turned, self.rows.run)
            by_own = np.concatenate([by_own, by_point], axis=2)
        return replace(shown, by_own=by_own)
