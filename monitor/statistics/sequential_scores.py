"""Scores of the newest value against those before it, exact from the first few values on, for many series at once.

Recursive residuals (Brown, Durbin and Evans, J. R. Stat. Soc. B 37 (1975) 149): of independent normal values with
unknown mean and scatter the scores are independent standard normal, whatever their number. Of a vector the residuals
are taken component by component given those before (the decomposition of Hotelling's T²), which makes them independent
standard normal too. Neighbouring values may resemble each other: each value is first freed of what the one before it
says, with a correlation that the whole fleet tells (``shrunk_correlation``).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array

#: Values of a series before its first score: with fewer, nothing is known of its scatter or of its neighbours.
FEWEST = 6
#: Standard deviations of what is known of a correlation by which it is taken larger: too large a correlation costs
#: power, too small a one costs false alarms.
MARGIN = 1.0
#: No larger correlation of neighbours is taken out: the values then are a random walk to this test.
LARGEST = 0.95


class SequentialScores:
    """Sums of m groups (machines) of p series; a new vector (m, p) gives its scores and enters the sums.

    ``count`` (m, p) are the pairs of neighbouring values in the sums since the last restart.
    """

    def __init__(self, m: int, p: int) -> None:
        self.count = np.zeros((m, p))
        self._last = np.full((m, p), np.nan)
        self._origin = np.full((m, p), np.nan)
        # Sums over pairs of neighbours: a, b, aa, bb, ab with a the earlier value, about the origin.
        self._sums = np.zeros((5, m, p))

    def restart(self, mask: npt.NDArray[np.bool_]) -> None:
        """Forget the past of the series in ``mask`` (m, p)."""
        self.count[mask] = 0.0
        self._last[mask] = np.nan
        self._origin[mask] = np.nan
        self._sums[:, mask] = 0.0

    def raw_correlation(self) -> Array:
        """Correlation of neighbours of each series (m, p), freed of most of its bias; NaN with fewer than FEWEST."""
        n = np.where(self.count >= FEWEST, self.count, np.nan)
        a, b, aa, bb, ab = self._sums
        with np.errstate(divide="ignore", invalid="ignore"):
            # As one series: the mean and the scatter are those of both columns.
            centre = 0.5 * (a + b) / n
            scatter = 0.5 * (aa + bb) - n * centre**2
            r = (ab - centre * (a + b) + n * centre**2) / scatter
        # Kendall, Biometrika 41 (1954) 403: the mean of r is about rho - (1 + 3 rho) / n.
        return np.asarray(np.clip(r + (1.0 + 3.0 * r) / n, -1.0, 1.0))

    def add(self, values: Array, correlation: Array) -> Array:
        """Return the scores (m, p) of ``values`` (m, p), NaN where there is no value or too few before it; add them.

        ``correlation`` (m, p) of neighbours is taken out.
        """
        self._origin = np.where(np.isnan(self._origin), values, self._origin)
        y, rho, n = values - self._origin, correlation, self.count
        a, b, aa, bb, ab = self._sums
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = (b - rho * a) / n
            squares = bb - 2.0 * rho * ab + rho**2 * aa - n * mean**2
            sd = np.sqrt(np.maximum(squares, 0.0) / (n - 1.0) * (1.0 + 1.0 / n))
            t = (y - rho * self._last - mean) / sd
        scores = normal_score(np.where((n >= FEWEST) & (sd > 0.0), t, np.nan), n - 1.0)
        pair = np.isfinite(y) & np.isfinite(self._last)
        earlier, later = np.where(pair, self._last, 0.0), np.where(pair, y, 0.0)
        self._sums += np.stack([earlier, later, earlier**2, later**2, earlier * later])
        self.count += pair
        self._last = np.where(np.isfinite(y), y, self._last)
        return scores


class VectorScores:
    """The same for whole vectors of m machines (m, p): independent scores (m, p) of each, NaN before p + FEWEST."""

    def __init__(self, m: int, p: int) -> None:
        self.count = np.zeros(m)
        self._origin = np.full((m, p), np.nan)
        self._last = np.full((m, p), np.nan)
        self._first = np.zeros((2, m, p))
        self._second = np.zeros((3, m, p, p))

    def restart(self, mask: npt.NDArray[np.bool_]) -> None:
        """Forget the past of the machines in ``mask`` (m,)."""
        self.count[mask] = 0.0
        self._origin[mask] = self._last[mask] = np.nan
        self._first[:, mask] = 0.0
        self._second[:, mask] = 0.0

    def add(self, values: Array, correlation: Array) -> Array:
        """Return the scores (m, p) of ``values`` (m, p); NaN where a value lacks or too few vectors were before."""
        p = values.shape[1]
        fresh = np.isnan(self._origin).any(axis=1)
        self._origin[fresh] = values[fresh]
        y = values - self._origin
        scores = np.full_like(values, np.nan)
        ready = np.flatnonzero((self.count >= p + FEWEST) & np.isfinite(y).all(axis=1))
        if len(ready):
            scores[ready] = self._scores(ready, y[ready], correlation[ready])
        pair = np.isfinite(y).all(axis=1) & np.isfinite(self._last).all(axis=1)
        a, b = self._last[pair], y[pair]
        self._first[0, pair] += a
        self._first[1, pair] += b
        for k, (first, second) in enumerate(((a, a), (b, b), (b, a))):
            self._second[k, pair] += first[:, :, None] * second[:, None, :]
        self.count[pair] += 1.0
        whole = np.isfinite(y).all(axis=1)
        self._last[whole] = y[whole]
        return scores

    def _scores(self, rows: npt.NDArray[np.int64], y: Array, rho: Array) -> Array:
        n, p = self.count[rows], y.shape[1]
        aa, bb, ba = self._second[:, rows]
        mean = (self._first[1, rows] - rho * self._first[0, rows]) / n[:, None]
        first, second = rho[:, :, None], rho[:, None, :]
        scatter = bb - second * ba - first * ba.transpose(0, 2, 1) + first * second * aa
        scatter -= n[:, None, None] * mean[:, :, None] * mean[:, None, :]
        scale = np.sqrt(np.maximum(np.einsum("mii->mi", scatter), 1e-300))
        scatter /= scale[:, :, None] * scale[:, None, :]
        # Columns that are exactly dependent have no direction of their own: a part in 1e9 keeps the root real.
        scatter += 1e-9 * np.eye(p)
        away = (y - rho * self._last[rows] - mean) / scale / np.sqrt(1.0 + 1.0 / n)[:, None]
        parts = np.linalg.solve(np.linalg.cholesky(scatter), away[:, :, None])[:, :, 0]
        before = np.cumsum(parts**2, axis=1) - parts**2
        freedom = n[:, None] - 1.0 - np.arange(p)
        return normal_score(parts * np.sqrt(freedom / (1.0 + before)), freedom)


def normal_score(t: Array, freedom: Array) -> Array:
    """Standard normal scores of Student's t: equal probabilities; NaN stays NaN."""
    with np.errstate(invalid="ignore"):
        tail = scipy.special.stdtr(np.maximum(freedom, 1.0), -np.abs(t))
    return np.asarray(-np.sign(t) * scipy.special.ndtri(np.maximum(tail, 1e-300)))


def shrunk_correlation(raw: Array, count: Array) -> Array:
    """Correlations (m, p) of neighbours to be taken out, from raw ones (m, p) of ``count`` pairs and their fleet.

    Each is drawn towards the mean of the fleet as far as its own scatter and that of the fleet say (empirical Bayes:
    Efron and Morris, J. Am. Stat. Assoc. 70 (1975) 311), and taken larger by ``MARGIN`` of what remains unknown.
    Parameters of one machine may share their noise: what the mean of the fleet is worth is judged by machines.
    A series without a correlation of its own gets that of the fleet with the scatter of the fleet; without any, 0.
    """
    usable = np.isfinite(raw)
    if not usable.any():
        return np.zeros_like(raw)
    sampling = 1.0 / np.where(usable, count, np.inf)
    mean = float(raw[usable].mean())
    between = max(float(np.mean((raw[usable] - mean) ** 2 - sampling[usable])), 0.0)
    rows = usable.any(axis=1)
    of_machines = np.nanmean(raw[rows], axis=1)
    several = len(of_machines) > 1
    of_mean = float(of_machines.var(ddof=1) / len(of_machines) if several else sampling[usable].max())
    share = np.where(usable, between / np.maximum(between + sampling, 1e-300), 0.0)
    centre = mean + share * np.where(usable, raw - mean, 0.0)
    unknown = np.where(usable, share * sampling, between) + (1.0 - share) ** 2 * of_mean
    return np.asarray(np.clip(centre + MARGIN * np.sqrt(unknown), 0.0, LARGEST))


class TailShape:
    """Student's distribution that the scores of a fleet follow, and the scores made normal by it.

    Its scale and degrees of freedom are those of the quantiles at 0.5 and 0.99 of all scores so far, the latter at the
    upper end of what so many scores determine: one in a hundred may be those of changed machines, as long as they are
    fewer the tails are those of the rest.
    """

    _EDGES = np.linspace(0.0, 12.0, 1201)
    _FREEDOM = 1.0 / np.linspace(1.0 / 200.0, 1.0 / 2.05, 120)
    _MIDDLE, _FAR = 0.5, 0.99
    #: Scores that show a shape; before, Student's distribution with the degrees of freedom below.
    _FEWEST, _AT_FIRST = 100.0, 4.0

    def __init__(self) -> None:
        self._counts = np.zeros(len(self._EDGES))
        middle = scipy.special.stdtrit(self._FREEDOM, 0.5 + self._MIDDLE / 2.0)
        far = scipy.special.stdtrit(self._FREEDOM, 0.5 + self._FAR / 2.0)
        self._middle, self._ratio = middle, far / middle
        self.freedom, self.scale = self._AT_FIRST, 1.0

    def normalised(self, scores: Array, calm: npt.NDArray[np.bool_]) -> Array:
        """Return scores (any shape) as standard normal ones by the shape of those before.

        Those that are ``calm`` (same shape) then count for the shape; what is calm must not depend on these scores.
        """
        normal = normal_score(scores / self.scale, np.full_like(scores, self.freedom))
        usable = np.abs(scores[np.isfinite(scores) & calm])
        self._counts += np.bincount(
            np.minimum((usable / self._EDGES[1]).astype(np.int64), len(self._EDGES) - 1),
            minlength=len(self._EDGES),
        )
        total = self._counts.sum()
        if total >= self._FEWEST:
            below = np.cumsum(self._counts)
            certain = self._FAR * total + 2.0 * np.sqrt(total * self._FAR * (1.0 - self._FAR))
            middle = self._EDGES[np.searchsorted(below, self._MIDDLE * total)] + 0.005
            far = self._EDGES[min(np.searchsorted(below, min(certain, total)), len(self._EDGES) - 1)] + 0.005
            row = min(int(np.searchsorted(self._ratio, far / middle)), len(self._FREEDOM) - 1)
            self.freedom, self.scale = float(self._FREEDOM[row]), float(middle / self._middle[row])
        return normal
