"""Straight lines through days that resemble each other: what the means of blocks of days say of their uncertainty.

Days of a machine are not independent: what disturbs one (the shop's temperature, a set-up, wear that comes and goes)
often lasts until the next. The history is cut into blocks of equal time, and the line is judged by the scatter of their
means: the longer a block, the less it resembles its neighbours, whatever the process is within it. What resemblance is
left between neighbours is taken for a first-order process; its correlation is estimated from the residuals, freed of
the bias that the fitted line gives it, and raised by a margin, since a few blocks say little of it. Then the variance
of the coefficients, that of the residuals, and their degrees of freedom are those of such a process, for the plan at
hand. Many series are done at once: the parameters of a fleet, the origins of a backtest, the seeds of a trial.

Use ``trend`` for one parameter. Source of the sums of blocks: C. A. Bester, T. G. Conley and C. B. Hansen,
J. Econometrics 165 (2011) 137. Measured rates, and the price in power: docs/trials-statistics.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from monitor.records import Array

#: Every day is a block up to so many days; from 64 on so many days make one, up to so many blocks.
DAYS_AS_BLOCKS, DAYS_OF_BLOCK, MOST_BLOCKS = 16, 4, 20
#: A line and its scatter need so many blocks.
FEWEST_BLOCKS = 3
#: Margin on the correlation of neighbouring blocks, times the root of the number of days: its values at some numbers of
#: days, between which it is interpolated, and the days from which on all of it is added (with fewer, so little is left
#: of the scatter that its few degrees of freedom allow for the rest). The smallest, to a tenth, that keep false alarms
#: of a slope at 5 % below 7.5 % for correlations up to 0.8, day components up to twice the scatter of a run and 3 to
#: 250 days (docs/trials-statistics.md); around 20 days, where blocks begin to hold two days, it has to be the largest.
MARGIN_DAYS, MARGINS = (12.0, 16.0, 20.0, 24.0, 40.0), (1.1, 1.2, 1.35, 1.3, 1.1)
FULL_MARGIN = 10.0
#: Correlations at which the variances are computed; between them they are interpolated. Beyond the last one some
#: dozens of blocks have no line.
CORRELATIONS = np.linspace(0.0, 0.95, 20)
#: Up to so many blocks nothing is known of how far they resemble each other: no slope is better known than of blocks
#: that do not (those of two campaigns a month apart are no neighbours).
FEW_BLOCKS = 5
#: A cycle is fitted beside the line where the history covers this share of it (300 days of a year), where no block is
#: longer than that share of it, and where the variance of the slope grows by no more than this factor for it.
COVERED, LONGEST_BLOCK, WORST_INFLATION = 0.82, 0.4, 10.0
#: Histories in which a cycle of the last three would cost too much are too short for it up to this share of it.
ENDS_BEFORE = 1.2
#: Level, slope and wave beside two blocks to spare.
FEWEST_BESIDE_WAVE = 6
#: A column that the others explain but for this share of its length is no column.
DEPENDENT = 1e-6
#: Means that differ by less than this share of their level do not differ: rounding leaves as much of sums of some
#: hundred doubles. Where a campaign was imported again under other names, all days are equal but for it.
ROUNDING = 2.0**-44
#: Series done at a time: their blocks are held at once.
CHUNK = 20_000


@dataclass(frozen=True)
class Blocks:
    """Series cut into blocks, a row each: ``weight`` (c, b) is 0 where a series has nothing in a block.

    ``time`` and ``value`` (c, b) are weighted means of the days of a block, ``days`` (c,) the days of each series;
    ``beside`` (c, b, e) holds columns that are fitted beside the line, such as the temperature. ``origin`` (c,) is what
    was taken from the values before; None for nothing.
    """

    weight: Array
    time: Array
    value: Array
    days: Array
    beside: Array | None = None
    origin: Array | None = None

    def part(self, rows: slice | Array) -> Blocks:
        """Some of the series."""
        beside = None if self.beside is None else self.beside[rows]
        origin = None if self.origin is None else self.origin[rows]
        return Blocks(self.weight[rows], self.time[rows], self.value[rows], self.days[rows], beside, origin)


class AgainstSeason(NamedTuple):
    """Slopes (c,) beside a part of a wave of any size: Student's ``t`` without its sign, and its degrees ``dof``.

    NaN where no such wave is asked of the slope: the wave is fitted, a column (the temperature) stands beside the line,
    or no period was given. ``t`` is 0 where the blocks are too few to tell the two apart. ``bend`` is the size of the
    wave that turns in the middle of the history, which no slope shows; 0 where the blocks are too few.
    """

    t: Array
    dof: Array
    bend: Array


@dataclass(frozen=True)
class BlockLines:
    """Lines of c series, all (c,) but the ``covariance`` (c, 2, 2) of their level at ``at`` and their slope.

    ``correlation`` of neighbouring blocks is as estimated, ``allowed`` with its margin; ``widening`` is how much wider
    than with independent blocks the slope's uncertainty is. ``scatter`` is the factor by which the mean square of the
    residuals, divided by the blocks less the columns, is too small. ``cyclic``: the cycle was fitted beside the line.
    ``seasonal`` says how the slope stands beside a wave of any size where the history is too short to fit one
    (``AgainstSeason``, ``seasonal_slopes``). NaN where there are fewer than three blocks, or no more than columns.
    """

    at: Array
    slope: Array
    covariance: Array
    dof: Array
    correlation: Array
    allowed: Array
    widening: Array
    scatter: Array
    blocks: npt.NDArray[np.int64]
    cyclic: npt.NDArray[np.bool_]
    seasonal: AgainstSeason

    @property
    def u_slope(self) -> Array:
        """Standard uncertainty of the slopes (c,)."""
        return np.sqrt(self.covariance[:, 1, 1])


def block_count(days: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Number of blocks for so many days: one a day up to 16, then 16, then one for four days, 20 at most."""
    number = np.asarray(days, dtype=np.int64)
    return np.asarray(
        np.where(
            number <= DAYS_AS_BLOCKS, number, np.clip(number // DAYS_OF_BLOCK, DAYS_AS_BLOCKS, MOST_BLOCKS)
        )
    )


def block_of(
    times: Array, count: npt.ArrayLike, first: npt.ArrayLike, last: npt.ArrayLike
) -> npt.NDArray[np.int64]:
    """Block of each time where the stretch from ``first`` to ``last`` is cut into ``count`` equal ones."""
    number = np.asarray(count, dtype=np.int64)
    begin, end = np.asarray(first, dtype=np.float64), np.asarray(last, dtype=np.float64)
    share = (times - begin) / np.maximum(end - begin, 1e-300)
    return np.asarray(np.clip((share * number).astype(np.int64), 0, number - 1))


def blocks_of_days(weight: Array, time: Array, value: Array, beside: Array) -> Blocks:
    """One series cut into blocks: the means of its days (d,) with their weights, columns ``beside`` (d, e)."""
    days = len(time)
    index = block_of(time, int(block_count(days)), time.min(), time.max())
    block = np.unique(index, return_inverse=True)[1]
    total = np.asarray(np.bincount(block, weight), dtype=np.float64)

    def mean(column: Array) -> Array:
        return np.asarray(np.bincount(block, weight * column) / total, dtype=np.float64)

    columns = np.stack([mean(column) for column in beside.T], axis=1) if beside.shape[1] else None
    return Blocks(
        total[np.newaxis], mean(time)[np.newaxis], mean(value)[np.newaxis], np.array([float(days)]),
        None if columns is None else columns[np.newaxis],
    )  # fmt: skip


class _Design(NamedTuple):
    """Orthonormal columns (c, b, q) of the blocks, the times last; what the times have of each (c, q), and the length
    of the column of ones (c,)."""

    basis: Array
    line: Array
    ones: Array


def _orthonormal(root: Array, columns: list[Array]) -> tuple[Array, Array]:
    """Basis (c, b, q) of columns (c, b) times ``root`` (c, b), and what the last one has of each (c, q)."""
    basis: list[Array] = []
    shares = np.zeros((len(root), len(columns)))
    for index, column in enumerate(columns):
        rest = root * column
        length = np.sqrt(np.einsum("cb,cb->c", rest, rest))
        # Twice: what rounding leaves of the other columns is taken off as well.
        for _ in range(2):
            for before, unit in enumerate(basis):
                part = np.einsum("cb,cb->c", unit, rest)
                rest = rest - part[:, np.newaxis] * unit
                if index == len(columns) - 1:
                    shares[:, before] += part
        left_over = np.sqrt(np.einsum("cb,cb->c", rest, rest))
        good = left_over > DEPENDENT * np.maximum(length, 1e-300)
        basis.append(np.where(good[:, np.newaxis], rest, 0.0) / np.where(good, left_over, 1.0)[:, np.newaxis])
        shares[:, index] = np.where(good, left_over, 0.0)
    return np.stack(basis, axis=2), shares


def _covers(blocks: Blocks, cycle: float) -> npt.NDArray[np.bool_]:
    """Whether each series lasts long enough for a cycle, cut finely enough to follow it (c,)."""
    full = blocks.weight > 0.0
    span = np.where(full, blocks.time, -np.inf).max(axis=1) - np.where(full, blocks.time, np.inf).min(axis=1)
    return np.asarray((span >= COVERED * cycle) & (span <= LONGEST_BLOCK * cycle * block_count(blocks.days)))


def fits_cycle(blocks: Blocks, cycle: float) -> npt.NDArray[np.bool_]:
    """Whether a cycle is fitted beside the line of each series (c,), as ``block_lines`` decides."""
    covered = _covers(blocks, cycle)
    return _design(_packed(blocks), cycle)[2] if covered.any() else covered


def _middle(blocks: Blocks) -> tuple[Array, Array]:
    """Mean times (c,), and the times of the blocks from them (c, b)."""
    total = blocks.weight.sum(axis=1)
    at = np.einsum("cb,cb->c", blocks.weight, blocks.time) / np.where(total > 0.0, total, np.nan)
    return at, np.where(blocks.weight > 0.0, blocks.time - at[:, np.newaxis], 0.0)


def _design(blocks: Blocks, cycle: float | None) -> tuple[_Design, Array, npt.NDArray[np.bool_]]:
    """Return the columns of the fit, the mean times (c,), and whether the cycle is among them (c,)."""
    weight, time = blocks.weight, blocks.time
    total = weight.sum(axis=1)
    at, away = _middle(blocks)
    root, ones = np.sqrt(weight), np.ones_like(time)
    beside = [] if blocks.beside is None else list(np.moveaxis(np.nan_to_num(blocks.beside), 2, 0))
    basis, shares = _orthonormal(root, [ones, *beside, away])
    cyclic = np.zeros(len(time), dtype=np.bool_)
    if cycle is not None:
        cyclic = _covers(blocks, cycle)
    if cycle is not None and cyclic.any():
        phase = 2.0 * np.pi / cycle * away
        wide, wide_shares = _orthonormal(root, [ones, np.cos(phase), np.sin(phase), *beside, away])
        line_share, beside_cycle = shares[:, -1] ** 2, wide_shares[:, -1] ** 2
        cyclic &= (weight > 0.0).sum(axis=1) >= wide.shape[2] + 2
        cyclic &= (line_share > 0.0) & (beside_cycle * WORST_INFLATION >= line_share)
        # Series without the cycle have two columns of nothing in its stead.
        nothing = np.zeros((*basis.shape[:2], 2))
        plain = np.concatenate([basis[:, :, :1], nothing, basis[:, :, 1:]], axis=2)
        plain_shares = np.concatenate([shares[:, :1], nothing[:, 0], shares[:, 1:]], axis=1)
        basis = np.where(cyclic[:, np.newaxis, np.newaxis], wide, plain)
        shares = np.where(cyclic[:, np.newaxis], wide_shares, plain_shares)
    return _Design(basis, shares, np.sqrt(total)), at, cyclic


class _Tables(NamedTuple):
    """Of m plans at each of the correlations R (g): Q'R Q (m, g, q, q), and of the residuals M = 1 - Q Q' the trace of
    M R (m, g), its degrees of freedom (m, g), and the expected product of neighbours by the square (m, g)."""

    inside: Array
    trace: Array
    dof: Array
    neighbours: Array


@lru_cache(maxsize=64)
def _processes(b: int) -> Array:
    """The correlation matrices (g, b, b) of first-order processes over ``b`` blocks."""
    lag = np.abs(np.subtract.outer(np.arange(b), np.arange(b)))
    return np.asarray(CORRELATIONS[:, np.newaxis, np.newaxis] ** lag)


def _tables(basis: Array, count: npt.NDArray[np.int64]) -> _Tables:
    """Moments of first-order processes for m plans, each a ``basis`` (m, b, q) over ``count`` (m,) blocks."""
    _, b, _ = basis.shape
    r = _processes(b)
    present = np.arange(b) < count[:, np.newaxis]
    turned = np.einsum("gij,mjq->mgiq", r, basis, optimize=True) * present[:, np.newaxis, :, np.newaxis]
    inside = np.einsum("miq,mgip->mgqp", basis, turned, optimize=True)
    trace = count[:, np.newaxis] - np.trace(inside, axis1=2, axis2=3)
    lags = np.arange(1, b)
    pairs = np.maximum(count[:, np.newaxis] - lags, 0)
    squares = count[:, np.newaxis] + 2.0 * pairs @ (CORRELATIONS**2) ** lags[:, np.newaxis]
    squares -= 2.0 * (turned**2).sum(axis=(2, 3)) - (inside**2).sum(axis=(2, 3))
    beside = (count[:, np.newaxis] - 1.0) * CORRELATIONS
    beside -= np.einsum("miq,mgiq->mg", basis[:, :-1], turned[:, :, 1:])
    beside -= np.einsum("miq,mgiq->mg", basis[:, 1:], turned[:, :, :-1])
    beside += np.einsum("miq,mgqp,mip->mg", basis[:, :-1], inside, basis[:, 1:], optimize=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        # A line through as many blocks as it has coefficients leaves no residual.
        leaves = trace > 1e-9
        neighbours = np.maximum.accumulate(np.where(leaves, beside / trace, 0.0), axis=1)
        return _Tables(inside, trace, np.where(leaves, trace**2 / squares, 0.0), neighbours)


# The parameters of a machine have the same days, and so the same plan again and again.
@lru_cache(maxsize=64)
def _tables_of(numbers: bytes, shape: tuple[int, int], count: int) -> _Tables:
    return _tables(np.frombuffer(numbers).reshape(1, *shape), np.array([count]))


def _plans(design: _Design) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Rows of the distinct plans among c series, and the plan of each series (c,)."""
    c = len(design.basis)
    rows = np.ascontiguousarray(design.basis.reshape(c, -1))
    if (rows == rows[0]).all():
        return np.zeros(1, dtype=np.intp), np.zeros(c, dtype=np.intp)
    keys = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1])))[:, 0]
    _, first, index = np.unique(keys, return_index=True, return_inverse=True)
    return first, index


def _at(table: Array, plan: npt.NDArray[np.intp], row: npt.NDArray[np.intp], share: Array) -> Array:
    """Values of a table (m, g, ...) for the plans (c,), between the correlations ``row`` and the next."""
    low, high = table[plan, row], table[plan, row + 1]
    weight = share.reshape(-1, *[1] * (low.ndim - 1))
    return np.asarray(low + weight * (high - low))


def _between(neighbours: Array, product: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """Place and share of the correlation at which ``neighbours`` (c, g), which rise, have a ``product`` (c,)."""
    row = np.clip((neighbours <= product[:, np.newaxis]).sum(axis=1) - 1, 0, len(CORRELATIONS) - 2)
    rows = np.arange(len(row))
    low, high = neighbours[rows, row], neighbours[rows, row + 1]
    share = np.clip((product - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    return row, share


def _packed(blocks: Blocks) -> Blocks:
    """Blocks without the empty ones between: those that follow each other are neighbours, however far apart."""
    empty = ~(blocks.weight > 0.0)
    if not empty.any():
        return blocks
    order = np.argsort(empty, axis=1, kind="stable")[:, : max(int((~empty).sum(axis=1).max()), 1)]
    weight, time, value = (
        np.take_along_axis(np.where(empty, 0.0, column), order, axis=1)
        for column in (blocks.weight, blocks.time, blocks.value)
    )
    beside = blocks.beside
    if beside is not None:
        beside = np.take_along_axis(
            np.where(empty[:, :, np.newaxis], 0.0, beside), order[:, :, np.newaxis], axis=1
        )
    return Blocks(weight, time, value, blocks.days, beside, blocks.origin)


def block_lines(blocks: Blocks, *, cycle: float | None = None) -> BlockLines:
    """Lines of c series through the means of their blocks, the correlation of neighbours allowed for.

    ``cycle`` is the period, in the unit of the times, of a wave that is fitted beside the line where the history covers
    it. Arguments are trusted. Neglected: gaps between blocks, whose neighbours resemble each other less; a variance
    that differs otherwise than by the weights.
    """
    c = len(blocks.days)
    if c > CHUNK:
        parts = [block_lines(blocks.part(slice(i, i + CHUNK)), cycle=cycle) for i in range(0, c, CHUNK)]
        seasonal = AgainstSeason(*map(np.concatenate, zip(*(part.seasonal for part in parts), strict=True)))
        names = [name for name in BlockLines.__dataclass_fields__ if name != "seasonal"]
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in parts]) for name in names
        }
        return BlockLines(**columns, seasonal=seasonal)
    blocks = _packed(blocks)
    design, at, cyclic = _design(blocks, cycle)
    lines = _lines(blocks, design, at, cyclic)
    if cycle is None:
        return lines
    return replace(lines, seasonal=_against_season(blocks, design, cyclic, cycle))


def _against_season(
    blocks: Blocks, design: _Design, cyclic: npt.NDArray[np.bool_], cycle: float
) -> AgainstSeason:
    """Slopes of the series that cannot hold the whole wave, with one of any size fitted beside them."""
    c = len(blocks.days)
    is_beside = np.zeros(c, dtype=np.bool_)
    if blocks.beside is not None:
        is_beside = (np.abs(design.basis[:, :, 1:-1]).max(axis=1) > 0.0).any(axis=1) & ~cyclic
    full = blocks.weight > 0.0
    span = np.where(full, blocks.time, -np.inf).max(axis=1) - np.where(full, blocks.time, np.inf).min(axis=1)
    # Longer histories, whose slope would suffer too much from the wave, end before a second one begins; those of a few
    # days scatter about their line as much as the season moves them.
    share = np.where(full.sum(axis=1) >= FEWEST_BESIDE_WAVE, ENDS_BEFORE, COVERED)
    open_ = ~cyclic & ~is_beside & (span < share * cycle)
    t, dof, bend = np.full(c, np.nan), np.full(c, np.nan), np.zeros(c)
    if open_.any():
        some = replace(blocks.part(open_), beside=None)
        at, away = _middle(some)
        phase = 2.0 * np.pi / cycle * away
        basis, shares = _orthonormal(
            np.sqrt(some.weight), [np.ones_like(away), np.cos(phase), np.sin(phase), away]
        )
        wide = _Design(basis, shares, np.sqrt(some.weight.sum(axis=1)))
        lines = _lines(some, wide, at, np.ones(len(at), dtype=np.bool_))
        enough = (lines.blocks >= FEWEST_BESIDE_WAVE) & (lines.u_slope > 0.0)
        t[open_] = np.where(enough, np.abs(lines.slope) / np.where(enough, lines.u_slope, 1.0), 0.0)
        dof[open_] = np.where(enough, lines.dof, 1.0)
        bend[open_] = np.where(enough, _bend(some, at, np.cos(phase), away), 0.0)
    return AgainstSeason(t, dof, bend)


def _bend(blocks: Blocks, at: Array, even: Array, away: Array) -> Array:
    """The size (c,) of the even part of a wave, ``even`` (c, b), beside level and slope."""
    basis, shares = _orthonormal(np.sqrt(blocks.weight), [np.ones_like(away), away, even])
    design = _Design(basis, shares, np.sqrt(blocks.weight.sum(axis=1)))
    lines = _lines(blocks, design, at, np.ones(len(at), dtype=np.bool_))
    return np.nan_to_num(np.abs(lines.slope))


def _lines(blocks: Blocks, design: _Design, at: Array, cyclic: npt.NDArray[np.bool_]) -> BlockLines:
    """The lines of packed blocks for their columns."""
    c = len(blocks.days)
    basis, line = design.basis, design.line
    count = np.asarray((blocks.weight > 0.0).sum(axis=1))
    rank = (np.abs(basis).max(axis=1) > 0.0).sum(axis=1)
    first, plan = _plans(design)
    if len(first) == 1:
        tables = _tables_of(basis[0].tobytes(), basis.shape[1:], int(count[0]))
    else:
        tables = _tables(basis[first], count[first])
    # About the mean: values far above their scatter would lose its digits.
    mean = np.einsum("cb,cb->c", blocks.weight, blocks.value) / np.where(
        design.ones > 0.0, design.ones**2, np.nan
    )
    away = np.where(blocks.weight > 0.0, blocks.value - mean[:, np.newaxis], 0.0)
    level = np.abs(mean) + (0.0 if blocks.origin is None else np.abs(blocks.origin))
    away[np.abs(away).max(axis=1) <= ROUNDING * level] = 0.0
    y = np.sqrt(blocks.weight) * away
    along = np.einsum("cbq,cb->cq", basis, y)
    residual = y - np.einsum("cbq,cq->cb", basis, along)
    square = np.einsum("cb,cb->c", residual, residual)
    product = np.einsum("cb,cb->c", residual[:, 1:], residual[:, :-1]) / np.where(square > 0.0, square, 1.0)
    seen_place, seen_share = _between(tables.neighbours[plan], product)
    margin = np.interp(blocks.days, MARGIN_DAYS, MARGINS) / np.sqrt(np.maximum(blocks.days, 1.0))
    margin *= np.minimum(1.0, blocks.days / FULL_MARGIN)
    row, share = _between(tables.neighbours[plan], product + margin)
    inside, trace, dof = (_at(table, plan, row, share) for table in (tables.inside, tables.trace, tables.dof))
    enough = (count >= FEWEST_BLOCKS) & (count > rank) & (line[:, -1] > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(enough, square / trace, np.nan)
        spread = line[:, -1]
        slope = np.where(enough, along[:, -1] / spread, np.nan)
        covariance = np.empty((c, 2, 2))
        covariance[:, 0, 0] = inside[:, 0, 0] / design.ones**2
        covariance[:, 1, 1] = inside[:, -1, -1] / spread**2
        covariance[:, 0, 1] = covariance[:, 1, 0] = inside[:, 0, -1] / (design.ones * spread)
        covariance *= variance[:, np.newaxis, np.newaxis]
        scatter = np.where(enough, (count - rank) / trace, np.nan)
        widening = np.sqrt(inside[:, -1, -1] * scatter)
        too_narrow = (count <= FEW_BLOCKS) & (widening < 1.0) & (widening > 0.0)
        raised = 1.0 / np.where(too_narrow, widening, 1.0)
        covariance *= (raised**2)[:, np.newaxis, np.newaxis]
    return BlockLines(
        at=at,
        slope=slope,
        covariance=covariance,
        dof=np.where(enough, np.maximum(dof, 1.0), np.nan),
        correlation=_correlation(seen_place, seen_share),
        allowed=_correlation(row, share),
        widening=widening * raised,
        scatter=scatter,
        blocks=count,
        cyclic=cyclic,
        seasonal=AgainstSeason(np.full(c, np.nan), np.full(c, np.nan), np.zeros(c)),
    )


def _correlation(row: npt.NDArray[np.intp], share: Array) -> Array:
    return np.asarray(CORRELATIONS[row] + share * (CORRELATIONS[row + 1] - CORRELATIONS[row]))
