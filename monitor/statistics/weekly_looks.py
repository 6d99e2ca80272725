"""Looks at a fleet every week, for ever: which parameter, or which machine as a whole, changed; few of them falsely.

Every look spends a part of a probability: a small stake is put on "it changes now" in every series, multiplied from
then on by the likelihood ratio of every score against "nothing changed". A stake that has grown to one is a change
that was noticed. Without a change the expected worth of all stakes is what was put in (each is a martingale: Ville), so
that the expected number of false notices never exceeds it, whenever one stops to look; and what is put in over the
whole fleet never exceeds ``rate`` times the number of changes noticed (or one, before the first): online control of the
false discovery rate by spending (Foster and Stine, J. R. Stat. Soc. B 70 (2008) 429; Ramdas et al., NIPS 30 (2017)
5650), with e-detectors in place of tests (Shin, Ramdas and Rinaldo, New Engl. J. Stat. Data Sci. 2 (2024) 229).
Parameters and machines may depend on each other in any way.

A stake overshoots one when it crosses it; by that mean factor (Siegmund, Sequential Analysis, 1985, eq. 4.37) it is
put in larger. What is assumed: scores that are standard normal and independent of the past (``sequential_scores``);
how far that holds is in docs/trials-statistics.md.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics.checks import as_probability
from monitor.statistics.sequential_scores import (
    SequentialScores,
    TailShape,
    VectorScores,
    shrunk_correlation,
)

#: False discovery rate over all machines, parameters and weeks.
RATE = 0.05
#: Shifts, in standard deviations of a value, that the stakes are on, each with both signs; for others from 0.8 to 4 a
#: tenth of the information is lost at most, and of a third one's share more would be lost than won (trial_weekly).
SHIFTS = (1.0, 2.5)
#: Mean squared lengths of a shift of the whole vector (in its covariance) that the stakes are on.
LENGTHS = (4.0, 16.0)
#: Of what may still be spent, the part that a look spends: half a year's looks share it.
PART = 1.0 / 26.0
#: A likelihood ratio of exp(3) for a change leaves a series out of what scores usually look like.
CALM = 3.0
#: Looks that a stake on the vector is followed: a change that half a year did not show is left to the singles.
FOLLOWED = 26


def overshoot(shift: float) -> float:
    """Mean of exp(-overshoot) of a random walk of likelihood ratios for a ``shift``, in standard deviations.

    Siegmund (1985), eq. 4.37: 2 / shift² exp(-2 sum Phi(-shift sqrt(n) / 2) / n).
    """
    n = np.arange(1, 2001)
    return float(2.0 / shift**2 * np.exp(-2.0 * np.sum(scipy.special.ndtr(-0.5 * shift * np.sqrt(n)) / n)))


@dataclass(frozen=True, eq=False)
class Look:
    """What one look noticed: ``parameters`` (m, p), ``vectors`` (m,), and the stakes (m, p) and (m,), noticed at 1.

    ``since`` (m, p) and ``vector_since`` (m,): how many values of the series, with this one, probably lie after its
    change. ``spent`` is the expected number of false notices so far at most, ``noticed`` the notices so far;
    ``series`` is how many had a stake put on them.
    """

    parameters: npt.NDArray[np.bool_]
    vectors: npt.NDArray[np.bool_]
    stakes: Array
    vector_stakes: Array
    since: npt.NDArray[np.int64]
    vector_since: npt.NDArray[np.int64]
    spent: float
    noticed: int
    series: int


class _Singles:
    """Stakes on a shift of every series: worth (m, p, k) of k shifts."""

    def __init__(self, m: int, p: int) -> None:
        self._shifts = np.array([sign * shift for shift in SHIFTS for sign in (1.0, -1.0)])
        self._weights = np.array([1.0 / overshoot(abs(shift)) for shift in self._shifts]) / len(self._shifts)
        self._worth = np.zeros((m, p, len(self._shifts)))
        self._climb = np.zeros_like(self._worth)
        self._since = np.zeros(self._worth.shape, dtype=np.int64)

    def restart(self, mask: npt.NDArray[np.bool_]) -> None:
        """Forget the stakes on the series of ``mask`` (m, p)."""
        self._worth[mask] = self._climb[mask] = 0.0
        self._since[mask] = 0

    @property
    def calm(self) -> npt.NDArray[np.bool_]:
        """Series (m, p) of which no chart has climbed by ``CALM``: those that say what scores look like."""
        return np.asarray((self._climb < CALM).all(axis=2))

    def add(self, scores: Array, stake: float) -> tuple[Array, npt.NDArray[np.int64]]:
        """Return the worth (m, p) after ``scores`` (m, p) and the values since each probable change."""
        active = np.isfinite(scores)
        rise = scores[active][:, np.newaxis] * self._shifts - 0.5 * self._shifts**2
        self._worth[active] = (self._worth[active] + stake * self._weights) * np.exp(np.minimum(rise, 500.0))
        # Where each chart last stood at nothing: since then its series has probably been another.
        climb = self._climb[active] + rise
        self._since[active] = np.where(climb > 0.0, self._since[active] + 1, 0)
        self._climb[active] = np.maximum(climb, 0.0)
        best = self._worth.argmax(axis=2)[:, :, np.newaxis]
        return self._worth.sum(axis=2), np.take_along_axis(self._since, best, axis=2)[:, :, 0]


class _Vectors:
    """Stakes on a shift, in any direction, of the vectors of the machines ``rows`` that have the same ``columns``."""

    def __init__(self, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]) -> None:
        self.rows, self.columns = rows, columns
        self._scores = VectorScores(len(rows), len(columns))
        self._path = np.zeros((len(rows), len(columns)))
        self._steps = np.zeros(len(rows))
        # Of each earlier look: the path of the vectors before it, the steps, the stake put in then.
        self._starts: deque[tuple[Array, Array, Array]] = deque(maxlen=FOLLOWED)

    def restart(self, mask: npt.NDArray[np.bool_]) -> None:
        """Forget the past of the machines in ``mask`` (r,) and the stakes on them."""
        self._scores.restart(mask)
        for _, _, stake in self._starts:
            stake[mask] = 0.0

    def scores(self, values: Array, correlation: Array) -> Array:
        """Return the scores of the machines in ``rows`` and add their values, both (m, p) of the whole fleet."""
        cells = np.ix_(self.rows, self.columns)
        return self._scores.add(values[cells], correlation[cells])

    def add(self, scores: Array, stake: float) -> tuple[Array, npt.NDArray[np.int64]]:
        """Return the worth (r,) of the machines' stakes and the values since each probable change."""
        r, p = scores.shape
        active: npt.NDArray[np.bool_] = np.asarray(np.isfinite(scores).all(axis=1))
        self._starts.append((self._path.copy(), self._steps.copy(), np.where(active, stake, 0.0)))
        self._path += np.where(active[:, np.newaxis], scores, 0.0)
        self._steps += active
        total, most, since = np.zeros(r), np.zeros(r), np.zeros(r, dtype=np.int64)
        for path, steps, put_in in self._starts:
            squares, k = ((self._path - path) ** 2).sum(axis=1), self._steps - steps
            for length in LENGTHS:
                # A shift of unknown direction, normal with this mean squared length.
                spread = length / p
                log = -0.5 * p * np.log1p(k * spread) + 0.5 * spread * squares / (1.0 + k * spread)
                worth = put_in / len(LENGTHS) * np.exp(np.minimum(log, 500.0))
                total += worth
                since = np.where(worth > most, k.astype(np.int64), since)
                most = np.maximum(most, worth)
        return total, since


class WeeklyLooks:
    """The looks at m machines of which each has the parameters that ``has`` (m, p) says.

    ``look`` takes the values of a week and says what was noticed. A series that was noticed begins anew; one with few
    values (fewer than seven, a vector of q parameters q + 7) says nothing and costs nothing.
    """

    def __init__(self, has: npt.NDArray[np.bool_], *, rate: float = RATE) -> None:
        """Raises DataError for a ``rate`` that is none."""
        self.rate = as_probability(rate, "rate")
        self.spent, self.noticed = 0.0, 0
        m, p = self._shape = has.shape
        self._scores, self._singles = SequentialScores(m, p), _Singles(m, p)
        self._tails, self._vector_tails = TailShape(), TailShape()
        alike: dict[bytes, list[int]] = {}
        for machine in range(m):
            alike.setdefault(has[machine].tobytes(), []).append(machine)
        # One parameter alone has no vector.
        self._vectors = [
            _Vectors(np.array(rows), np.flatnonzero(has[rows[0]]))
            for rows in alike.values()
            if has[rows[0]].sum() > 1
        ]

    def restart(self, mask: npt.NDArray[np.bool_]) -> None:
        """Begin the machines of ``mask`` (m,) anew: something was done to them, and what was is no measure any more."""
        series = np.repeat(mask[:, np.newaxis], self._shape[1], axis=1)
        self._scores.restart(series)
        self._singles.restart(series)
        for vectors in self._vectors:
            vectors.restart(mask[vectors.rows])

    def look(self, values: Array) -> Look:
        """Take the ``values`` (m, p) of a week, NaN where none was measured, and return what is noticed now.

        Raises DataError for another shape.
        """
        if values.shape != self._shape:
            raise DataError(f"values has shape {values.shape}; {self._shape} is needed.")
        correlation = shrunk_correlation(self._scores.raw_correlation(), self._scores.count)
        scores = self._tails.normalised(self._scores.add(values, correlation), self._singles.calm)
        of_vectors = [vectors.scores(values, correlation) for vectors in self._vectors]
        every = np.concatenate([np.empty(0), *(part.ravel() for part in of_vectors)])
        every = self._vector_tails.normalised(every, np.ones(len(every), dtype=np.bool_))
        ends = np.cumsum([0, *(part.size for part in of_vectors)])
        of_vectors = [
            every[first:end].reshape(part.shape)
            for part, first, end in zip(of_vectors, ends[:-1], ends[1:], strict=True)
        ]
        count = int(
            np.isfinite(scores).sum() + sum(np.isfinite(part).all(axis=1).sum() for part in of_vectors)
        )
        stake = self._stake(count)
        stakes, since = self._singles.add(scores, stake)
        vector_stakes, vector_since = np.zeros(len(values)), np.zeros(len(values), dtype=np.int64)
        for vectors, part in zip(self._vectors, of_vectors, strict=True):
            vector_stakes[vectors.rows], vector_since[vectors.rows] = vectors.add(part, stake)
        parameters, whole = stakes >= 1.0, vector_stakes >= 1.0
        self._scores.restart(parameters)
        self._singles.restart(parameters)
        for vectors in self._vectors:
            vectors.restart(whole[vectors.rows])
        self.noticed += int(parameters.sum() + whole.sum())
        return Look(
            parameters, whole, stakes, vector_stakes, since, vector_since, self.spent, self.noticed, count
        )

    def _stake(self, count: int) -> float:
        """What is put on each of the ``count`` series of this look."""
        if not count:
            return 0.0
        spend = max(self.rate * max(self.noticed, 1) - self.spent, 0.0) * PART
        self.spent += spend
        return spend / count
