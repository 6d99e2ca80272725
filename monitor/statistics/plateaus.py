"""Search for a change that was put right again: a plateau, two steps of which neither need show alone, calibrated.

What one step or trend leaves of a plateau looks like runs that resemble each other, so that the search for one change
(``scan``) takes it for such. Here both ends are sought at once, beside a line and a wave of the year of any size, for a
drift and half of a season have the shape of a plateau, too. The calibration is that of ``scan``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics.scan import FIRST_BLOCK, Null, Scanner, kurtosis_is_heavy
from monitor.statistics.scan_candidates import EDGE
from monitor.statistics.serial import Shape

#: Fewest runs of a plateau: two alone are one bad setup. Fewer runs in all tell none beside a line and a wave, and of
#: more the tables are large.
FEWEST, FEWEST_IN_ALL, MOST_IN_ALL = 3, 12, 520
#: Ends of a plateau of L runs are tried on a grid of L / FINENESS; from the best each is moved in turn, so often.
FINENESS, MOVES = 4, 3
#: As ``scan.REFUTED``: two places and a height taken off leave less of a correlation than one change does. Chosen by
#: measured rates: 2, 3 and 4 call 4, 3 and 3 of 2000 series with correlations of 0.6 and 0.8 at 0.1 %.
REFUTED = 3.0


@dataclass(frozen=True)
class Edge:
    """A step before run ``at``; minus twice the log-likelihood (c,) of each of its ``places`` (c,) beside the other."""

    at: int
    places: npt.NDArray[np.int64]
    deviance: Array


@dataclass(frozen=True)
class Plateau:
    """Likeliest plateau: both edges, ``p_value`` of the whole search, and by how much its log-likelihood, twice, is
    above that of the likeliest single step (``gain``). ``shape`` is the likeliest correlation, ``root`` (n,) the
    weights."""

    first: Edge
    last: Edge
    p_value: float
    gain: float
    shape: Shape
    root: Array


@dataclass(frozen=True)
class _Table:
    """What all plateaus are under one shape, by the step that begins and the one that ends it (n + 1, n + 1): one over
    the square of the column, 0 where there is none, and the weight of what it leaves, then infinite."""

    inverse: Array
    weight: Array


def _grid(n: int) -> npt.NDArray[np.int64]:
    """First run of each plateau that is tried first in n runs and the first run behind it (2, p)."""
    pairs, length = [], 2
    while length <= n:
        at = np.arange(EDGE, n - EDGE + 1, max(length // FINENESS, 1))
        lengths = at[np.newaxis, :] - at[:, np.newaxis]
        pairs.append(at[np.argwhere((lengths >= max(length, FEWEST)) & (lengths < 2 * length))])
        length *= 2
    return np.concatenate(pairs).T


class PlateauScanner(Scanner):
    """Everything of the search that does not depend on the values: prepared once for one plan."""

    def __init__(
        self, times: Array, u: Array | None, cycle: float | None = None, beside: Array | None = None
    ) -> None:
        super().__init__(times, u, "season", None, cycle, beside)
        n = len(times)
        self.ends = _grid(n)
        # A single step is a plateau that goes on beyond the last run.
        self.single = np.arange(EDGE, n - EDGE + 1)
        steps = self.root[:, np.newaxis] * (np.arange(n)[:, np.newaxis] >= np.arange(n + 1))
        length = np.arange(n + 1)[np.newaxis, :] - np.arange(n + 1)[:, np.newaxis]
        inside = (np.arange(n + 1) >= EDGE) & (np.arange(n + 1) <= n - EDGE)
        self.allowed = inside[:, np.newaxis] & (inside & (length >= FEWEST))
        self.allowed[self.single, n] = True
        self.tables = []
        for prepared in self.prepared:
            rows = prepared.shape.whiten(steps)
            rows -= prepared.base @ (prepared.base.T @ rows)
            products = rows.T @ rows
            squares = np.diag(products)
            square = squares[:, np.newaxis] + squares - 2.0 * products
            good = self.allowed & (square > 1e-12)
            square = np.where(good, square, 1.0)
            self.tables.append(
                _Table(np.where(good, 1.0 / square, 0.0), np.where(good, square ** (1.0 / self.free), np.inf))
            )

    def _along(self, shape: int, weighted: Array) -> tuple[Array, Array]:
        """Sum of squares (m,) that the base leaves of columns (n, m), and products (n + 1, m) with all steps."""
        prepared = self.prepared[shape]
        rows = prepared.shape.whiten(weighted)
        rows -= prepared.base @ (prepared.base.T @ rows)
        back = self.root[:, np.newaxis] * prepared.shape.back(rows)
        steps = np.zeros((len(back) + 1, back.shape[1]))
        steps[:-1] = np.cumsum(back[::-1], axis=0)[::-1]
        return np.einsum("ij,ij->j", rows, rows), steps

    def _best(
        self, shape: int, total: Array, steps: Array
    ) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Array, Array]:
        """First run of the best plateau of each column (m,), the one behind it, what these leave, weighted; and what
        the best single step leaves."""
        table, n = self.tables[shape], len(steps) - 1
        pick, column = self.ends, np.arange(len(total))
        tried = steps[pick[0]] - steps[pick[1]]
        tried *= tried
        tried *= table.inverse[pick[0], pick[1], np.newaxis]
        np.subtract(total, tried, out=tried)
        np.maximum(tried, 1e-15 * total + 1e-300, out=tried)
        tried *= table.weight[pick[0], pick[1], np.newaxis]
        best = tried.argmin(axis=0)
        start, stop = pick[0][best], pick[1][best]
        least = tried[best, column]
        for move in range(2 * MOVES):
            other = start if move % 2 else stop
            inverse, weight = (
                (part[other, :n].T if move % 2 else part[:n, other]) for part in (table.inverse, table.weight)
            )
            residue = np.maximum(
                total - (steps[:n] - steps[other, column]) ** 2 * inverse, 1e-15 * total + 1e-300
            )
            residue *= weight
            best = residue.argmin(axis=0)
            start, stop = (start, best) if move % 2 else (best, stop)
            least = residue[best, column]
        by_step = np.maximum(total - steps[self.single] ** 2 * table.inverse[self.single, n, np.newaxis], 0.0)
        by_step *= table.weight[self.single, n, np.newaxis]
        return start, stop, least, by_step.min(axis=0)

    def _deviances(self, weighted: Array, places: Sequence[int]) -> tuple[Array, Array]:
        """As for one change, of the best plateau or single step."""
        plain = np.empty((len(places), weighted.shape[1]))
        best = np.empty_like(plain)
        for begin in range(0, weighted.shape[1], FIRST_BLOCK):
            part = slice(begin, begin + FIRST_BLOCK)
            rows = weighted[:, part] - self.plain @ (self.plain.T @ weighted[:, part])
            for i, shape in enumerate(places):
                total, steps = self._along(shape, rows)
                _, _, least, least_of_steps = self._best(shape, total, steps)
                constant = self.prepared[shape].constant
                plain[i, part] = constant + self.free * np.log(total + 1e-300)
                best[i, part] = constant + self.free * np.log(np.minimum(least, least_of_steps) + 1e-300)
        return plain, best

    def plateau(self, y: Array, rng: np.random.Generator, trials: int, level: float) -> Plateau:
        """The likeliest plateau of ``y`` (n,) and its p-value from ``trials`` simulated series a shape."""
        weighted = (self.root * (y - y.mean()))[:, np.newaxis]
        plain, best = self._deviances_of(y)
        shape = int(best[:, 0].argmin())
        likeliest = self.prepared[shape]
        total, steps = self._along(shape, weighted)
        start, stop, least, least_of_steps = (part[0] for part in self._best(shape, total, steps))
        column = np.zeros(len(y))
        column[start:stop] = 1.0
        tailed = kurtosis_is_heavy(likeliest, weighted, self.root * column)
        index = self._not_refuted(best[:, 0], [0], REFUTED)[0][1]
        p = self._p_value(float(plain.min() - best.min()), Null(0, index, tailed), level, rng, trials)
        return Plateau(
            *self._edges(shape, total, steps, int(start), int(stop)),
            p,
            float(self.free * np.log((least_of_steps + 1e-300) / (least + 1e-300))),
            likeliest.shape,
            self.root,
        )

    def _edges(self, shape: int, total: Array, steps: Array, start: int, stop: int) -> tuple[Edge, Edge]:
        """Both edges with the likelihood of all their places, each beside the other."""
        inverse, n = self.tables[shape].inverse, len(steps) - 1
        # The first column moves the last edge, the second the first one.
        one_over = np.column_stack([inverse[start], inverse[:, stop]])
        taken = (steps - steps[[start, stop], 0]) ** 2 * one_over
        deviance = n * np.log(np.maximum(total - taken, 1e-15 * total + 1e-300))
        first, last = (np.flatnonzero(part[:n]) for part in (self.allowed[:, stop], self.allowed[start]))
        return Edge(start, first, deviance[first, 1]), Edge(stop, last, deviance[last, 0])
