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
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array
from monitor.statistics.groups import independent_columns
from monitor.statistics.scan_candidates import EDGE, SEASON_FROM, Base, Kind, base_columns, candidates
from monitor.statistics.serial import DayComponent, FirstOrder, Shape

#: Correlations of neighbours of which the likelihood is computed.
GRID = np.arange(0.0, 0.91, 0.1)
#: Beyond this correlation no level is claimed: some dozens of such runs have no constant mean to change from.
HIGHEST = 0.8
#: Day components of which the likelihood is computed, in standard deviations of a run; and those that are allowed for
#: where other parameters show such (``day_evidence``): four days of which the last differs would else say nothing,
#: however much it differs.
DAY_GRID, WIDE_DAYS = (0.5, 1.0), (2.0, 4.0)
#: A correlation is refuted where the logarithm of its likelihood is so far below the highest: one-sided 97.7 % for
#: a normal estimate. Chosen by measured rates (docs/trials-statistics.md): 1 leaves 6 % false alarms of 20 runs.
REFUTED = 2.0
#: Simulations until a p-value is clearly no finding (Besag and Clifford, Biometrika 78 (1991) 301): they end where so
#: many exceedances, looked at after each block, had this probability at the level. Most searches end with the first.
HOPELESS, FIRST_BLOCK, BLOCK = 1e-6, 100, 500
#: So many numbers of candidates and series are computed at once: few stay in the processor's cache, many save calls. A
#: block of 20 runs (23 candidates) takes 1.1 ms whole and 2.2 ms in fifths; from 60 candidates on fifths are as fast.
AT_ONCE = 32_768
#: Values with heavy tails gain more by a change than normal ones. Where the kurtosis of what the best change leaves is
#: above that of normal values, 3, by so many times its scatter, the root of 24/n, the series without a change are
#: simulated with Student's distribution of so many degrees of freedom: without it 2.5 to 3.5 % are called at 1 %, with
#: a lower limit a step of ten in five days of thirteen parameters is missed (docs/trials-statistics.md). From ``MANY``
#: values on 4 degrees are too light for those of Student 3, 2 % of 104 are called at 1 %, and 3.5 cost no power;
#: with fewer 3.5 degrees would hide steps (one of fifteen scatters in sixteen runs of four days) and win nothing.
TAILED, TAIL_FREEDOM, MANY, FREEDOM_OF_MANY = 1.5, 4.0, 80, 3.5
#: Amplitude of a yearly wave that is allowed for where a history is too short to show it, in scatters of an innovation
#: (of a run, where runs are independent): without it 20, 30 and 38 weeks with such a wave are called in 2 to 3, 16 and
#: 28 % at 1 % (docs/trials-statistics.md).
SEASON = 1.0


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


@dataclass(frozen=True)
class Prepared:
    """One shape with what the base and the candidates are under it.

    ``turned`` (n, k) is W' base, ``along`` (c, k) its products with the candidates.
    """

    shape: Shape
    base: Array
    turned: Array
    along: Array
    inverse: Array
    weight: Array
    constant: float


class Null(NamedTuple):
    """Series without a change: a family of shapes, the place of that which they have, whether tails are heavy, and
    whether they hold a part of a yearly wave."""

    family: int
    shape: int
    tailed: bool
    season: bool = False


class _Sums(NamedTuple):
    """Columns (n, m) without the base, summed once for all first-order shapes.

    Of these W'W is 1 at the ends, 1 + r² between them and -r beside them; ``products`` (c, m) and ``squares`` (m,) are
    those with the columns, with all but their ends, and with their neighbours.
    """

    rows: Array
    products: tuple[Array, Array, Array]
    squares: tuple[Array, Array, Array]


class Scanner:
    """Everything of the search that does not depend on the values: prepared once for one plan.

    ``days`` (n,) are indices of the runs' days, None where no day has two runs; ``cycle`` is the period of a wave that
    is no change: fitted where the history covers it (``base_columns``), else one of ``SEASON`` is allowed for; with
    ``fitted_from`` it is fitted from that part of it on.
    ``beside`` (n, k) are columns of which every series may have any amount: what groups of runs are off by.
    """

    def __init__(
        self,
        times: Array,
        u: Array | None,
        base: Base,
        days: npt.NDArray[np.intp] | None = None,
        cycle: float | None = None,
        beside: Array | None = None,
        fitted_from: float | None = None,
    ) -> None:
        self.columns, self.kinds, self.positions = candidates(times, base)
        n = len(times)
        root = np.ones(n) if u is None else 1.0 / u
        self.root = root / np.sqrt(np.mean(root**2))
        columns = base_columns(times, base, cycle, fitted_from)
        is_covered = len(columns) > (1 if base == "constant" else 2)
        basis = np.column_stack([*columns, *([] if beside is None else beside.T)])
        if beside is not None:
            basis = basis[:, independent_columns(self.root[:, np.newaxis] * basis)]
        self.plain = np.linalg.qr(self.root[:, np.newaxis] * basis)[0]
        self.free = n - basis.shape[1]
        self._phase = None
        if cycle is not None and not is_covered and np.ptp(times) >= SEASON_FROM * cycle:
            self._phase = 2.0 * np.pi / cycle * times
        self.at = np.arange(EDGE, n - EDGE + 1)
        self.scaled = (times - times[0]) / max(float(np.ptp(times)), 1e-300)
        self.smooth = self.columns[:, : len(self.kinds) - len(self.at)] if base == "constant" else None
        shapes: list[Shape] = [FirstOrder(float(r)) for r in GRID]
        # Places of the shapes of each family, the weakest first: that of independent runs is in all. By days: the
        # usual, then with the wide ones.
        self.families = [tuple(range(len(GRID)))]
        if days is not None:
            shapes += [DayComponent(ratio, days, self.root) for ratio in (*DAY_GRID, *WIDE_DAYS)]
            wide = (0, *range(len(GRID), len(shapes)))
            self.families += [wide[: -len(WIDE_DAYS)], wide]
        self.prepared = [self._prepare(shape, basis) for shape in shapes]
        # Places of the shapes for which the level is claimed.
        self._claimed = {i for i in range(len(shapes)) if i >= len(GRID) or GRID[i] <= HIGHEST + 1e-9}
        self._null: dict[Null, Array] = {}
        self._known: dict[bytes, tuple[Array, Array]] = {}
        self._seed: int | None = None

    def _prepare(self, shape: Shape, basis: Array) -> Prepared:
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
        turned = shape.back(q)
        along = self._products(turned)
        return Prepared(shape, q, turned, along, np.where(good, 1.0 / square, 0.0), weight, constant)

    def _products(self, rows: Array) -> Array:
        """Products (c, m) of the candidates, weighted, with rows (n, m)."""
        along = self.root[:, np.newaxis] * rows
        # Steps and bends are sums from their place to the end.
        steps = np.cumsum(along[::-1], axis=0)[::-1][self.at]
        if self.smooth is not None:
            return np.concatenate([self.smooth.T @ along, steps])
        if len(self.at) > 4:
            ramps = np.cumsum((along * self.scaled[:, np.newaxis])[::-1], axis=0)[::-1][self.at]
            bends = ramps - self.scaled[self.at - 1, np.newaxis] * steps
            return np.concatenate([steps, bends[1:-1]])
        return steps

    def _sums(self, weighted: Array) -> _Sums:
        rows = weighted - self.plain @ (self.plain.T @ weighted)
        inner, beside = rows.copy(), np.zeros_like(rows)
        inner[[0, -1]] = 0.0
        beside[1:] += rows[:-1]
        beside[:-1] += rows[1:]
        parts = (rows, inner, beside)
        whole, within, next_to = (self._products(part) for part in parts)
        squares = (np.einsum("ij,ij->j", rows, part) for part in parts)
        return _Sums(rows, (whole, within, next_to), (next(squares), next(squares), next(squares)))

    def _residual(self, prepared: Prepared, sums: _Sums) -> tuple[Array, Array]:
        """What the base leaves of the columns, as a sum of squares (m,), and what each candidate (c, m) takes."""
        if isinstance(prepared.shape, FirstOrder):
            r = prepared.shape.strength
            total = sums.squares[0] + r * r * sums.squares[1] - r * sums.squares[2]
            explained = r * r * sums.products[1]
            explained += sums.products[0]
            explained -= r * sums.products[2]
            by_base = prepared.turned.T @ sums.rows
            total = np.maximum(total - (by_base**2).sum(axis=0), 0.0)
            explained -= prepared.along @ by_base
        else:
            rows = prepared.shape.whiten(sums.rows)
            rows -= prepared.base @ (prepared.base.T @ rows)
            total = np.einsum("ij,ij->j", rows, rows)
            explained = self._products(prepared.shape.back(rows))
        explained *= explained
        explained *= prepared.inverse[:, np.newaxis]
        return total, explained

    def _deviances(self, weighted: Array, places: Sequence[int]) -> tuple[Array, Array]:
        """Minus twice the residual log-likelihood by shape (s, m): of no change, and of the best candidate."""
        plain = np.empty((len(places), weighted.shape[1]))
        best = np.empty_like(plain)
        width = BLOCK if BLOCK * len(self.kinds) <= AT_ONCE else FIRST_BLOCK
        for start in range(0, weighted.shape[1], width):
            part = slice(start, start + width)
            sums = self._sums(weighted[:, part])
            for i, prepared in enumerate(self.prepared[index] for index in places):
                total, unexplained = self._residual(prepared, sums)
                np.subtract(total, unexplained, out=unexplained)
                np.maximum(unexplained, 1e-15 * total + 1e-300, out=unexplained)
                unexplained *= prepared.weight[:, np.newaxis]
                plain[i, part] = prepared.constant + self.free * np.log(total + 1e-300)
                best[i, part] = prepared.constant + self.free * np.log(unexplained.min(axis=0))
        return plain, best

    def _gain(self, weighted: Array, family: int) -> Array:
        """The statistic (m,) of columns (n, m) times the root of their weights."""
        plain, best = self._deviances(weighted, self.families[family])
        return np.asarray(plain.min(axis=0) - best.min(axis=0))

    def _simulated(self, null: Null, count: int, rng: np.random.Generator) -> Array:
        """The statistic of at least ``count`` series without a change; cached."""
        if self._seed is None:
            self._seed = int(rng.integers(2**63))
        gains = self._null.get(null, np.empty(0))
        while len(gains) < count:
            # Every shape sees the same noise: their p-values differ by the shape alone.
            size = len(self.root), BLOCK if len(gains) else FIRST_BLOCK
            draws = np.random.default_rng([self._seed, len(gains)])
            freedom = FREEDOM_OF_MANY if len(self.root) >= MANY else TAIL_FREEDOM
            noise = draws.standard_t(freedom, size) if null.tailed else draws.standard_normal(size)
            coloured = self.prepared[null.shape].shape.colour(noise)
            if null.season and self._phase is not None:
                start = draws.uniform(0.0, 2.0 * np.pi, size[1])
                coloured = coloured + SEASON * self.root[:, np.newaxis] * np.cos(
                    self._phase[:, np.newaxis] + start
                )
            gains = np.append(gains, self._gain(coloured, null.family))
        self._null[null] = gains
        return gains[:count]

    def _p_value(self, gain: float, null: Null, level: float, rng: np.random.Generator, trials: int) -> float:
        exceeding = simulated = 0
        while simulated < trials:
            upto = min(simulated + BLOCK if simulated else FIRST_BLOCK, trials)
            exceeding += int((self._simulated(null, upto, rng)[simulated:] >= gain).sum())
            if exceeding and scipy.special.bdtrc(exceeding - 1, upto, level) < HOPELESS:
                return exceeding / upto
            simulated = upto
        return (1 + exceeding) / (trials + 1)

    def _not_refuted(
        self, best: Array, numbers: Sequence[int], refuted: float = REFUTED
    ) -> list[tuple[int, int]]:
        """Each family that the deviances (s,) allow, with the place of its strongest shape that they allow.

        The stronger the correlation, the larger the gains without a change: a weaker one has the smaller p-value.
        """
        least = min(best[i] for number in numbers for i in self.families[number])
        allowed = []
        for number in numbers:
            family = self.families[number]
            likely = [i for i in family if best[i] - least <= 2.0 * refuted]
            if likely:
                allowed.append((number, min(max(likely), max(self._claimed & set(family)))))
        return allowed

    def day_support(self, y: Array) -> Array | None:
        """Log-likelihood of each day component, none first, with the best change of ``y`` (n,) taken off; None
        without days."""
        if len(self.families) == 1:
            return None
        return -0.5 * self._deviances_of(y)[1][list(self.families[-1]), 0]

    def look(self, every: Sequence[Array]) -> None:
        """Prepare the scan of several series (n,) at once: parameters of one plan cost little more than one."""
        columns = np.column_stack([self.root * (y - y.mean()) for y in every])
        plain, best = self._deviances(columns, range(len(self.prepared)))
        for i, y in enumerate(every):
            self._known[y.tobytes()] = plain[:, [i]], best[:, [i]]

    def _deviances_of(self, y: Array) -> tuple[Array, Array]:
        if y.tobytes() not in self._known:
            self.look([y])
        return self._known[y.tobytes()]

    def scan(
        self, y: Array, rng: np.random.Generator, trials: int, level: float, wide_days: bool = False
    ) -> Scan:
        """The best candidate for ``y`` (n,) and its p-value from ``trials`` simulated series a shape.

        ``wide_days``: whether day components of up to four times the scatter of a run are allowed for, too.
        """
        weighted = (self.root * (y - y.mean()))[:, np.newaxis]
        plain, best = self._deviances_of(y)
        numbers = [0] if len(self.families) == 1 else [0, 2 if wide_days else 1]
        places = sorted({i for number in numbers for i in self.families[number]})
        likeliest = self.prepared[min(places, key=lambda i: best[i, 0])]
        total, explained = self._residual(likeliest, self._sums(weighted))
        unexplained = np.maximum(total - explained, 1e-15 * total + 1e-300)[:, 0]
        best_candidate = int((unexplained * likeliest.weight).argmin())
        column = self.columns[:, best_candidate]
        tailed = kurtosis_is_heavy(likeliest, weighted, self.root * column)
        nulls = [Null(family, index, tailed) for family, index in self._not_refuted(best[:, 0], numbers)]
        if self._phase is not None:
            in_order = {0} | {null.shape for null in nulls if null.family == 0}
            nulls += [Null(0, index, tailed, season=True) for index in sorted(in_order)]
        p = 0.0
        for null in nulls:
            members = list(self.families[null.family])
            gain = float(plain[members].min() - best[members].min())
            p = max(p, self._p_value(gain, null, level, rng, trials))
            if p > level:
                break
        return Scan(
            self.kinds[best_candidate],
            int(self.positions[best_candidate]),
            p,
            likeliest.shape,
            self.root,
            column,
            self.kinds,
            self.positions,
            likeliest.shape.log_determinant + len(y) * np.log(unexplained),
        )


def kurtosis_is_heavy(prepared: Prepared, weighted: Array, candidate: Array) -> bool:
    """Whether what the base and a candidate (n,) leave of a series (n, 1), made independent, has heavy tails."""
    rows = prepared.shape.whiten(np.column_stack([weighted, candidate]))
    rows -= prepared.base @ (prepared.base.T @ rows)
    length = float(rows[:, 1] @ rows[:, 1])
    residual = rows[:, 0] - rows[:, 1] * (float(rows[:, 0] @ rows[:, 1]) / length if length > 1e-16 else 0.0)
    square, n = float(residual @ residual), len(residual)
    kurtosis = float(n * (residual**4).sum() / square**2) if square > 0.0 else 0.0
    return bool(kurtosis > 3.0 + TAILED * np.sqrt(24.0 / n))
