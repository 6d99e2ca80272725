"""The rows of one setup: what its kind reads, and what is off in it as its setup states: drift, scale, tool point.

A zero that drifts while a setup is measured (sensors, holder, spindle or table warm up) is an unknown of every run
where the setup states how large it may be: one for every number of a row, in proportion to the time from the setup's
first row of the run to its last. It begins as known to be zero with the stated standard uncertainty, so that readings
which show it (a pose that is measured again) estimate it, and what they do not show stands in u of the parameters.

The scale of its lengths likewise (the wavelength of a laser in air whose temperature and pressure are measured, a
tracker, a bar of several lengths): one factor of all that its instrument reads, in all runs, so that it stays however
often is measured.

The tool point likewise, where the setup states an uncertainty of it: a head that turns shows it (the length from its
axis to the tool), and where no axis turns the tool it stands in u. Setups of one instrument with the same tool point
have one.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from monitor.methods.instruments.reading import Reading, Rows, Shown, Stance, mean_of_runs
from monitor.records import Array, Setup
from monitor.sources import SCALE, CommonQuantity

#: What the tool point is off where it is stated with an uncertainty.
TOOL_POINT = ("tool point x", "tool point y", "tool point z")


def tool_id_of(setup: Setup) -> Hashable:
    """What setups of one instrument have in common that state the same tool point with the same uncertainty."""
    return (setup.instrument, setup.tool_point, setup.tool_point_uncertainty) if setup.instrument else None


def scale_id_of(setup: Setup) -> Hashable:
    """What setups of one instrument have in common that state the same uncertainty of their scale."""
    return (setup.instrument, setup.scale_uncertainty) if setup.instrument else None


def exact_scale_of(setup: Setup) -> str:
    """Whose unit of length is taken as exact without a word: the instrument, else the setup; empty of none."""
    return (setup.instrument or setup.id) if setup.takes_scale else ""


@dataclass(frozen=True)
class Part:
    """The rows of one setup: its ``reading``, its ``rows`` as its kind knows them, their indices ``at`` (m,) among all
    rows, the ``instrument`` as people call it, and the standard uncertainty ``drift`` (mm, of angles what they come to
    at one metre) of what its numbers drift over a run, None where they do not; ``tool_point`` (mm) is that of each
    coordinate of the tool point, None where it is as stated; ``tool_id`` is the same for setups that have the same
    one; ``scale`` (mm/mm) that of its lengths in proportion to themselves, ``scale_id`` as ``tool_id``."""

    id: str
    reading: Reading
    rows: Rows
    at: npt.NDArray[np.int64]
    instrument: str = ""
    drift: float | None = None
    tool_point: float | None = None
    tool_id: Hashable = None
    scale: float | None = None
    scale_id: Hashable = None

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the q unknowns of each run: those of the kind, drifts, the scale, what the tool point is off."""
        return (*self.reading.unknowns, *self._drifts, *self._scales, *self._of_tool)

    @property
    def staying(self) -> tuple[str, ...]:
        """Unknowns of what is the same in all runs of a campaign, where they are known beforehand."""
        return (*self.reading.staying, *self._scales)

    @property
    def _scales(self) -> tuple[str, ...]:
        return () if self.scale is None else (SCALE,)

    def lengths(self, beyond: Array | float = 0.0) -> Array:
        """The lengths (m, k) mm that were read, as the scale makes them, 0 for what is none, or was not read; those
        that are shown where they are ``beyond`` (m, k) what was read."""
        numbers = len(self.reading.numbers)
        read = np.nan_to_num(self.rows.measured[:, :numbers] + beyond)
        read[:, numbers - self.reading.turns :] = 0.0
        return np.asarray(read + self.reading.besides)

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
        if name in self._scales and self.scale_id is not None:
            return self.scale_id
        shared: Mapping[str, Hashable] = self.reading.shared
        return shared.get(name, alone)

    def common_quantity(self, name: str, setup: Setup, u: float) -> CommonQuantity | None:
        """Which calibrated quantity an unknown that is known to ``u`` is; None where no other campaign can have it."""
        if name not in self.staying or not setup.instrument:
            return None
        quantity = name if setup.length is None or name == SCALE else f"{name} of {setup.length:g} mm"
        return CommonQuantity(setup.instrument, setup.certificate or "", quantity, u)

    def start(self, runs: int) -> Array:
        """Where the search for the unknowns begins (R, q): without drift, scale and tool point as stated."""
        begin = self.reading.start(runs)
        return np.hstack([begin, np.zeros((runs, len(self.unknowns) - begin.shape[1]))])

    def guessed_anew(self) -> Self:
        """The setup with the first guess of its kind made of its rows as they are now."""
        reading, rows = self.reading.guessed_anew(self.rows)
        return replace(self, reading=reading, rows=rows)

    def ends(self, values: Array) -> tuple[Array, Array]:
        """Work point and tool point (m, 3) mm in the frames of the last axes, for unknowns (m, q) row by row."""
        work, tool = self.reading.ends(values[:, : len(self.reading.unknowns)], self.rows)
        return work, tool if self.tool_point is None else tool + values[:, -len(TOOL_POINT) :]

    def prior(self) -> tuple[tuple[int, float], ...]:
        """Unknowns that are known with a standard uncertainty: index and u in mm or rad; they are 0 as stated."""
        u_of = [
            *(self.drift for _ in self._drifts),
            *(self.scale for _ in self._scales),
            *(self.tool_point for _ in self._of_tool),
        ]
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
        if self._scales:
            lengths = self.lengths(shown.residual)
            shown = replace(shown, residual=shown.residual + lengths * values[:, first + drifts, None])
            by_own = np.concatenate([by_own, lengths[:, :, None]], axis=2)
        if self._of_tool:
            assert shown.by_shift is not None  # the reader allows it for lengths alone
            by_point = shown.by_shift @ stance.turned
            if shown.by_mean is not None:
                by_point = by_point + shown.by_mean @ mean_of_runs(stance.turned, self.rows.run)
            by_own = np.concatenate([by_own, by_point], axis=2)
        return replace(shown, by_own=by_own)


def own_columns_of(parts: Sequence[Part]) -> tuple[npt.NDArray[np.int64], ...]:
    """Return where the unknowns of each part (q,) stand among a run's own; what parts share stands there once."""
    column_of: dict[Hashable, int] = {}
    return tuple(
        np.array(
            [
                column_of.setdefault((name, part.shared(name, index)), len(column_of))
                for name in part.unknowns
            ],
            dtype=np.int64,
        )
        for index, part in enumerate(parts)
    )
