"""Slopes over a part of a year: whether the values move, whether a season can be all of it, what it may be of it.

A history of less than a year holds a part of the season, which looks like a slope. The lines and their t beside a wave
of any size come from ``block_lines``. Rates, and what they cost: docs/trials-statistics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from monitor.records import Array
from monitor.statistics.days.block_lines import AgainstSeason

#: Below this p-value a season is refuted as all of a slope.
REFUTED = 0.05


class SeasonalSlopes(NamedTuple):
    """Slopes (c,) that may hold a part of a season: ``u`` with that, ``p_value`` of the values not moving at all, and
    ``season_p`` of their moving with a season alone; NaN where no season is asked of them."""

    u: Array
    p_value: Array
    season_p: Array


def beside_season(slope: Array, u: Array, dof: Array, seasonal: AgainstSeason) -> SeasonalSlopes:
    """Two p-values of slopes (c,) and their standard uncertainty, with what a season may be of them.

    ``p_value`` says whether the values moved, by whatever; ``season_p``, the larger of that and of the slope beside a
    wave of any size, whether a season can be all of it. Where it can, it may be any part of the slope or have hidden as
    much: a rectangular distribution of that half-width is added to ``u`` (JCGM 100:2008, 4.3.7), so that "no drift"
    lies in the interval and the season is bounded by what was seen. Where it cannot, ``u`` grows until slope over
    uncertainty says no more than beside the wave. The slope stays that of the history, season included.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        # Values that are all equal moved by nothing.
        t = np.where((slope == 0.0) & (u == 0.0), 0.0, np.abs(slope / u))
        p_value = np.asarray(2.0 * scipy.special.stdtr(dof, -t))
        wave_p = 2.0 * scipy.special.stdtr(seasonal.dof, -seasonal.t)
        season_p = np.where(np.isnan(wave_p), np.nan, np.fmax(p_value, wave_p))
        refuted = np.fmax(u, np.abs(slope) / seasonal.t)
        widened = np.where(season_p < REFUTED, refuted, np.hypot(u, slope / np.sqrt(3.0)))
    return SeasonalSlopes(np.where(np.isnan(season_p), u, widened), p_value, season_p)


@dataclass(frozen=True)
class SeasonAhead:
    """What a season may be of lines (k,) beyond their last runs: ``u`` of the slopes, ``begins`` and ``ends`` of the
    runs, the period ``cycle``, and the size of the wave that turns within the runs (``bend`` of ``AgainstSeason``)."""

    u: npt.ArrayLike
    begins: npt.ArrayLike
    ends: npt.ArrayLike
    cycle: float
    bend: npt.ArrayLike = 0.0

    def at(self, times: npt.ArrayLike) -> Array:
        """Return the standard uncertainty that the season adds at ``times``, 0 up to the last run.

        The season may end what the line goes on with (the time ahead by ``u``), or turn back: a wave whose slope over
        the runs is that of the line departs from it as computed here, in times by the slope. A wave that turns within
        the runs has no slope: what it falls by after the last run, at most to its other turn, is the half-width of a
        rectangular distribution, as the slope is. Both are of one wave and may add up, so they are added.
        """
        begins, ends = np.asarray(self.begins, dtype=np.float64), np.asarray(self.ends, dtype=np.float64)
        half, ahead = (ends - begins) / 2.0, np.maximum(np.asarray(times, dtype=np.float64) - ends, 0.0)
        w = 2.0 * np.pi / self.cycle
        # Slope of the least-squares line through sin(w t), from -half to half.
        slope = 3.0 * (np.sin(w * half) / w - half * np.cos(w * half)) / (w * half**3)
        turned = ahead - (np.sin(w * (half + ahead)) - np.sin(w * half)) / slope
        falls = self.bend * (np.cos(w * half) - np.cos(np.minimum(w * (half + ahead), np.pi)))
        falls = np.where(ahead > 0.0, np.maximum(falls, 0.0), 0.0) / np.sqrt(3.0)
        return np.asarray(self.u * np.maximum(ahead, turned) + falls)
