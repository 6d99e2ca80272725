"""Times of a history: days since 1970 in the statistics, dates by the shop's clock for people."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np

SECONDS_PER_DAY = 86400.0
_EPOCH = datetime(1970, 1, 1)


def days_since_1970(moment: datetime) -> float:
    """A moment with its offset from UTC as days since 1970."""
    return moment.timestamp() / SECONDS_PER_DAY


def local_time(t: float, offset: timedelta) -> datetime | None:
    """A time in days since 1970 by the shop's clock, without a zone; None where it is beyond any calendar."""
    if not np.isfinite(t):
        return None
    try:
        return _EPOCH + timedelta(days=float(t)) + offset
    except OverflowError:
        return None


def date(t: float, offset: timedelta) -> str | None:
    """A time in days since 1970 as ISO 8601 by the shop's clock; None where it is beyond any calendar."""
    moment = local_time(t, offset)
    if moment is None:
        return None
    sign = "-" if offset < timedelta() else "+"
    minutes = abs(int(offset.total_seconds())) // 60
    return f"{moment.isoformat(timespec='seconds')}{sign}{minutes // 60:02d}:{minutes % 60:02d}"
