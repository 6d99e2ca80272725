"""Correlated noise of neighbouring rows: its process, and p-values that allow for it.

A first-order process plus independent noise (what a slow disturbance and a reading make together), seen at
equal steps of the order of the rows. Nobody knows its two numbers beforehand, and a plug-in estimate of them
makes tests too sure of themselves, so the p-values here are averages over a grid of processes, each weighted
by its restricted likelihood (Harville, J. Am. Statist. Assoc. 72 (1977) 320) under the model *with* the effect
that is tested: an effect that is there takes the resemblance away with it, one that is not leaves it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy

from monitor.records import Array

# Correlations of the slow part from one row to the next; between neighbours of the grid the variance of a mean
# of 100 rows changes by less than a factor of two. Negative ones (every row overcorrects the last) have no
# independent part of their own.
SLOW = (0.2, 0.4, 0.6, 0.75, 0.85, 0.92, 0.96, 0.98, 0.99)
INDEPENDENT_SHARES = (0.0, 0.3, 0.6, 0.8, 0.9)
ALTERNATING = (-0.7, -0.5, -0.3, -0.15)
# Beforehand, noise of rows is as likely independent as not.
INDEPENDENT = 0.5
# Correlation is reported from here on: one false alarm in a hundred campaigns.
NOTICED = 0.01
# From here on the filter counts as stationary; the rest of its way moves no p-value by a part in a million.
_SETTLED = 1e-8


@dataclass(frozen=True)
class Noise:
    """A process: correlation ``slow`` of its slow part from row to row, ``independent`` share of its variance."""

    slow: float = 0.0
    independent: float = 0.0

    @property
    def white(self) -> bool:
        """Whether its rows are independent."""
        return self.slow == 0.0

    @property
    def lag_one(self) -> float:
        """Correlation of neighbouring rows."""
        return (1.0 - self.independent) * self.slow

    @property
    def theta(self) -> float:
        """The moving-average coefficient of the same process written as ARMA(1,1)."""
        phi, r = self.slow, self.lag_one
        a, b = phi - r, 1.0 + phi**2 - 2.0 * phi * r
        return 0.0 if a == 0.0 else float((-b + np.sqrt(b**2 - 4.0 * a**2)) / (2.0 * a))

    @property
    def variance(self) -> float:
        """Variance of a row as a multiple of that of what no earlier row predicts."""
        phi, theta = self.slow, self.theta
        return (1.0 + 2.0 * phi * theta + theta**2) / (1.0 - phi**2)

    def correlations(self, count: int) -> Array:
        """Correlation (count,) of rows 0, 1, 2 ... apart."""
        r = np.asarray((1.0 - self.independent) * self.slow ** np.arange(count), dtype=np.float64)
        r[0] = 1.0
        return r

    def whiten(self, columns: Array) -> tuple[Array, float]:
        """Columns (n, k) as what no earlier row predicts, at unit variance each, and the sum of the logarithms of
        the variances (the log-determinant): innovations of an ARMA(1,1) from its exact start."""
        if self.white:
            return columns, 0.0
        phi, theta = self.slow, self.theta
        steps = np.array(columns, dtype=np.float64)
        steps[1:] -= phi * columns[:-1]
        variance = self.variance
        logarithm = float(np.log(variance))
        before = steps[0].copy()
        steps[0] = before / np.sqrt(variance)
        for row in range(1, len(steps)):
            weight = theta / variance
            variance = 1.0 + theta**2 - theta**2 / variance
            logarithm += float(np.log(variance))
            before = steps[row] - weight * before
            steps[row] = before / np.sqrt(variance)
            if abs(variance - 1.0) < _SETTLED:
                if row + 1 < len(steps):
                    steps[row + 1 :] = scipy.signal.lfilter(
                        [1.0], [1.0, theta], steps[row + 1 :], axis=0, zi=-theta * before[None]
                    )[0]
                break
        return steps, logarithm


WHITE = Noise()


@cache
def processes() -> tuple[tuple[Noise, float], ...]:
    """The grid of processes, each with its probability beforehand."""
    others = [Noise(slow, share) for slow in SLOW for share in INDEPENDENT_SHARES]
    others += [Noise(slow) for slow in ALTERNATING]
    return ((WHITE, INDEPENDENT), *((noise, (1.0 - INDEPENDENT) / len(others)) for noise in others))


@dataclass(frozen=True)
class Assessed:
    """Noise of a model's residual: the likeliest process, its probability, and how sure it is that rows are not
    independent (``p_value``: likelihood ratio with two degrees of freedom)."""

    noise: Noise
    p_value: float

    @property
    def noticed(self) -> bool:
        """Whether the resemblance of neighbours counts as seen."""
        return not self.noise.white and self.p_value < NOTICED


def _likelihoods(y: Array, x: Array) -> list[tuple[Noise, float, float, Array, Array]]:
    """For every process: log restricted likelihood with its prior, without, and whitened response and columns."""
    scale = np.linalg.norm(x, axis=0)
    both = np.column_stack([y, x / np.where(scale == 0, 1.0, scale)])
    fits = []
    for noise, prior in processes():
        white, logarithm = noise.whiten(both)
        q, r, _ = scipy.linalg.qr(white[:, 1:], mode="economic", pivoting=True)
        diagonal = np.abs(np.diag(r)) if r.size else np.zeros(0)
        rank = int(np.sum(diagonal > 1e-9 * max(diagonal.max(initial=0.0), 1e-300)))
        residual = white[:, 0] - q[:, :rank] @ (q[:, :rank].T @ white[:, 0])
        dof = max(len(y) - rank, 1)
        sum_of_squares = max(float(residual @ residual), 1e-300)
        likelihood = -0.5 * (
            dof * np.log(sum_of_squares / dof) + logarithm + 2.0 * float(np.sum(np.log(diagonal[:rank])))
        )
        fits.append((noise, float(likelihood + np.log(prior)), float(likelihood), white, q[:, :rank]))
    return fits


def assess(y: Array, x: Array) -> Assessed:
    """The noise in ``y`` (n,) around a model with columns ``x`` (n, k), rows in the order in which they were made."""
    if len(y) < x.shape[1] + 8:
        return Assessed(WHITE, 1.0)
    fits = _likelihoods(y, x)
    best = max(fits, key=lambda fit: fit[1])
    ratio = 2.0 * (max(fit[2] for fit in fits) - fits[0][2])
    return Assessed(best[0], float(scipy.special.chdtrc(2.0, max(ratio, 0.0))))


def p_value_in_noise(y: Array, x: Array, added: Array, *, white: bool = False) -> float:
    """Return the p-value of the columns ``added`` (n, k) beside ``x`` (n, c).

    It is that of F in every process, averaged over what the data say of the process once the columns are in. With
    ``white``, or with fewer than eight rows to spare, the noise counts as independent.
    """
    fits = _likelihoods(y, np.column_stack([x, added]))
    if white or len(y) < x.shape[1] + added.shape[1] + 8:
        fits = fits[:1]
    most = max(fit[1] for fit in fits)
    weights = np.exp([fit[1] - most for fit in fits])
    total = 0.0
    for weight, (_, _, _, rows, basis) in zip(weights, fits, strict=True):
        if weight < 1e-12:
            continue
        small, rank = _basis(rows[:, 1 : 1 + x.shape[1]])
        before = rows[:, 0] - small @ (small.T @ rows[:, 0])
        after = rows[:, 0] - basis @ (basis.T @ rows[:, 0])
        total += weight * _f_test(before, after, basis.shape[1] - rank, len(y) - basis.shape[1])
    return float(min(1.0, total / weights.sum()))


def _basis(columns: Array) -> tuple[Array, int]:
    if columns.shape[1] == 0:
        return np.zeros((len(columns), 0)), 0
    q, r, _ = scipy.linalg.qr(columns, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(r))
    rank = int(np.sum(diagonal > 1e-9 * max(diagonal.max(initial=0.0), 1e-300)))
    return q[:, :rank], rank


def _f_test(before: Array, after: Array, added_rank: int, dof: int) -> float:
    if added_rank < 1 or dof < 1:
        return 1.0
    explained, unexplained = float(before @ before - after @ after), float(after @ after)
    if unexplained <= 0.0:
        return 0.0
    return float(scipy.special.fdtrc(added_rank, dof, max(explained, 0.0) / added_rank / (unexplained / dof)))


def p_value_against_noise(y: Array, x: Array, added: Array) -> float:
    """Return the p-value of the columns ``added`` (n, k) against the rival that there is nothing but correlated noise.

    Likelihood ratio of two explanations, the columns in their likeliest noise and no columns in theirs, judged by F so
    that few rows do not exaggerate (they do not nest, so it is no exact level; see docs/trials-curve.md).
    """
    few = len(y) < x.shape[1] + added.shape[1] + 8
    without, rank = _largest_likelihood(y, x, few)
    with_added, whole_rank = _largest_likelihood(y, np.column_stack([x, added]), few)
    dof = len(y) - whole_rank
    if whole_rank <= rank or dof < 1:
        return 1.0
    f = np.expm1(np.minimum(max(with_added - without, 0.0) * 2.0 / len(y), 700.0)) * dof / (whole_rank - rank)
    return float(scipy.special.fdtrc(whole_rank - rank, dof, f))


def _largest_likelihood(y: Array, x: Array, white_only: bool) -> tuple[float, int]:
    """Log likelihood in the likeliest process, and the rank of the columns."""
    scale = np.linalg.norm(x, axis=0)
    both = np.column_stack([y, x / np.where(scale == 0, 1.0, scale)])
    best, rank = -np.inf, 0
    for noise, _ in processes()[: 1 if white_only else None]:
        white, logarithm = noise.whiten(both)
        basis, rank = _basis(white[:, 1:])
        residual = white[:, 0] - basis @ (basis.T @ white[:, 0])
        best = max(
            best, -0.5 * (len(y) * np.log(max(float(residual @ residual), 1e-300) / len(y)) + logarithm)
        )
    return float(best), rank


def effective_number(noise: Noise, count: int) -> float:
    """How many independent rows a mean of ``count`` rows is worth: n / (1 + 2 sum (1 - k/n) r_k)."""
    rho = noise.correlations(count)
    lags = np.arange(1, count)
    return float(count / max(1.0 + 2.0 * np.sum((1.0 - lags / count) * rho[1:]), 1.0 / count))
