"""The drift of one parameter since its last change: the one line that the trend page and the health report state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.statistics import Trend
from monitor.statistics.days.block_lines import block_count, block_of
from monitor.statistics.days.seasonal_slopes import REFUTED
from monitor.statistics.trend import trend
from monitor.units import DAYS_PER_YEAR
from monitor.workflow.history.season import Season, SlopeVerdict
from monitor.workflow.history.series import Series

#: A slope a year is stated from so many days of history on. Over fewer, the scatter of a few days, multiplied by
#: fifty and more, is no statement about a year; and where days differ much among themselves the weighted slope
#: rests on the hours within the days, which a machine that warms up every morning fills with something else.
SHORTEST_DAYS = 30.0

#: The temperature of the days is fitted beside the line from so many blocks of days on, where it runs over so many
#: kelvin. Where it rises or falls with time, the interval of the slope grows: nothing tells the two apart. Of two
#: campaigns of five days, four blocks, one degree of freedom would be left, of what days of one campaign differ by.
DAYS_FOR_TEMPERATURE, LEAST_TEMPERATURE_RANGE = 6, 0.2


@dataclass(frozen=True, eq=False)
class PieceDrift:
    """The present piece of the steady runs ``whole``, since ``begins`` (days since 1970, -inf: all), and its line.

    ``event`` is the last recorded event that runs followed (-inf: none), at or before ``begins``.
    """

    whole: Series
    begins: float
    event: float = -np.inf

    @cached_property
    def piece(self) -> Series:
        """The steady runs since the last change or event."""
        return self.whole.part(self.whole.t >= self.begins)

    @cached_property
    def of_latest_day(self) -> npt.NDArray[np.bool_]:
        """Mask (n,) of the runs of the last day of ``whole``; of a day that the last event divides those after it."""
        since = self.whole.t >= self.event
        mask = np.zeros(len(since), dtype=np.bool_)
        mask[since] = self.whole.part(since).of_last_day
        return mask

    @cached_property
    def span(self) -> float:
        """Days from the first run of the piece to its last."""
        return float(np.ptp(self.piece.t)) if len(self.piece.t) else 0.0

    @cached_property
    def _fit(self) -> Trend | Lack:
        piece = self.piece
        if len(piece.t) and np.ptp(piece.values) == 0.0:
            return Lack(Part.DRIFT, Cause.SAME_VALUE, name=piece.name)
        try:
            return trend(
                piece.values,
                piece.t,
                u=piece.weights(),
                days=piece.days,
                cycle=DAYS_PER_YEAR,
                beside=self._beside,
                common=piece.common if piece.common_parts else None,
            )
        except DataError as error:
            return refused(Part.DRIFT, error)

    @cached_property
    def _beside(self) -> Array | None:
        """The temperature of the runs (n, 1), fitted beside the line; None where too few days or kelvins show it."""
        piece = self.piece
        degrees = piece.temperature
        if degrees is None or piece.day_count < DAYS_FOR_TEMPERATURE or not np.isfinite(degrees).all():
            return None
        index = np.unique(piece.days, return_inverse=True)[1]
        time, means = (np.bincount(index, column) / np.bincount(index) for column in (piece.t, degrees))
        if (
            len(np.unique(block_of(time, block_count(len(time)), time.min(), time.max())))
            < DAYS_FOR_TEMPERATURE
        ):
            return None
        return degrees[:, np.newaxis] if np.ptp(means) >= LEAST_TEMPERATURE_RANGE else None

    @property
    def thermometer(self) -> str | None:
        """The recorded temperature that is fitted beside the line; None where none is."""
        return None if self.line is None or self._beside is None else self.piece.thermometer

    @property
    def line(self) -> Trend | None:
        """The line through the piece, however short; None with fewer than three days."""
        return self._fit if isinstance(self._fit, Trend) else None

    @property
    def stated(self) -> Trend | None:
        """The line where the piece is long enough for a slope a year."""
        return self.line if self.span >= SHORTEST_DAYS else None

    @property
    def season(self) -> Season | None:
        """What the stated slope says of the year; None without one, or where a temperature stands beside the line."""
        line = self.stated
        if line is None or not (line.resemblance.cyclic or line.resemblance.seasonal):
            return None
        if line.season_p is not None and line.season_p >= REFUTED:
            return Season.NOT_TOLD
        return Season.ALLOWED_FOR

    @property
    def verdict(self) -> SlopeVerdict | None:
        """What the stated slope is; None where nothing is seen to move."""
        line = self.stated
        if line is None or not line.p_value < 1.0 - line.confidence:
            return None
        return SlopeVerdict.DRIFT_OR_SEASON if self.season is Season.NOT_TOLD else SlopeVerdict.DRIFT

    @property
    def why_not_stated(self) -> Lack | None:
        """Why no slope a year is stated; None where it is."""
        if self.span < SHORTEST_DAYS:
            days, split = max(round(self.span), 1), bool(np.isfinite(self.begins))
            return Lack(Part.DRIFT, Cause.TOO_SHORT, count=days, split=split, needed=(SHORTEST_DAYS,))
        return self._fit if isinstance(self._fit, Lack) else None
