"""What `monitor trend` answers: ``TrendAnswer``. Its fields are the keys of its JSON document.

Times are ISO 8601 by the shop's clock. Where the runs do not suffice for a number it is None, and a field ``why``
beside it is the sentence that says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import INLINED, OMITTED, WORDED, Said, named
from monitor.reporting.confounding import Confounding
from monitor.reporting.lacks import Lack, Undecided
from monitor.reporting.weekly_notice import WeeklyNotices
from monitor.statistics.changes import DAYS_THAT_SHOW
from monitor.workflow.history.agreement import AgreementPair
from monitor.workflow.history.in_common import RestsOn
from monitor.workflow.history.other_instruments import OtherInstruments
from monitor.workflow.history.refuted import ContradictedStatement, ModelRefuted
from monitor.workflow.history.season import Season, SlopeVerdict
from monitor.workflow.trend.charts_answer import ControlCharts, ParameterCharts

#: Fewer days than this cannot tell a change from days that differ by much more than runs scatter.
FEW_DAYS = DAYS_THAT_SHOW
#: More degrees of freedom than this are not printed.
MOST_FREEDOMS = 1000
#: The ends of an interval of time; None where open.
Between = tuple[str | None, str | None]


@dataclass(frozen=True)
class RecordedEvent:
    """What people recorded of the machine; ``at`` by the clock of the shop, with its offset."""

    at: str
    kind: str
    description: str


@dataclass(frozen=True)
class DayResemblance:
    """Neighbouring blocks of days correlate by ``correlation`` as estimated, ``allowed_for`` with what that may be off.

    The interval of the slope is ``widening`` times as wide as with independent days; ``blocks`` are the blocks of
    days that it rests on.
    """

    correlation: float
    allowed_for: float
    widening: float
    blocks: int


@dataclass(frozen=True, kw_only=True)
class DriftStatement:
    """The slope a year of the present piece of history, since the last change or event.

    ``robust_slope_per_year`` by Theil and Sen, ``monotone_p`` by Mann and Kendall; ``between_days`` and
    ``within_days`` are standard deviations about the line. ``resemblance`` says how the slope's interval allows for
    days that resemble each other, ``season`` whether a wave of a year is allowed for, ``temperature`` names the
    recorded one that is fitted beside the line. ``p_value`` says whether the values move, ``season_p`` whether a yearly
    season of any size can be all of it (None: not asked), ``verdict`` what that comes to; where a season can, the
    interval of the slope holds it.
    """

    slope_per_year: float | None = None
    u_slope: float | None = None
    slope_interval: tuple[float, float] | None = None
    p_value: float | None = None
    robust_slope_per_year: float | None = None
    robust_interval: tuple[float, float] | None = None
    monotone_p: float | None = None
    autocorrelation: float | None = None
    between_days: float | None = None
    within_days: float | None = None
    resemblance: DayResemblance | None = None
    season: Season | None = None
    season_p: float | None = field(default=None, metadata=OMITTED)
    verdict: SlopeVerdict | None = field(default=None, metadata=OMITTED)
    temperature: str | None = field(default=None, metadata=OMITTED)
    since: str | None
    n: int
    days: int
    span_days: float
    why: Lack | None = field(metadata=WORDED)


@dataclass(frozen=True)
class LatestMean:
    """The mean of the last day's runs; its uncertainty, with degrees of freedom, by the scatter of runs within days and
    the calibrations that they rest on; of a single run as stated."""

    latest: float
    latest_u: float | None
    latest_runs: int
    latest_at: str | None
    latest_degrees_of_freedom: float | None = field(default=None, metadata=OMITTED)

    @property
    def few_degrees_of_freedom(self) -> int | None:
        """The degrees of freedom where they are few enough to say something: of more than some 1000 the factor of
        Student is that of infinitely many to three digits."""
        freedom = self.latest_degrees_of_freedom
        return None if freedom is None or freedom > MOST_FREEDOMS else int(freedom)


@dataclass(frozen=True)
class DatedChange:
    """A change of a parameter, between which times it lies, and its size; a slope is stated a day or a year.

    ``days`` is the number of days that were searched. ``kind`` is ``step`` or ``slope``; of drifts ``trend``, or
    ``transient``: off by ``size`` at the first run, it settles with ``time_constant_days``.
    ``p_at_most``: none of the simulated histories was like it, so that ``p_value`` is the smallest that they can say.
    It is of one parameter, and stated where it is below the share of ``false_alarm`` that each of the machine's
    parameters has, whether one is asked for or all. ``between_instruments``: other instruments measure from a step on.
    ``one_day``: a step after which there is one day alone, which cannot show whether it stays.
    """

    at: str | None
    interval: Between
    kind: str
    size: float
    u: float
    unit: str
    p_value: float
    days: int
    time_constant_days: float | None = field(default=None, metadata=OMITTED)
    p_at_most: bool | None = field(default=None, metadata=OMITTED)
    between_instruments: OtherInstruments | None = field(default=None, metadata=OMITTED)
    one_day: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class StepAtEvent:
    """What a parameter stepped by at a recorded event, the mean after it less the mean before; ``at`` by the clock of
    the shop, with its offset.

    ``scatter_of`` says by what the uncertainty is: ``days``; or ``runs`` where no two days say how days differ, and
    then it is not ``decided`` whether it is a step, nor where days that follow each other explain it, nor where one or
    two days on a side say too little, or a drift may do as much: ``why_not_decided`` says which. A step on a machine
    that is seen to drift is what is beyond ``drift_in_30_days``.
    """

    at: str
    kind: str
    description: str
    size: float
    u: float
    unit: str
    p_value: float
    scatter_of: str
    decided: bool
    why_not_decided: Undecided | None = field(default=None, metadata={**WORDED, **OMITTED})
    drift_in_30_days: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ConditionEffect:
    """How a parameter goes with a recorded condition, which ran ``from_`` a value ``to`` another.

    ``moves_with`` names conditions (or ``time``) that cannot be told apart from it; ``q_value`` is the false discovery
    rate over the conditions of all parameters. Beside several instruments it is what goes with the condition within
    each; where that cannot be told, ``not_decided`` says why, and the numbers are without the instruments. Where days
    and the runs within them contradict each other beyond chance, ``coefficient`` is that from day to day,
    ``within_days`` the other one (else None), and ``p_value`` that of one coefficient for both, or twice that from day
    to day where this is less.
    """

    channel: str
    coefficient: float
    u: float
    interval: tuple[float, float]
    unit: str
    p_value: float | None
    n: int
    from_: float = field(metadata=named("from"))
    to: float
    moves_with: tuple[str, ...]
    q_value: float | None
    not_decided: Confounding | None = field(default=None, metadata={**WORDED, **OMITTED})
    within_days: float | None = field(default=None, metadata=OMITTED)
    u_within_days: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class Cycle:
    """A wave of a day or a year; ``q_value`` is the false discovery rate over the cycles of all parameters, and
    ``not_decided`` as of a condition."""

    cycle: str
    period_days: float
    amplitude: float
    u: float
    unit: str
    peak_at: str | None
    p_value: float | None
    q_value: float | None
    not_decided: Confounding | None = field(default=None, metadata={**WORDED, **OMITTED})


@dataclass(frozen=True)
class WarmUp:
    """The warm-up of the days that a campaign began cold or hot: its time constant, and when the machine is stable.

    ``amplitude`` is by how much the first run of a day lies above what it comes to within the hours recorded;
    ``tau_h`` None where a line does as well as any curve; ``q_value`` the false discovery rate over all parameters.
    """

    campaign: str
    amplitude: float
    u: float
    unit: str
    tau_h: float | None
    tau_interval_h: tuple[float | None, float | None]
    stable_after_h: float | None
    stable_interval_h: tuple[float | None, float | None]
    stable_within: float
    p_value: float
    q_value: float | None = None
    recorded_h: float | None = None


@dataclass(frozen=True)
class ForecastStart:
    """Where the line that is extrapolated stands at the last run: ``value``, at ``temperature`` in °C.

    That is the mean of its runs, of the thermometer that is fitted beside it; ``by_temperature`` is what the latest
    mean lies off the line because its runs had another. ``from_latest_at`` is when the limit is reached from the latest
    mean on by the same slope: None where it lies beyond already, or the slope leads away from it.
    """

    value: float
    from_latest_at: str | None
    temperature: float | None = field(default=None, metadata=OMITTED)
    latest_temperature: float | None = field(default=None, metadata=OMITTED)
    by_temperature: float | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class LimitForecast:
    """When the drift reaches the limit, and how likely the parameter is in tolerance at the next check.

    ``beyond_since`` is the first of the runs without a break that are beyond the limit, where the last one is: then it
    is not reached any more, and ``crosses_limit_at`` is None.
    ``start`` says from where, where a day is stated.
    """

    limit: float | None
    crosses_limit_at: str | None
    crosses_limit_interval: Between | None
    in_tolerance_at_next_check: float | None
    next_check: str | None
    recommended_interval_days: float | None
    recommended_by: str | None
    why_no_forecast: Lack | None = field(metadata=WORDED)
    beyond_since: str | None = field(default=None, metadata=OMITTED)
    start: ForecastStart | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class ForecastTest:
    """How good the forecasts of a parameter were: ``inside`` of the ``forecasts`` lay in their interval."""

    forecasts: int = field(metadata=named("made"))
    inside: int
    share_inside: float
    level: float
    bias: float
    rms: float
    unit: str
    method: str


@dataclass(frozen=True)
class ParameterTrend:
    """The long view of one parameter. Runs since its last change are off together by what they ``rests_on``: levels,
    forecasts and slopes have the share of these runs, which of a slope is none where all rest on one calibration."""

    unit: str
    drift: DriftStatement = field(metadata=INLINED)
    mean: LatestMean = field(metadata=INLINED)
    changes: tuple[DatedChange, ...]
    drifts: tuple[DatedChange, ...]
    why_no_changes: Lack | None = field(metadata=WORDED)
    conditions: tuple[ConditionEffect, ...]
    why_no_conditions: Lack | None = field(metadata=WORDED)
    cycles: tuple[Cycle, ...]
    why_no_cycles: Lack | None = field(metadata=WORDED)
    warm_up: WarmUp | None
    why_no_warm_up: Lack | None = field(metadata=WORDED)
    forecast: LimitForecast = field(metadata=INLINED)
    backtest: ForecastTest | None
    why_no_backtest: Lack | None = field(metadata=WORDED)
    control: ParameterCharts
    q_value: float | None
    event_steps: tuple[StepAtEvent, ...] = ()
    rests_on: tuple[RestsOn, ...] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class VolumetricTest:
    """How good the forecasts of the volumetric error were."""

    forecasts: int = field(metadata=named("made"))
    inside: int
    share_inside: float
    level: float
    bias_um: float
    rms_um: float


@dataclass(frozen=True, kw_only=True)
class VolumetricForecast:
    """When the volumetric error reaches its limit; ``why`` says why that is not forecast.

    ``held`` parameters have no drift and stay where they are; those ``left_out`` are no error of the chain. An error
    that is beyond its limit already is so since ``beyond_since``, by the same drifts; by then at the latest, where
    they begin. ``mapped_um`` is the worst error of the last map stored, which the fleet judges.
    """

    limit_um: float | None
    latest_um: float | None = None
    crosses_limit_at: str | None = None
    crosses_limit_interval: Between | None = None
    next_check: str | None
    predicted_um: float | None = None
    predicted_interval_um: tuple[float, float] | None = None
    in_tolerance_at_next_check: float | None = None
    recommended_interval_days: float | None = None
    held: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    correlation_shrunk_by: float | None = None
    method: str
    backtest: VolumetricTest | None = None
    why_no_backtest: Lack | None = field(default=None, metadata=WORDED)
    points: int | None = field(default=None, metadata=OMITTED)
    beyond_since: str | None = field(default=None, metadata=OMITTED)
    mapped_um: float | None = field(default=None, metadata=OMITTED)
    why: Lack | None = field(metadata=WORDED)


@dataclass(frozen=True, kw_only=True)
class TrendAnswer:
    """The long view of a machine; ``why`` says why there are no parameters.

    ``false_alarm`` is the probability of any change where there is none, ``seed`` that of everything simulated;
    ``refers_to`` says in words what the parameters are relative to, those that are errors of the chain.
    ``model_refuted``: campaigns whose readings refute the model that the values come from; None where none does, or
    where an older version identified them and nothing is known. ``statement_contradicted``: the last run, where its
    residuals are many times what is stated. ``copied_readings`` says which campaigns hold runs of others, of this
    machine or another: no part of what is stored.
    """

    machine: str
    since: str | None
    runs: int
    campaigns: tuple[str, ...]
    methods: tuple[str, ...]
    agreement: tuple[AgreementPair, ...]
    events: tuple[RecordedEvent, ...]
    notes: tuple[str, ...]
    false_alarm: float
    seed: int
    why: str | None
    next_check: str | None = field(default=None, metadata=OMITTED)
    control: ControlCharts | None = field(default=None, metadata=OMITTED)
    parameters: Mapping[str, ParameterTrend]
    volumetric_error: VolumetricForecast | None = field(default=None, metadata=OMITTED)
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    weekly_looks: WeeklyNotices | None = field(default=None, metadata=OMITTED)
    refers_to: Mapping[str, str] = field(default_factory=dict)
    model_refuted: ModelRefuted | None = field(default=None, metadata=OMITTED)
    statement_contradicted: ContradictedStatement | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)
