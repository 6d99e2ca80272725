"""Search for one change in a series: the best of steps, bends, decays and the straight line, calibrated.

The p-value belongs to the whole search. It is simulated with the same plan and the same steps as for the
data, the estimate of the serial correlation included, so the false-alarm probability is the one stated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from monitor.records import Array

Base = Literal["constant", "line"]
Kind = Literal["step", "slope", "trend", "transient"]

#: Lag-1 correlations for which the regressors are prepared; between two of them nothing depends on r.
GRID = np.arange(0.0, 0.91, 0.1)
#: Time constants of a warm-up or running-in tried, as fractions of the history; a finer fit is `warm_up`'s.
DECAYS = (0.02, 0.05, 0.1, 0.2, 0.4)
#: Fewest runs on each side of a change: one run alone is an outlier, not a change.
EDGE = 2


@dataclass(frozen=True)
class Scan:
    """Best candidate: ``kind``, ``at`` (the change lies before this run; 0 for a trend
    or transient), its share of the
    sum of squares, and the p-value of the whole search; ``rss`` by candidate for the interval of when."""

    kind: Kind
    at: int
    share: float
    p_value: float
    correlation: float
    column: Array
    kinds: tuple[Kind, ...]
    positions: npt.NDArray[np.int64]
    rss: Array


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
        columns = np.column_stack([scaled, decays, steps])
        kinds: list[Kind] = ["trend", *_transients()]
        return columns, (*kinds, *steps_of), np.concatenate([np.zeros(1 + len(DECAYS), dtype=np.int64), at])
    bends = after * (scaled[:, np.newaxis] - scaled[at - 1])
    inner = slice(1, len(at) - 1) if len(at) > 4 else slice(0, 0)
    columns = np.column_stack([steps, bends[:, inner]])
    bends_of: list[Kind] = ["slope"] * len(at[inner])
    return columns, (*steps_of, *bends_of), np.concatenate([at, at[inner]])


def _transients() -> list[Kind]:
    return ["transient" for _ in DECAYS]


class Scanner:
    """Everything of the search that does not depend on the values: prepared once for one plan."""

    def __init__(self, times: Array, u: Array | None, base: Base) -> None:
        columns, self.kinds, self.positions = candidates(times, base)
        self.columns = columns
        self._null: dict[tuple[int, int], Array] = {}
        n = len(times)
        root = np.ones(n) if u is None else 1.0 / u
        line = (times - times.mean()) / max(float(np.ptp(times)), 1e-300)
        basis = np.column_stack([np.ones(n), line] if base == "line" else [np.ones(n)])
        self.root = root / np.sqrt(np.mean(root**2))
        self.prepared = []
        for r in GRID:
            q, _ = np.linalg.qr(_whiten(self.root[:, np.newaxis] * basis, r))
            rows = _whiten(self.root[:, np.newaxis] * columns, r)
            rows = rows - q @ (q.T @ rows)
            rows -= q @ (q.T @ rows)
            norm = np.sqrt((rows**2).sum(axis=0))
            # A candidate that the base already contains explains nothing.
            self.prepared.append((q, rows / np.where(norm > 1e-8, norm, np.inf)))
        # The correlation comes from what a line and its best step or bend leave, whatever the base: what a
        # poorer model leaves of a bend looks like correlation and would hide the bend.
        rich = candidates(times, "line")[0]
        self.line, _ = np.linalg.qr(self.root[:, np.newaxis] * np.column_stack([np.ones(n), line]))
        rows = self.root[:, np.newaxis] * rich
        rows = rows - self.line @ (self.line.T @ rows)
        norm = np.sqrt((rows**2).sum(axis=0))
        self.rich = rows / np.where(norm > 1e-8, norm, np.inf)

    def _shares(self, y: Array, grid: int) -> tuple[Array, Array]:
        """Share of the sum of squares by candidate (c, m), and what the base leaves (n, m)."""
        q, unit = self.prepared[grid]
        rows = _whiten(y, GRID[grid])
        rows = rows - q @ (q.T @ rows)
        total = (rows**2).sum(axis=0)
        return (unit.T @ rows) ** 2 / np.where(total > 0.0, total, np.inf), rows

    def search(self, weighted: Array) -> tuple[Array, npt.NDArray[np.int64]]:
        """Best share (m,) of each column of root-weighted values (n, m), and the correlation's place in GRID."""
        rows = weighted - self.line @ (self.line.T @ weighted)
        along = self.rich.T @ rows
        best = np.abs(along).argmax(axis=0)
        left = rows - self.rich[:, best] * along[best, np.arange(len(best))]
        grid = _nearest(_correlation(left, 3))
        result = np.empty(weighted.shape[1])
        for g in np.unique(grid):
            chosen = grid == g
            result[chosen] = self._shares(weighted[:, chosen], int(g))[0].max(axis=0)
        return result, grid

    def scan(self, y: Array, rng: np.random.Generator, trials: int) -> Scan:
        """The best candidate for ``y`` (n,) and its p-value from ``trials`` simulated series."""
        weighted = (self.root * (y - y.mean()))[:, np.newaxis]
        share, grid = self.search(weighted)
        g = int(grid[0])
        shares, rows = self._shares(weighted, g)
        # Parameters with the same plan and correlation share the simulated series.
        if (g, trials) not in self._null:
            draws = _colour(rng.standard_normal((len(y), trials)), float(GRID[g]))
            self._null[g, trials] = self.search(draws)[0]
        null = self._null[g, trials]
        p = (1 + int((null >= share[0]).sum())) / (trials + 1)
        best = int(shares[:, 0].argmax())
        rss = float((rows**2).sum()) * (1.0 - shares[:, 0])
        return Scan(
            self.kinds[best],
            int(self.positions[best]),
            float(share[0]),
            p,
            float(GRID[g]),
            self.columns[:, best],
            self.kinds,
            self.positions,
            rss,
        )


def _whiten(rows: Array, r: float) -> Array:
    """Rows of a first-order process made independent (Prais and Winsten 1954)."""
    result = np.array(rows, dtype=np.float64)
    if r > 0.0:
        result[1:] = rows[1:] - r * rows[:-1]
        result[0] = rows[0] * np.sqrt(1.0 - r * r)
    return result


def _colour(draws: Array, r: float) -> Array:
    """Independent rows made a stationary first-order process."""
    if r > 0.0:
        draws[0] /= np.sqrt(1.0 - r * r)
        for i in range(1, len(draws)):
            draws[i] += r * draws[i - 1]
    return draws


def _correlation(left: Array, fitted: int) -> Array:
    """Lag-1 correlation of each column, corrected for the bias of the fitted coefficients."""
    n = len(left)
    square = (left**2).sum(axis=0)
    r = (left[1:] * left[:-1]).sum(axis=0) / np.where(square > 0.0, square, np.inf)
    return np.asarray(r + (fitted + 1 + (fitted + 3) * r) / n)


def _nearest(r: Array) -> npt.NDArray[np.int64]:
    """Place in GRID of the correlation next to each estimate; a negative one counts as none."""
    return np.asarray(np.clip(np.rint(r / (GRID[1] - GRID[0])), 0, len(GRID) - 1), dtype=np.int64)
