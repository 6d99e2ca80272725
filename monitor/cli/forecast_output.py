"""What `monitor trend` says of the level from which a limit is foretold."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta

from monitor.workflow.trend.answer import ParameterTrend

#: Share of the time until the limit, and days, by which two dates have to differ to be told.
_LEAST_APART, _LEAST_DAYS = 0.25, timedelta(days=1)


def forecast_start(name: str, parameter: ParameterTrend) -> Iterator[str]:
    """Yield from where the day at the limit is counted, where the latest mean comes to the limit on quite another.

    Otherwise the row of the table contradicts itself: latest mean, slope, limit and day.
    """
    start, at, last = parameter.forecast.start, parameter.forecast.crosses_limit_at, parameter.mean.latest_at
    if start is None or at is None or last is None or start.from_latest_at is None:
        return
    ahead, alone = (
        datetime.fromisoformat(day) - datetime.fromisoformat(last) for day in (at, start.from_latest_at)
    )
    if abs(ahead - alone) <= max(_LEAST_APART * max(ahead, alone), _LEAST_DAYS):
        return
    unit, by = parameter.unit, ""
    if start.temperature is not None and start.by_temperature is not None:
        by = (
            f" at {start.temperature:.1f} °C, the mean of its runs ({start.by_temperature:.2g} {unit} of the "
            f"difference go with the {start.latest_temperature:.1f} °C of the latest)"
        )
    yield (
        f"{name}: the day at the limit is counted from {start.value:.3g} {unit}, where the line through all days "
        f"stands at the last run{by}; by the same slope the latest mean, {parameter.mean.latest:.3g} {unit}, comes "
        f"to it on {start.from_latest_at[:10]}"
    )
