"""Search for one change in a series: the best of steps, bends, decays and the straight line, calibrated.

Few runs do not tell a change from runs that resemble each other. The statistic is therefore the gain in
likelihood over no change at all, with the correlation of the runs free on both sides (within one family: in
their order, or by days); and the p-value is that of the strongest correlation that the series, its best change
taken off, does not refute. It belongs to the whole search: it is simulated with the same plan and the same
steps as for the data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from monitor.records import Array
from monitor.statistics.serial import DayComponent, FirstOrder, Shape

Base = Literal["constant", "line"]
Kind = Literal["step", "slope", "trend", "transient"]

#: Correlations of neighbours of which the likelihood is computed.
GRID = np.arange(0.0, 0.91, 0.1)
#: Beyond this correlation no level is claimed: some dozens of such runs have no constant mean to change from.
HIGHEST = 0.7
#: Day components of which the likelihood is computed, in standard deviations of a run. Beyond the last no level is
#: claimed: four days of which the last differs would then say nothing, however much it differs.
DAY_GRID = (0.5, 1.0)
#: A correlation is refuted where the logarithm of its likelihood is so far below the highest: one-sided 97.7 % for
#: a normal estimate. Chosen by measured rates (docs/trials-statistics.md): 1 leaves 6 % false alarms of 20 runs.
REFUTED = 2.0
#: Simulations until a p-value is clearly no finding: so many exceedances end them (Besag and Clifford,
#: Biometrika 78 (1991) 301), looked at after each block; most searches end with the first.
EXCEEDANCES, FIRST_BLOCK, BLOCK = 20, 100, 500
#: Time constants of a warm-up or running-in tried, as fractions of the history; a finer fit is `warm_up`'s.
DECAYS = (0.02, 0.05, 0.1, 0.2, 0.4)
#: Fewest runs on each side of a change: one run alone is an outlier, not a change.
EDGE = 2


@dataclass(frozen=True)
class Scan:
    """Best candidate: ``kind``, ``at`` (the change lies before this run; 0 for a trend or transient).

    ``p_value`` is that of the whole search; where it is above the level it may be that of the first correlation that
    explains the series. ``deviance`` by candidate is minus twice the log-likelihood at ``shape``, the likeliest
    correlation, up to a constant of the plan; ``root`` (n,) the weights and ``column`` (n,) the candidate.
    """

    kind: Kind
    at: int
    p_value: float
    shape: Shape
    root: Array
    column: Array
    kinds: tuple[Kind, ...]
    positions: npt.NDArray[np.int64]
    deviance: Array


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


@dataclass(frozen=True)
class _Prepared:
    """One shape with what the base and the candidates are under it."""

    shape: Shape
    base: Array
    inverse: Array
    weight: Array
    constant: float


class Scanner:
    """Everything of the search that does not depend on the values: prepared once for one plan.

    ``days`` (n,) are indices of the runs' days, None where no day has two runs.
    """

    def __init__(
        self, times: Array, u: Array | None, base: Base, days: npt.NDArray[np.intp] | None = None
    ) -> None:
        self.columns, self.kinds, self.positions = candidates(times, base)
        n = len(times)
        root = np.ones(n) if u is None else 1.0 / u
        self.root = root / np.sqrt(np.mean(root**2))
        line = (times - times.mean()) / max(float(np.ptp(times)), 1e-300)
        basis = np.column_stack([np.ones(n), line] if base == "line" else [np.ones(n)])
        self.free = n - basis.shape[1]
        self.at = np.arange(EDGE, n - EDGE + 1)
        self.scaled = (times - times[0]) / max(float(np.ptp(times)), 1e-300)
        self.smooth = self.columns[:, : len(self.kinds) - len(self.at)] if base == "constant" else None
        shapes: list[Shape] = [FirstOrder(float(r)) for r in GRID]
        # Places of the shapes of each family, the weakest first: that of independent runs is in both.
        self.families = [tuple(range(len(GRID)))]
        if days is not None:
            self.families.append((0, *range(len(GRID), len(GRID) + len(DAY_GRID))))
            shapes += [DayComponent(ratio, days, self.root) for ratio in DAY_GRID]
        self.prepared = [self._prepare(shape, basis) for shape in shapes]
        # Places of the shapes for which the level is claimed.
        self._claimed = {i for i in range(len(shapes)) if i >= len(GRID) or GRID[i] <= HIGHEST + 1e-9}
        self._null: dict[tuple[int, int], Array] = {}
        self._seed: int | None = None

    def _prepare(self, shape: Shape, basis: Array) -> _Prepared:
        q, r = np.linalg.qr(shape.whiten(self.root[:, np.newaxis] * basis))
        rows = shape.whiten(self.root[:, np.newaxis] * self.columns)
        rows -= q @ (q.T @ rows)
        rows -= q @ (q.T @ rows)
        square = (rows**2).sum(axis=0)
        # A candidate that the base already contains explains nothing.
        good = square > 1e-16
        square = np.where(good, square, 1.0)
        constant = shape.log_determinant + 2.0 * float(np.log(np.abs(np.diag(r))).sum())
        # The residual likelihood counts the determinant of the candidate as that of every fitted coefficient; its
        # coefficient is taken in units of the scatter, so that the gain does not depend on the unit of the values.
        weight = np.where(good, square ** (1.0 / self.free), np.inf)
        return _Prepared(shape, q, np.where(good, 1.0 / square, 0.0), weight, constant)

    def _residual(self, prepared: _Prepared, weighted: Array) -> tuple[Array, Array]:
        """What the base leaves of columns (n, m), as a sum of squares (m,), and what each candidate (c, m) takes."""
        rows = prepared.shape.whiten(weighted)
        rows -= prepared.base @ (prepared.base.T @ rows)
        total = np.einsum("ij,ij->j", rows, rows)
        along = self.root[:, np.newaxis] * prepared.shape.back(rows)
        # Steps and bends are sums from their place to the end.
        steps = np.cumsum(along[::-1], axis=0)[::-1][self.at]
        if self.smooth is not None:
            found = np.concatenate([self.smooth.T @ along, steps])
        elif len(self.at) > 4:
            ramps = np.cumsum((along * self.scaled[:, np.newaxis])[::-1], axis=0)[::-1][self.at]
            bends = ramps - self.scaled[self.at - 1, np.newaxis] * steps
            found = np.concatenate([steps, bends[1:-1]])
        else:
            found = steps
        return total, found**2 * prepared.inverse[:, np.newaxis]

    def _deviances(self, weighted: Array, places: Sequence[int]) -> tuple[Array, Array]:
        """Minus twice the residual log-likelihood by shape (s, m): of no change, and of the best candidate."""
        plain = np.empty((len(places), weighted.shape[1]))
        best = np.empty_like(plain)
        for i, one in enumerate(self.prepared[place] for place in places):
            total, taken = self._residual(one, weighted)
            floor = 1e-15 * total + 1e-300
            left = (np.maximum(total - taken, floor) * one.weight[:, np.newaxis]).min(axis=0)
            plain[i] = one.constant + self.free * np.log(total + 1e-300)
            best[i] = one.constant + self.free * np.log(left)
        return plain, best

    def _gain(self, weighted: Array, family: int) -> Array:
        """The statistic (m,) of columns (n, m) times the root of their weights."""
        plain, best = self._deviances(weighted, self.families[family])
        return np.asarray(plain.min(axis=0) - best.min(axis=0))

    def _simulated(self, family: int, place: int, count: int, rng: np.random.Generator) -> Array:
        """The statistic of at least ``count`` series without a change, of one shape; kept and added to."""
        if self._seed is None:
            self._seed = int(rng.integers(2**63))
        kept = self._null.get((family, place), np.empty(0))
        while len(kept) < count:
            # Every shape sees the same noise: their p-values differ by the shape alone.
            size = BLOCK if len(kept) else FIRST_BLOCK
            noise = np.random.default_rng([self._seed, len(kept)]).standard_normal((len(self.root), size))
            kept = np.append(kept, self._gain(self.prepared[place].shape.colour(noise), family))
        self._null[family, place] = kept
        return kept[:count]

    def _p_value(
        self, gain: float, family: int, place: int, level: float, rng: np.random.Generator, trials: int
    ) -> float:
        exceeding = done = 0
        while done < trials:
            upto = min(done + BLOCK if done else FIRST_BLOCK, trials)
            exceeding += int((self._simulated(family, place, upto, rng)[done:] >= gain).sum())
            if exceeding >= EXCEEDANCES and exceeding / upto > 2.0 * level:
                return exceeding / upto
            done = upto
        return (1 + exceeding) / (trials + 1)

    def _not_refuted(self, best: Array) -> list[tuple[int, int]]:
        """Each family that the deviances (s,) allow, with the place of its strongest shape that they allow.

        The stronger the correlation, the larger the gains without a change: a weaker one has the smaller p-value.
        """
        likely = best - best.min() <= 2.0 * REFUTED
        return [
            (number, min(max(i for i in family if likely[i]), max(self._claimed & set(family))))
            for number, family in enumerate(self.families)
            if likely[list(family)].any()
        ]

    def scan(self, y: Array, rng: np.random.Generator, trials: int, level: float) -> Scan:
        """The best candidate for ``y`` (n,) and its p-value from ``trials`` simulated series a shape."""
        weighted = (self.root * (y - y.mean()))[:, np.newaxis]
        plain, best = self._deviances(weighted, range(len(self.prepared)))
        gains = [float(plain[list(own)].min() - best[list(own)].min()) for own in self.families]
        p = 0.0
        for family, place in self._not_refuted(best[:, 0]):
            p = max(p, self._p_value(gains[family], family, place, level, rng, trials))
            if p > level:
                break
        likeliest = self.prepared[int(best[:, 0].argmin())]
        total, taken = self._residual(likeliest, weighted)
        left = np.maximum(total - taken, 1e-15 * total + 1e-300)[:, 0]
        chosen = int((left * likeliest.weight).argmin())
        return Scan(
            self.kinds[chosen],
            int(self.positions[chosen]),
            p,
            likeliest.shape,
            self.root,
            self.columns[:, chosen],
            self.kinds,
            self.positions,
            likeliest.shape.log_determinant + len(y) * np.log(left),
        )
