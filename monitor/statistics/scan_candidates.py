"""What the search for one change tries: steps, bends, decays and the straight line. A part of ``scan``."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: What stands beside a change: a constant, a line, or (``season``) a line and a wave of the year of any size.
Base = Literal["constant", "line", "season"]
Kind = Literal["step", "slope", "trend", "transient"]

#: Time constants of a warm-up or running-in tried, as fractions of the history; a finer fit is `warm_up`'s.
DECAYS = (0.02, 0.05, 0.1, 0.2, 0.4)
#: Fewest runs on each side of a change: one run alone is an outlier, not a change.
EDGE = 2
#: A decay of which the first run alone makes so much of the sum of squares is that one run, an outlier: with heavy
#: tails most false changes of 20 runs were such (docs/trials-statistics.md).
ONE_RUN = 0.75


#: A wave is no change where the history covers this share of its period, with so many runs.
COVERED, FEWEST_OF_WAVE = 0.82, 12
#: Over less than this part of the period a wave of the size of an innovation moves nothing.
SEASON_FROM = 0.1
#: Part of the period from which on a wave is fitted, by what stands beside a change.
FITTED_FROM: dict[Base, float] = {"constant": COVERED, "line": COVERED, "season": SEASON_FROM}


def base_columns(
    times: Array, base: Base, cycle: float | None, fitted_from: float | None = None
) -> list[Array]:
    """Columns (n,) beside a change: level, line and wave, the wave from ``fitted_from`` of its period on, else that of
    the base."""
    line = (times - times.mean()) / max(float(np.ptp(times)), 1e-300)
    covered = FITTED_FROM[base] if fitted_from is None else fitted_from
    return [
        np.ones(len(times)),
        *([] if base == "constant" else [line]),
        *_wave_columns(times, cycle, covered).T,
    ]


def _wave_columns(times: Array, cycle: float | None, covered: float) -> Array:
    """Cosine and sine (n, 2) of a wave of the period ``cycle``; none (n, 0) where the history covers less of it."""
    if cycle is None or len(times) < FEWEST_OF_WAVE or float(np.ptp(times)) < covered * cycle:
        return np.empty((len(times), 0))
    phase = 2.0 * np.pi / cycle * (times - times.mean())
    return np.column_stack([np.cos(phase), np.sin(phase)])


def candidates(times: Array, base: Base) -> tuple[Array, tuple[Kind, ...], npt.NDArray[np.int64]]:
    """Columns (n, c) of all candidates: on a constant the line, decays from the start
    and steps; on a line steps and bends."""
    n = len(times)
    at = np.arange(EDGE, n - EDGE + 1)
    after = np.arange(n)[:, np.newaxis] >= at
    steps = after.astype(np.float64)
    scaled = (times - times[0]) / max(float(np.ptp(times)), 1e-300)
    steps_of: list[Kind] = ["step"] * len(at)
    if base == "constant":
        decays = np.exp(-scaled[:, np.newaxis] / np.array(DECAYS))
        decays = decays[:, decays[0] ** 2 <= ONE_RUN * (decays**2).sum(axis=0)]
        columns = np.column_stack([scaled, decays, steps])
        kinds: list[Kind] = ["trend", *_transients(decays.shape[1])]
        return columns, (*kinds, *steps_of), np.concatenate([np.zeros(len(kinds), dtype=np.int64), at])
    bends = after * (scaled[:, np.newaxis] - scaled[at - 1])
    inner = slice(1, len(at) - 1) if len(at) > 4 else slice(0, 0)
    columns = np.column_stack([steps, bends[:, inner]])
    bends_of: list[Kind] = ["slope"] * len(at[inner])
    return columns, (*steps_of, *bends_of), np.concatenate([at, at[inner]])


def _transients(count: int) -> list[Kind]:
    return ["transient" for _ in range(count)]
