"""How heavy the tails of touches are, and how likely a shift of some of them is under such tails.

Least squares take one wild touch for a shift of all its neighbours. Under Student's t, with the degrees of freedom that
the touches themselves show, a wild one says hardly more than that it is wild, and touches that all stand elsewhere say
as much as under Gauss (Lange, Little and Taylor, Journal of the American Statistical Association 84 (1989) 881).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from monitor.records import Array

# From the heaviest tails with a variance that can be worked with to those of Gauss.
DEGREES_OF_FREEDOM = (2.0, 3.0, 4.0, 6.0, 9.0, 15.0, 30.0, 1e6)
# Reweighting in turn settles to a part in a thousand within some ten steps. A step of less than this part of the
# coefficients does not show in their deviance, which is least there.
STEPS, SETTLED = 30, 1e-9
# Part of the most visible of a run's unknowns below which one is seen elsewhere, by the bar say, and not by touches.
UNSEEN = 1e-6


@dataclass(frozen=True)
class Tails:
    """Student's t of vectors: ``freedom`` degrees of freedom, ``variance`` the square of its scale along an axis."""

    freedom: float
    variance: float

    def weights(self, squares: Array, numbers: int) -> Array:
        """Return the weights (n,) of vectors of so many numbers with lengths squared ``squares`` (n,)."""
        return np.asarray((self.freedom + numbers) / (self.freedom + squares / self.variance))

    def least_deviance(self, vectors: Array, columns: Array, start: Array) -> float:
        """The deviance that coefficients of ``columns`` (n, d, k) leave, reweighted in turn from ``start`` (k,) on."""
        coefficients, flat = start, columns.reshape(-1, columns.shape[2])
        for _ in range(STEPS):
            weights = self.weights(self._squares(vectors - columns @ coefficients), vectors.shape[1])
            weighted = flat * np.repeat(weights, vectors.shape[1])[:, None]
            inverse = np.linalg.pinv(weighted.T @ flat, rcond=UNSEEN, hermitian=True)
            before, coefficients = coefficients, inverse @ (weighted.T @ vectors.reshape(-1))
            if np.abs(coefficients - before).max() <= SETTLED * np.abs(coefficients).max():
                break
        return self._deviance(vectors - columns @ coefficients)

    def _deviance(self, vectors: Array) -> float:
        terms = np.log1p(self._squares(vectors) / self.variance / self.freedom)
        return float((self.freedom + vectors.shape[1]) * terms.sum())

    @staticmethod
    def _squares(vectors: Array) -> Array:
        return np.asarray(np.sum(vectors**2, axis=1))


@dataclass(frozen=True)
class Shifts:
    """Shifts of some of the ``vectors`` (n, d) of a run under ``tails``.

    With a shift and without it the ``unknowns`` (n, d, p) of the run are determined anew under these tails: by least
    squares one wild touch has moved them, and all that they move.
    """

    tails: Tails
    vectors: Array
    unknowns: Array

    @cached_property
    def _without(self) -> float:
        return self.tails.least_deviance(self.vectors, self.unknowns, self._usual)

    @property
    def _usual(self) -> Array:
        return np.zeros(self.unknowns.shape[2])

    def likelihood(self, moved: Array, start: Array) -> float:
        """Return twice the logarithm of the likelihood ratio of a shift (k,) that moves the vectors by ``moved``
        (n, d, k), from ``start`` (k,) on."""
        both = np.concatenate([self.unknowns, moved], axis=2)
        start = np.concatenate([self._usual, start])
        return self._without - self.tails.least_deviance(self.vectors, both, start)


def tails_of(vectors: Array) -> Tails:
    """Return the likeliest tails of vectors (n, d)."""
    squares, numbers = np.sum(vectors**2, axis=1), vectors.shape[1]
    start = max(float(np.median(squares)) / float(scipy.special.chdtri(numbers, 0.5)), 1e-300)
    best, most = Tails(DEGREES_OF_FREEDOM[-1], start), -np.inf
    for freedom in DEGREES_OF_FREEDOM:
        tails = Tails(freedom, start)
        for _ in range(STEPS):
            tails = Tails(
                freedom, max(float(np.mean(tails.weights(squares, numbers) * squares)) / numbers, 1e-300)
            )
        likelihood = _log_likelihood(tails, squares, numbers)
        if likelihood > most:
            best, most = tails, likelihood
    return best


def _log_likelihood(tails: Tails, squares: Array, numbers: int) -> float:
    """The logarithm of the density of vectors with these lengths squared, without what all tails share."""
    half = (tails.freedom + numbers) / 2.0
    constant = scipy.special.gammaln(half) - scipy.special.gammaln(tails.freedom / 2.0)
    constant -= numbers / 2.0 * np.log(tails.freedom * tails.variance)
    return float(len(squares) * constant - half * np.log1p(squares / tails.variance / tails.freedom).sum())
