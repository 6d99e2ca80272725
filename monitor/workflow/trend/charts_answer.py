"""What `monitor trend` answers of control charts. Times are ISO 8601 by the shop's clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import INLINED, OMITTED, WORDED
from monitor.reporting.lacks import Lack


@dataclass(frozen=True)
class ChartState:
    """A control chart after its reference period."""

    state: str
    alarms: int
    first_alarm_at: str | None
    last_alarm_at: str | None


@dataclass(frozen=True)
class ShewhartState(ChartState):
    """The chart of the points, with its limits."""

    lower: float
    upper: float


@dataclass(frozen=True)
class EwmaState(ChartState):
    """The chart of the exponentially weighted mean, with its limits at the latest point."""

    value: float
    lower: float
    upper: float
    weight: float


@dataclass(frozen=True)
class CusumState(ChartState):
    """The chart of the cumulated sums; ``since`` says when the sum that raised the alarm began."""

    high: float
    low: float
    limit: float
    since: str | None


@dataclass(frozen=True)
class VectorState(ChartState):
    """A chart of all parameters together; ``shares`` say which of them raise the latest point."""

    value: float
    limit: float
    average_run_length: float | None = field(default=None, metadata=OMITTED, kw_only=True)
    shares: Mapping[str, float]


@dataclass(frozen=True)
class ParameterCharts:
    """The charts of one parameter, or ``why`` there are none."""

    why: Lack | None = field(metadata=WORDED)
    centre: float | None = field(default=None, metadata=OMITTED)
    sd: float | None = field(default=None, metadata=OMITTED)
    shewhart: ShewhartState | None = field(default=None, metadata=OMITTED)
    ewma: EwmaState | None = field(default=None, metadata=OMITTED)
    cusum: CusumState | None = field(default=None, metadata=OMITTED)

    @property
    def alarms(self) -> list[str]:
        """The charts that raise an alarm at the latest point."""
        charts = {"shewhart": self.shewhart, "ewma": self.ewma, "cusum": self.cusum}
        return [name for name, chart in charts.items() if chart is not None and chart.state == "alarm"]


@dataclass(frozen=True)
class VectorCharts:
    """The charts of all parameters together, or ``why`` there are none."""

    why: Lack | None = field(metadata=WORDED)
    parameters: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    t_squared: VectorState | None = field(default=None, metadata=OMITTED)
    mewma: VectorState | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ReferencePeriod:
    """What the charts compare with: ``points`` are runs or days; a false alarm comes once in so many of them. Where
    several instruments measured, the charts are of the points ``measured_by`` one of them alone; of those of a named
    period, ``several_instruments``, they are of all."""

    points: str
    reference_points: int
    reference_from: str | None
    reference_to: str | None
    average_run_length: float
    measured_by: str | None = field(default=None, metadata=OMITTED)
    several_instruments: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ControlCharts:
    """The reference period of all charts, and those of the vector of all parameters."""

    period: ReferencePeriod = field(metadata=INLINED)
    vector: VectorCharts
