"""Sum over the outputs of the probability of each to lie beyond k times its estimated uncertainty.

Each of these probabilities needs the law of one variance alone: a sum of chi-squares, one of every estimated part. So
they are integrated over evenly spread points of as many dimensions as there are parts, where what all outputs do
together has to be drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from monitor.records import Array

#: Points of a sum of tails, and the standard error of a factor that they leave, as a part of it: at most 4.7e-4 over
#: ten shifts of the points, with 13 outputs, 15 degrees of freedom of the readings and two estimated parts.
_POINTS, TAILS_ERROR = 8192, 5e-4
#: The logarithm of a sum of tails is nearly straight in k²: so many values of it, and a polynomial of this degree.
_NODES, _DEGREE = 8, 6


@dataclass(frozen=True)
class PartTails:
    """``variances`` (m,) of a part, how it is estimated: the degrees of freedom ``dof`` by which estimates are divided
    and the chi-squares ``first`` and ``second`` that an estimate and an estimate of that estimate follow."""

    variances: Array
    dof: float
    first: float
    second: float


Tails = Callable[[float], float]


def normal_tails(outputs: int) -> Callable[[float], float]:
    """Return the sum of the tails beyond k of ``outputs`` whose variances are known."""
    return lambda k: 2.0 * outputs * float(scipy.special.ndtr(-k))


def tails_of(parts: Sequence[PartTails], p: float, shift: float = 0.5) -> tuple[Tails, Tails]:
    """Return the sum of tails beyond k where the ``parts`` are true, and where an estimate of them is taken for true.

    Fastest for k between that of one output and that at which the sum is 1 - ``p``. Both are of the same points, so
    that what they have in common falls out of a quotient of their factors; another ``shift`` of the points says how
    well they do.
    """
    estimated = [part for part in parts if math.isfinite(part.dof)]
    points = spread_points(_POINTS, 2 * len(estimated), shift)
    true = np.zeros((_POINTS, 1))
    once, taken, twice = (np.zeros((_POINTS, len(parts[0].variances))) for _ in range(3))
    for part in parts:
        if math.isinf(part.dof):
            for total in (once, taken, twice):
                total += part.variances
            true = true + part.variances
            continue
        again, drawn = points[:, 0], points[:, 1]
        points = points[:, 2:]
        size = _chi_square(drawn, part.first) / part.dof
        true = true + part.variances
        once += _chi_square(again, part.first)[:, None] / part.dof * part.variances
        taken += size[:, None] * part.variances
        twice += (size * _chi_square(again, part.second) / part.dof)[:, None] * part.variances
    return _sum_of_tails(np.sqrt(once / true), p), _sum_of_tails(np.sqrt(twice / taken), p)


def _sum_of_tails(ratios: Array, p: float) -> Tails:
    """Return the mean over the points of the sum of tails of the ``ratios`` (n, m) of estimated to true u."""

    def logarithm(square: float) -> float:
        total = 2.0 * float(np.sum(scipy.special.ndtr(-math.sqrt(square) * ratios))) / len(ratios)
        return math.log(max(total, 1e-300))

    low = float(scipy.special.ndtri(0.5 * (1.0 + p))) ** 2
    # Of a tiny p the first is zero, which no factor makes larger.
    high, wanted = max(2.0 * low, 1e-6), math.log(1.0 - p)
    while logarithm(high) > wanted:
        high *= 1.5
    angles = np.pi * (np.arange(_NODES) + 0.5) / _NODES
    squares = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(angles)
    line = np.polynomial.Chebyshev.fit(
        squares, [logarithm(square) for square in squares], _DEGREE, [low, high]
    )

    def tails(k: float) -> float:
        # Outside of its nodes the polynomial says nothing: there it may turn and rise without bound.
        square = k * k
        return math.exp(float(line(square)) if low <= square <= high else logarithm(square))

    return tails


def _chi_square(probability: Array, freedom: float) -> Array:
    """Return the quantiles of the chi-square distribution."""
    return np.asarray(2.0 * scipy.special.gammaincinv(0.5 * freedom, probability))


def spread_points(count: int, dimensions: int, shift: float = 0.5) -> Array:
    """Return ``count`` points (count, dimensions) in the open unit cube, evenly spread.

    Multiples of the powers of 1/g, with g the real root above 1 of g^(d+1) = g + 1: the sequence of the golden ratio in
    d dimensions (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
    """
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimensions + 1.0))
    steps = root ** -np.arange(1.0, dimensions + 1.0)
    points = (shift + np.arange(1.0, count + 1.0)[:, None] * steps) % 1.0
    return np.asarray(np.clip(points, 1e-12, 1.0 - 1e-12))
