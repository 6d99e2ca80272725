"""Noise of neighbours: readings of one run that resemble those before them (drift, temperature, a slow probe).

The noise of a reading is an independent part and a part that follows an autoregression of first order along the probing
sequence. Both are estimated by restricted maximum likelihood (Patterson and Thompson, Biometrika 58 (1971) 545) and
taken out of all rows by the filter of Kalman (Trans. ASME J. Basic Eng. 82 (1960) 35), whose innovations are
independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.discovery.machine.noise.rows import Rows
from monitor.records import Array

# Correlations of neighbours and shares of the correlated part that are tried; neighbours on this grid differ by less
# than what 8 runs of 62 probings determine (about 0.05).
CORRELATIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.87, 0.93, 0.97, 0.99, 0.998)
# Without the shares between 0.8 and 1 the drift of a random walk over a run was taken for half of what it is, and told
# as an effect in up to 3 % of empty campaigns (docs/trials-discovery.md).
SHARES = (1.0, 0.99, 0.97, 0.94, 0.89, 0.8, 0.67, 0.5, 0.33, 0.2, 0.1)
# More runs than this say nothing more that the grid could tell apart.
MOST_RUNS = 5
# Neighbours that resemble each other by less than so many standard deviations of white noise are white.
NOTICED = 1.5
# A slow drift under independent noise shows in readings so far apart.
FAR = 8
# Twice the logarithm of the likelihood ratio from which on noise is correlated: 10 % of white campaigns with two
# parameters. Taking white noise for hardly correlated noise costs next to nothing.
LIKELIER = 4.6
# Numbers that are filtered in one piece (32 MB).
PIECE = 4_000_000
# Directions of which a filter leaves less than this part (squared) are unknown to it.
SMALLEST_EIGENVALUE = 1e-9
# Where each unknown beside those before it has more left than this, all of them are determined.
WELL_DETERMINED = 1e-6


@dataclass(frozen=True)
class Correlation:
    """Correlation ``rho`` of the dependent part of two neighbours, and its ``share`` of the variance; ``frame`` counts
    the layouts of directions in which they follow each other: as they are read (0), along a rotary axis."""

    rho: float
    share: float
    frame: int = 0


def slowness(correlation: Correlation) -> float:
    """What a correlation adds to the variance of the mean of many neighbours, as a multiple of that of white noise."""
    return correlation.share * 2.0 * correlation.rho / (1.0 - correlation.rho)


def caution(correlation: Correlation | None) -> tuple[float, float]:
    """What orders correlations by how much slow change they put down to noise."""
    return (0.0, 0.0) if correlation is None else (correlation.rho * correlation.share, correlation.rho)


def is_next(correlation: Correlation | None, other: Correlation | None) -> bool:
    """Whether two correlations are one step of the grid apart, in the correlation, in the share, or in both: what runs
    hardly determine (`CORRELATIONS`)."""
    if correlation is None or other is None or correlation.frame != other.frame or correlation == other:
        return False
    slower = CORRELATIONS.index(correlation.rho) - CORRELATIONS.index(other.rho)
    more = SHARES.index(correlation.share) - SHARES.index(other.share)
    return abs(slower) <= 1 and abs(more) <= 1


@dataclass(frozen=True)
class Filters:
    """The filters of Kalman of C correlations for runs in which the touches ``weighted`` (R, T) were read, each of them
    (R, T) after its neighbour."""

    correlations: tuple[Correlation, ...]
    weighted: npt.NDArray[np.bool_]
    begins: npt.NDArray[np.bool_] | None = None
    steps: Array | None = None

    @cached_property
    def rho(self) -> Array:
        """What every touch has of its neighbour before (C, R, T), so many ``steps`` ago: nothing where it has none."""
        rho = np.array([correlation.rho for correlation in self.correlations])[:, None, None]
        if self.steps is not None:
            rho = rho**self.steps
        goes_on = np.ones(self.weighted.shape) if self.begins is None else ~self.begins
        return np.asarray(rho * goes_on)

    @cached_property
    def recursion(self) -> tuple[Array, Array, Array]:
        """Gains and reciprocal standard deviations of the innovations, (C, R, T) each and zero where nothing was read,
        and the logarithms (C, R, T) of their variances."""
        share = np.array([correlation.share for correlation in self.correlations])[:, None]
        gain = np.zeros((len(share), *self.weighted.shape))
        variance = np.ones_like(gain)
        predicted = np.broadcast_to(share, gain.shape[:2])
        for touch, present in enumerate(self.weighted.T):
            if touch:
                rho = self.rho[..., touch]
                predicted = rho**2 * predicted + share * (1.0 - rho**2)
            total = predicted + (1.0 - share)
            gain[..., touch] = np.where(present, predicted / total, 0.0)
            variance[..., touch] = np.where(present, total, 1.0)
            predicted = predicted * (1.0 - gain[..., touch])
        return gain, self.weighted / np.sqrt(variance), np.log(variance)

    def logarithm(self, numbers: int, read: Array | None = None) -> Array:
        """The logarithms (C, R) of the determinants of the noise covariances of so many ``numbers`` a touch, or of
        ``read`` (R, T)."""
        variances = self.recursion[2]
        return np.asarray(np.sum(variances * (numbers if read is None else read), axis=2))

    def apply(self, readings: Array, some: slice = slice(None)) -> Array:
        """Innovations (C, R, T, k) of readings (R, T, k), divided by their standard deviations; under ``some`` of the
        correlations alone."""
        gain, reciprocal = (part[some] for part in self.recursion[:2])
        rho = self.rho[some]
        white = np.empty((len(gain), *readings.shape))
        state = np.zeros((len(gain), len(readings), readings.shape[2]))
        for touch in range(readings.shape[1]):
            predicted = rho[..., touch, None] * state
            innovation = readings[None, :, touch] - predicted
            white[:, :, touch] = innovation * reciprocal[..., touch, None]
            state = predicted + innovation * gain[..., touch, None]
        return white

    def apply_transposed(self, white: Array) -> Array:
        """The transposed filters, (C, R, T, k), of white numbers (C, R, T, k)."""
        gain, reciprocal, _ = self.recursion
        result = np.empty(white.shape)
        # What later innovations take of the state that a touch leaves.
        before = np.zeros((*white.shape[:2], white.shape[3]))
        for touch in reversed(range(white.shape[2])):
            scaled = white[:, :, touch] * reciprocal[..., touch, None]
            result[:, :, touch] = scaled + gain[..., touch, None] * before
            ahead = before - gain[..., touch, None] * before - scaled
            before = self.rho[..., touch, None] * ahead
        return result


def deviations(residual: Array, rows: Rows, cells: npt.NDArray[np.int64]) -> Array:
    """Residuals (R, N) less the mean of their ``cells`` (R, T) of the plan over the runs: what all runs share is an
    effect and no noise. With one run they stay as they are."""
    if len(residual) == 1:
        return residual
    runs, touches = rows.weighted.shape
    vectors = residual[:, : rows.count].reshape(runs * touches, rows.numbers)
    cell, weight = np.where(cells < 0, 0, cells).reshape(-1), rows.weighted.reshape(-1).astype(float)
    count = np.bincount(cell, weights=weight)
    mean = (
        np.stack([np.bincount(cell, weights=weight * column) for column in vectors.T], axis=1)
        / np.maximum(count, 1.0)[:, None]
    )
    result = np.array(residual)
    result[:, : rows.count] = ((vectors - mean[cell]) * weight[:, None]).reshape(runs, rows.count)
    return result


# Every correlation that is tried; the first is white noise.
GRID = (Correlation(0.0, 0.0), *(Correlation(rho, share) for share in SHARES for rho in CORRELATIONS))


@dataclass(frozen=True)
class _White:
    """What the filter of a correlation makes of a plan: ``turned`` (R, p, p) makes an orthonormal basis of the filtered
    span of what is unknown, of a ``rank`` in all runs; ``logarithm`` is the part of the criterion that no residual
    changes."""

    turned: Array
    rank: int
    logarithm: float

    def fitted(self, onto: Array) -> float:
        """The sum of squares that the span takes of filtered readings, of which ``onto`` (R, p) are the products with
        it."""
        return float(np.sum((self.turned @ onto[..., None]) ** 2))


def _orthonormal(products: Array) -> tuple[Array, Array, Array]:
    """What makes orthonormal bases (C, R, p, p) of spans with these products, without the directions of which nothing
    is left; their ranks (C,) and the logarithms (C,) of the determinants, of all runs."""
    nothing = np.diagonal(products, axis1=-2, axis2=-1) <= SMALLEST_EIGENVALUE
    try:
        # Unknowns that a run lacks are columns of zeros, which say nothing of the others.
        lower = np.linalg.cholesky(products + nothing[..., None] * np.eye(products.shape[-1]))
    except np.linalg.LinAlgError:
        return _orthonormal_of_able(products)
    lengths = np.diagonal(lower, axis1=-2, axis2=-1)
    if lengths.min(initial=1.0) ** 2 < WELL_DETERMINED:
        return _orthonormal_of_able(products)
    logarithms = 2.0 * np.sum(np.log(lengths), axis=(1, 2))
    return np.linalg.inv(lower), np.count_nonzero(~nothing, axis=(1, 2)), logarithms


def _orthonormal_of_able(products: Array) -> tuple[Array, Array, Array]:
    """The same where the filter may leave nothing of some combinations."""
    values, vectors = np.linalg.eigh(products)
    able = values > SMALLEST_EIGENVALUE
    lengths = np.sqrt(np.where(able, values, 1.0))
    turned = np.swapaxes(vectors, -1, -2) * np.where(able, 1.0 / lengths, 0.0)[..., None]
    return turned, np.count_nonzero(able, axis=(1, 2)), 2.0 * np.sum(np.log(lengths), axis=(1, 2))


@dataclass(frozen=True)
class NoiseDesign:
    """What the estimate of a correlation needs besides residuals: the ``rows`` with the ``cells`` (R, T) of the plan,
    and an orthonormal ``basis`` (R, N, p) of what is unknown in every run.

    Of several runs only what they do not share counts, and their means take their part of the degrees of freedom; all
    counts where ``shared`` is said to be noise too. ``frame`` is that of the correlations.
    """

    rows: Rows
    cells: npt.NDArray[np.int64]
    basis: Array
    shared: bool = False
    frame: int = 0

    def correlation(self, residual: Array) -> Correlation | None:
        """The correlation of residuals (R, N); None where they are white."""
        readings, rest = self._parts_of(residual)
        if self._resemblance(readings) < NOTICED:
            return None
        # Of the grid no more than what is asked: the span of hundreds of unknowns takes long under each of them.
        criterion = self._criteria(readings, rest, (GRID[0], *GRID[1 : 1 + len(CORRELATIONS)]))
        best = min((Correlation(rho, 1.0) for rho in CORRELATIONS), key=criterion.__getitem__)
        # The more independent noise, the more alike has the rest to be.
        start = CORRELATIONS.index(best.rho)
        trials = [
            Correlation(rho, share) for share in SHARES for rho in CORRELATIONS[max(start - 1, 0) :: 2][:4]
        ]
        criterion |= self._criteria(readings, rest, [trial for trial in trials if trial not in criterion])
        best = min((best, *trials), key=criterion.__getitem__)
        least = criterion[best]
        if criterion[GRID[0]] - least <= LIKELIER:
            return None
        # A slow drift under much independent noise: far readings resemble each other as much as neighbours, hardly.
        # Of the slow correlations that are likelier still the slowest counts: a drift that is taken for white noise
        # makes an effect.
        slow = [trial for trial in GRID[1:] if trial.rho >= best.rho]
        criterion |= self._criteria(readings, rest, [trial for trial in slow if trial not in criterion])
        likelier = (trial for trial in slow if criterion[trial] < least)
        return replace(max((best, *likelier), key=slowness), frame=self.frame)

    def least_criterion(self, residual: Array) -> float:
        """Minus twice the logarithm, but for a constant, of the restricted likelihood of residuals (R, N) under the
        likeliest correlation."""
        return min(self._criteria(*self._parts_of(residual)).values())

    def likelihoods(self, residual: Array) -> list[tuple[Correlation | None, float]]:
        """Every correlation that is tried with the restricted likelihood of residuals (R, N), the largest of them 1."""
        criteria = np.array([*self._criteria(*self._parts_of(residual)).values()])
        relative = np.exp(-0.5 * (criteria - criteria.min()))
        correlations = (replace(correlation, frame=self.frame) for correlation in GRID[1:])
        return list(zip((None, *correlations), relative.tolist(), strict=True))

    def deviance(self, squares: float, correlation: Correlation | None) -> float:
        """Minus twice the logarithm, but for a constant, of the likelihood of what the unknowns of this design leave of
        the readings, under a correlation of the grid and the variance that makes it largest, where generalised least
        squares under it leave so many ``squares``.

        Models that add other effects to this design compare: the likelihood is restricted by what they have in common
        alone. Restricted by all that each model has, the likelihoods would be of different numbers, in other units
        (Harville, J. Am. Stat. Assoc. 72 (1977) 320, section 4.2; Gurka, Am. Stat. 60 (2006) 19).
        """
        (white,) = self._whites([GRID[0] if correlation is None else replace(correlation, frame=0)])
        number = self._number(white)
        return float(self._share * white.logarithm + number * np.log(squares / number))

    @property
    def contrasts(self) -> float:
        """How many independent numbers the unknowns leave of the readings."""
        return self._number(*self._whites(GRID[:1]))

    def _parts_of(self, residual: Array) -> tuple[Array, Array]:
        """What of residuals (R, N) says how neighbours resemble each other."""
        noise = residual if self.shared else deviations(residual, self.rows, self.cells)
        return self._parts(noise[self._runs, :, None])

    @cached_property
    def _runs(self) -> npt.NDArray[np.int64]:
        runs = len(self.basis)
        if self.shared:
            return np.arange(runs)
        return np.unique(np.linspace(0, runs - 1, min(runs, MOST_RUNS)).astype(np.int64))

    @cached_property
    def _weighted(self) -> npt.NDArray[np.bool_]:
        return np.asarray(self.rows.by_neighbours(self.rows.weighted)[self._runs])

    @cached_property
    def _own(self) -> tuple[Array, Array]:
        return self._parts(self.basis[self._runs])

    @cached_property
    def _share(self) -> float:
        """The part of the degrees of freedom that the means over the runs leave."""
        runs = len(self.basis)
        return 1.0 if self.shared or runs == 1 else (runs - 1) / runs

    def _parts(self, numbers: Array) -> tuple[Array, Array]:
        """Columns (R, N, k) as readings (R, T, d k) in their own directions and after their neighbours, and what is no
        reading (R, e, k)."""
        rows = self.rows
        runs, touches = self._weighted.shape
        readings = numbers[:, : rows.count].reshape(runs, touches, rows.numbers, -1)
        if rows.turned is not None:
            readings = rows.turned[self._runs] @ readings
        readings = rows.by_neighbours(readings, self._runs)
        readings = np.where(self._weighted[..., None, None], readings, 0.0)
        rest = numbers[:, rows.count :]
        # What setups state (the length of a bar) may contradict another instrument: that is no noise of readings, and
        # would be taken for an offset of all readings of the setup, noise that hardly changes.
        return readings.reshape(runs, touches, -1), rest if rows.read is None else rest[:, :0]

    def _resemblance(self, readings: Array) -> float:
        """The sum of products of neighbours, and of all readings up to ``FAR`` apart, less what the fit alone makes of
        white noise, in standard deviations; the larger of the two."""
        unknowns = self._own[0].reshape(*self._weighted.shape, self.rows.numbers, -1)
        number = self._share * (self._numbers - float(np.sum(unknowns**2)))
        variance = max(float(np.sum(readings**2)) / max(number, 1.0), 1e-300)
        lags = np.arange(1, min(FAR, readings.shape[1] - 1) + 1)
        beyond = [
            float(np.sum(readings[:, lag:] * readings[:, :-lag] * alike[:, :, None])) / variance
            + self._share * float(np.sum(unknowns[:, lag:] * unknowns[:, :-lag] * alike[:, :, None, None]))
            for lag in lags
            for alike in (self._of_one_series(int(lag)),)
        ]
        deviates = np.cumsum(beyond) / np.sqrt(np.maximum(lags * number, 1.0))
        return float(max(deviates[0], deviates[-1])) if len(lags) else 0.0

    @cached_property
    def _numbers(self) -> float:
        """How many numbers were read."""
        rows = self.rows
        read = (
            rows.numbers * self._weighted if rows.read is None else rows.by_neighbours(rows.read)[self._runs]
        )
        return float(np.sum(read))

    def _of_one_series(self, lag: int) -> Array:
        """Ones (R, T - lag) where a touch and the one so far before it are of one instrument, zeros elsewhere."""
        begins = self.rows.begins
        if begins is None:
            return np.ones((len(self._weighted), self._weighted.shape[1] - lag))
        series = np.cumsum(begins[self._runs], axis=1)
        return np.asarray(series[:, lag:] == series[:, :-lag], dtype=np.float64)

    def _criteria(
        self, readings: Array, rest: Array, correlations: Sequence[Correlation] = GRID
    ) -> dict[Correlation, float]:
        """Minus twice the logarithm of the restricted likelihood under each of some correlations of the grid, but for a
        constant."""
        filters = self._filters(correlations)
        residual = filters.apply(readings)
        unknowns, unknown_rest = self._own
        spans = unknowns.reshape(*readings.shape, -1)
        onto = np.einsum("rtdp,crtd->crp", spans, filters.apply_transposed(residual), optimize=True)
        onto += np.einsum("rep,re->rp", unknown_rest, rest[..., 0])
        squares = np.sum(residual**2, axis=(1, 2, 3)) + float(np.sum(rest**2))
        criteria = {}
        whites = self._whites(correlations)
        for number, (correlation, white) in enumerate(zip(correlations, whites, strict=True)):
            sum_of_squares = max(float(squares[number]) - white.fitted(onto[number]), 1e-300)
            criteria[correlation] = float(
                self._share * white.logarithm + self._number(white) * np.log(sum_of_squares)
            )
        return criteria

    def _number(self, white: _White) -> float:
        """The degrees of freedom under a correlation: of readings, and of what setups state."""
        rest = self._own[1]
        numbers = self._numbers + rest.shape[0] * rest.shape[1]
        return float(self._share * (numbers - white.rank))

    @cached_property
    def _known(self) -> dict[Correlation, _White]:
        return {}

    def _whites(self, correlations: Sequence[Correlation]) -> list[_White]:
        """What the filters of some correlations make of the plan, each made once."""
        new = [correlation for correlation in correlations if correlation not in self._known]
        filters = self._filters(new)
        read = None if self.rows.read is None else self.rows.by_neighbours(self.rows.read)[self._runs]
        logarithms = filters.logarithm(self.rows.numbers, read).sum(axis=1)
        at_once = max(1, PIECE // max(self._own[0].size, 1))
        for first in range(0, len(new), at_once):
            some = slice(first, first + at_once)
            turned, ranks, determinants = _orthonormal(self._products(filters, some))
            wholes = (logarithms[some] + determinants).tolist()
            whites = map(_White, turned, ranks.tolist(), wholes)
            self._known.update(zip(new[some], whites, strict=True))
        return [self._known[correlation] for correlation in correlations]

    def _filters(self, correlations: Sequence[Correlation]) -> Filters:
        begins = None if self.rows.begins is None else self.rows.begins[self._runs]
        steps = None if self.rows.steps is None else self.rows.steps[self._runs]
        return Filters(tuple(correlations), self._weighted, begins, steps)

    def _products(self, filters: Filters, some: slice) -> Array:
        """The products (C, R, p, p) of the span of what is unknown, filtered under some correlations, with itself."""
        unknowns, rest = self._own
        white = filters.apply(unknowns, some)
        span = white.reshape(*white.shape[:2], -1, rest.shape[-1])
        return np.asarray(np.swapaxes(span, 2, 3) @ span + np.swapaxes(rest, 1, 2) @ rest)
