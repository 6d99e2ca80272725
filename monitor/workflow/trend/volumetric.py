"""When will the volumetric error leave its limit: the joint forecast of all parameters. Part of `monitor trend`.

The volumetric error is that of `monitor map`: the longest error vector over the strokes at the rotary poses of the
plan, the workpiece set to zero in the middle. Its vectors follow the parameters linearly to 1e-4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import timedelta

import numpy as np
import numpy.typing as npt

from monitor import statistics
from monitor.exceptions import DataError
from monitor.records import VOLUMETRIC, Array
from monitor.reporting.lacks import Cause, Lack, Part, refused
from monitor.reporting.origins import ForecastMethod
from monitor.statistics.trend import Trend, trend
from monitor.store import Database, MachineHistory, latest_maps, load_campaign
from monitor.units import DAYS_PER_YEAR, MICROMETRE
from monitor.workflow.history.calendar import date
from monitor.workflow.history.drift import PieceDrift
from monitor.workflow.history.forecast import crossing_dates, horizon_of, recommended
from monitor.workflow.history.series import Series
from monitor.workflow.trend.answer import VolumetricForecast, VolumetricTest

#: Times between the begin of the drifts and now at which the error is compared with its limit, for the day since when.
SINCE_STEPS = 400


@dataclass(frozen=True)
class LimitQuestion:
    """What is asked of the volumetric error: its limit in µm, the next ``check`` (days since 1970), the model."""

    limit_um: float | None
    check: float
    reliability: float
    model: str | None


@dataclass(frozen=True)
class _Extrapolated:
    """The parameters that take part: drift and line of each, over the times ``t`` (n,) and ``days`` (n,) of all."""

    drifts: Mapping[str, PieceDrift]
    lines: Mapping[str, Trend]
    t: Array
    days: npt.NDArray[np.int64]

    @property
    def span(self) -> float:
        """Days that the drifts were watched for, those that are held aside: of the shortest."""
        spans = [self.drifts[name].span for name in self.lines if self.drifts[name].stated is not None]
        return min(spans or [self.drifts[name].span for name in self.lines])

    def row_of(self, name: str) -> npt.NDArray[np.intp]:
        """Where the runs of a parameter stand among the times of all."""
        return np.searchsorted(self.t, self.drifts[name].piece.t)


@dataclass(frozen=True)
class _Vectors:
    """Error vectors at n points: ``at_zero`` (n, 3) and ``sensitivity`` (n, 3, p), in µm and per display unit.

    The points are those of the grid, ``points`` of them, that can have the longest vector.
    """

    names: tuple[str, ...]
    sensitivity: Array
    at_zero: Array
    left_out: tuple[str, ...]
    points: int


def _held(piece: Series) -> Trend:
    """A parameter without a drift: its mean since the last change, without slope; at least two runs.

    The runs of a day resemble each other: its level is known as well as the means of the days scatter, those of one day
    as a run of it.
    """
    n = len(piece.t)
    if n < 2:
        raise DataError(f"{piece.name} has one run since its last change")
    sd = float(piece.values.std(ddof=1))
    at = float(piece.t.mean())
    index = np.unique(piece.days, return_inverse=True)[1]
    means = np.bincount(index, piece.values) / np.bincount(index)
    count = len(means)
    level = sd if count == 1 else max(float(means.std(ddof=1)), sd / np.sqrt(n / count)) / np.sqrt(count)
    return Trend(
        at=at, level_at=float(piece.values.mean()), slope=0.0, u_slope=0.0, slope_interval=(0.0, 0.0),
        dof=float(max(count - 1, 1)), p_value=1.0, covariance=np.array([[level * level, 0.0], [0.0, 0.0]]), within=sd,
        between=0.0, run_sd=sd, n=n, days=count, confidence=0.95, robust_slope=0.0, robust_interval=None,
        monotone=None, common=np.column_stack([piece.common_of_mean, np.zeros(len(piece.common_parts))]),
    )  # fmt: skip


def _vectors(
    db: Database, history: MachineHistory, model: str | None, levels: Mapping[str, float]
) -> _Vectors | Lack:
    """The error vectors over the strokes of the latest campaign's machine about ``levels``, name to display value; why
    there are none where the method leaves the place of the tool open."""
    # Loaded here: pages without a limit of the volumetric error start without the methods and all that they need.
    from monitor.discovery import fit
    from monitor.effects import ChainEffect
    from monitor.uncertainty.geometric_errors import GeometricErrors
    from monitor.uncertainty.volumetric import grid, middle, volumetric_error
    from monitor.workflow.identify.fitting import machine_problem
    from monitor.workflow.models import resolve_for
    from monitor.workflow.volumetric.error_map import poses_of, ranges_of
    from monitor.workflow.volumetric.request import POINTS

    campaign = load_campaign(db, str(history.campaign[-1]))
    fitted = fit(machine_problem(campaign, resolve_for(db, model, campaign.method, campaign.machine.id)))
    problem, run = fitted.problem, int(history.run[-1])
    effects = [
        effect
        for effect in problem.base
        if isinstance(effect, ChainEffect)
        and all(name in levels for name in effect.parameters(problem.context))
    ]
    names = tuple(name for effect in effects for name in effect.parameters(problem.context))
    if not names:
        raise DataError("none of the parameters is an error of the machine's chain")
    if "tip x" not in problem.local_names:
        return Lack(Part.VOLUMETRIC_FORECAST, Cause.NO_TOOL_PLACE)
    tip = problem.local_names.index("tip x")
    unit_of = {name: effect.unit for effect in effects for name in effect.parameters(problem.context)}
    factors = np.array([unit_of[name].factor for name in names])
    estimate = np.array([levels[name] for name in names]) * factors
    errors = GeometricErrors(
        effects=tuple(effects), names=names, estimate=estimate, covariance=np.zeros((len(names), len(names))),
        context=problem.context, run=run,
        tip=fitted.solution.local[int(np.flatnonzero(problem.runs == run)[0]), tip : tip + 3],
    )  # fmt: skip
    ranges, _ = ranges_of(campaign, errors.chain)
    poses = poses_of(errors.chain, errors.context.positions)
    error = volumetric_error(errors, grid(errors.chain, ranges, POINTS, poses), middle(errors.chain, ranges))
    um = MICROMETRE.factor
    sensitivity = error.sensitivity * factors / um
    at_zero = (error.vectors - error.sensitivity @ estimate) / um
    # With axes that run straight only the corners of the strokes are left, of 343 points at each pose 8.
    long = max(float(error.lengths.max()) / um, 1.0)
    candidates = statistics.may_be_longest(sensitivity, at_zero, (len(poses), *[POINTS] * len(ranges)), long)
    return _Vectors(
        names,
        sensitivity[candidates],
        at_zero[candidates],
        tuple(sorted(set(levels) - set(names))),
        len(at_zero),
    )


def _together(drifts: Mapping[str, PieceDrift], lines: Mapping[str, Trend]) -> _Extrapolated:
    """The parameters with a line, over all times at which one of them was measured."""
    series = [drifts[name].whole for name in lines]
    t = np.unique(np.concatenate([steady.t for steady in series]))
    day_of = {at: day for steady in series for at, day in zip(steady.t, steady.days, strict=True)}
    return _Extrapolated(drifts, lines, t, np.array([day_of[at] for at in t], dtype=np.int64))


def _residuals(parameters: _Extrapolated) -> Array:
    """Value less line (n, p) of the runs, NaN where a parameter has none since its last change."""
    residuals = np.full((len(parameters.t), len(parameters.lines)), np.nan)
    for column, (name, line) in enumerate(parameters.lines.items()):
        piece = parameters.drifts[name].piece
        residuals[parameters.row_of(name), column] = piece.values - statistics.predict(line, piece.t)[0]
    return residuals


def _in_common(parameters: _Extrapolated) -> Array:
    """What levels and slopes of the p parameters are off together by (q, p, 2), for one standard uncertainty of each of
    q quantities."""
    of_each = [
        dict(zip(parameters.drifts[name].piece.common_parts, line.common, strict=True))
        for name, line in parameters.lines.items()
    ]
    quantities = dict.fromkeys(quantity for parts in of_each for quantity in parts)
    none = np.zeros(2)
    return np.array([[parts.get(quantity, none) for parts in of_each] for quantity in quantities])


def _backtest(
    parameters: _Extrapolated, vectors: _Vectors, rng: np.random.Generator
) -> tuple[VolumetricTest | None, Lack | None]:
    """Days since the last change foretold by those before them; a parameter that is held now was held then."""
    names, t, days = list(parameters.lines), parameters.t, parameters.days
    values, u = np.full((len(t), len(names)), np.nan), np.full((len(t), len(names)), np.nan)
    for column, name in enumerate(names):
        piece, rows = parameters.drifts[name].piece, parameters.row_of(name)
        values[rows, column], u[rows, column] = piece.values, piece.u
    weighed = [parameters.drifts[name].piece.weights() is not None for name in names]

    def fit(column: int, mask: npt.NDArray[np.bool_]) -> Trend:
        drift = parameters.drifts[names[column]]
        if drift.stated is None:
            return _held(drift.whole.part(np.isin(drift.whole.t, t[mask])))
        weights = u[mask, column] if weighed[column] else None
        return trend(
            values[mask, column], t[mask], u=weights, days=days[mask], cycle=DAYS_PER_YEAR, robust=False
        )

    try:
        series = statistics.JointSeries(values, t, days)
        test = statistics.backtest_longest(
            series, fit, statistics.ErrorVectors(vectors.sensitivity, vectors.at_zero), rng=rng
        )
    except DataError as error:
        return None, refused(Part.VOLUMETRIC_BACKTEST, error)
    return VolumetricTest(
        forecasts=test.forecasts, inside=test.covered, share_inside=test.coverage, level=test.level,
        bias_um=test.bias, rms_um=test.rms,
    ), None  # fmt: skip


def _beyond_since(
    parameters: _Extrapolated, vectors: _Vectors, limit: float, origin: float, offset: timedelta
) -> str | None:
    """Since when the drifts put the error beyond its limit without a break; None where it is not beyond it now."""
    begins = max(float(drift.piece.t[0]) for drift in parameters.drifts.values())
    times = np.linspace(min(begins, origin), origin, SINCE_STEPS)
    levels = np.column_stack(
        [line.level_at + line.slope * (times - line.at) for line in parameters.lines.values()]
    )
    inside = np.flatnonzero(
        statistics.ErrorVectors(vectors.sensitivity, vectors.at_zero).longest(levels) <= limit
    )
    if len(inside) and inside[-1] == len(times) - 1:
        return None
    return date(float(times[0 if not len(inside) else inside[-1] + 1]), offset)


def volumetric_forecast(
    db: Database,
    history: MachineHistory,
    drifts: Mapping[str, PieceDrift],
    question: LimitQuestion,
    rng: np.random.Generator,
) -> VolumetricForecast:
    """When the volumetric error reaches its limit, and how likely it is in tolerance at the next check.

    The limit is the asked one or that of the machine file (``volumetric`` among the tolerances). Where there is none,
    or no parameter drifts over long enough a history, ``why`` says so and nothing is computed.
    """
    limit = history.tolerances.get(VOLUMETRIC) if question.limit_um is None else question.limit_um
    offset = next(iter(drifts.values())).piece.offset
    none = VolumetricForecast(
        limit_um=limit, next_check=date(question.check, offset), method=ForecastMethod.ALL_PARAMETERS, why=None,
        mapped_um=None if limit is None else latest_maps(db, history.machine).get(history.machine),
    )  # fmt: skip
    if limit is None:
        return replace(none, why=Lack(Part.VOLUMETRIC_FORECAST, Cause.NO_LIMIT))
    if not any(drift.stated is not None for drift in drifts.values()):
        return replace(none, why=Lack(Part.VOLUMETRIC_FORECAST, Cause.NO_PARAMETER_DRIFTS))
    try:
        lines = {name: drift.stated or _held(drift.piece) for name, drift in drifts.items()}
        origin = max(float(drift.whole.t[-1]) for drift in drifts.values())
        levels = {name: float(statistics.predict(line, origin)[0]) for name, line in lines.items()}
        vectors = _vectors(db, history, question.model, levels)
    except DataError as error:
        return replace(none, why=refused(Part.VOLUMETRIC_FORECAST, error))
    if isinstance(vectors, Lack):
        return replace(none, why=vectors)
    parameters = _together(drifts, {name: lines[name] for name in vectors.names})
    correlation, shrunk, _ = statistics.residual_correlation(_residuals(parameters), parameters.days)
    ahead = statistics.forecast_longest(
        statistics.JointLines(list(parameters.lines.values()), correlation, _in_common(parameters)),
        statistics.ErrorVectors(vectors.sensitivity, vectors.at_zero),
        statistics.LengthQuestion(
            limit, origin, [max(question.check, origin)], horizon_of(origin), question.reliability
        ),
        rng=rng,
    )
    test, why_no_test = _backtest(parameters, vectors, rng)
    crosses_at, interval = crossing_dates(ahead.crossing, ahead.horizon, offset)
    return replace(
        none,
        latest_um=ahead.latest,
        beyond_since=_beyond_since(parameters, vectors, limit, origin, offset),
        crosses_limit_at=crosses_at,
        crosses_limit_interval=interval,
        predicted_um=float(ahead.predicted[0]),
        predicted_interval_um=tuple(ahead.interval[0].tolist()),
        in_tolerance_at_next_check=float(ahead.probability[0]),
        recommended_interval_days=recommended(ahead.recommended_interval, parameters.span),
        # Parameters without a drift stay where they are; those that are no error of the chain take no part.
        held=tuple(name for name in parameters.lines if drifts[name].stated is None),
        left_out=vectors.left_out,
        points=vectors.points,
        correlation_shrunk_by=shrunk,
        backtest=test,
        why_no_backtest=why_no_test,
    )
