"""When will the volumetric error leave its limit: the joint forecast of all parameters. Part of `monitor trend`.

The volumetric error is that of `monitor map`: the longest error vector over the strokes at the rotary poses of the
plan, the workpiece set to zero in the middle. Its vectors follow the parameters linearly to 1e-4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from monitor.exceptions import DataError
from monitor.records import Array
from monitor.statistics import (
    Trend,
    backtest_longest,
    forecast_longest,
    may_be_longest,
    predict,
    residual_correlation,
    trend,
)
from monitor.store import Database, MachineHistory, load_campaign
from monitor.units import MICROMETRE
from monitor.workflow.trend.forecast import HORIZON_YEARS
from monitor.workflow.trend.parameter import DAYS_PER_YEAR, Series, date

Document = dict[str, Any]

#: The tolerance of the machine file that is no parameter's.
VOLUMETRIC = "volumetric"
METHOD = (
    "all parameters extrapolated together, each by its drift since its last change, correlated as the days are; "
    "simulated"
)


class Followed(NamedTuple):
    """A parameter with its steady runs, the beginning of the present piece (days since 1970), and its line."""

    series: Series
    begins: float
    line: Trend | None


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


def _held(series: Series, begins: float) -> Trend:
    """A parameter without a drift: its mean since the last change, without slope; at least two runs."""
    piece = series.part(series.t >= begins)
    n = len(piece.t)
    if n < 2:
        raise DataError(f"{series.name} has one run since its last change")
    sd = float(piece.values.std(ddof=1))
    at = float(piece.t.mean())
    return Trend(
        at=at, level_at=float(piece.values.mean()), slope=0.0, u_slope=0.0, slope_interval=(0.0, 0.0),
        dof=float(n - 1), p_value=1.0, covariance=np.array([[sd * sd / n, 0.0], [0.0, 0.0]]), within=sd, between=0.0,
        run_sd=sd, n=n, days=len(np.unique(piece.days)), confidence=0.95, robust_slope=0.0, robust_interval=None,
        monotone=None,
    )  # fmt: skip


def _vectors(
    db: Database, history: MachineHistory, model: str | None, levels: Mapping[str, float]
) -> _Vectors:
    """The error vectors over the strokes of the latest campaign's machine about ``levels``, name to display value."""
    # Loaded here: pages without a limit of the volumetric error start without the methods and all that they need.
    from monitor.discovery import fit
    from monitor.effects import ChainEffect
    from monitor.uncertainty.volumetric import GeometricErrors, grid, middle, volumetric_error
    from monitor.workflow.identify.fitting import machine_problem
    from monitor.workflow.models import resolve
    from monitor.workflow.volumetric.error_map import poses_of, ranges_of
    from monitor.workflow.volumetric.request import POINTS

    campaign = load_campaign(db, str(history.campaign[-1]))
    found = fit(machine_problem(campaign, resolve(db, model, campaign.method)))
    problem, run = found.problem, int(history.run[-1])
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
        raise DataError("the method does not find the place of the tool")
    tip = problem.local_names.index("tip x")
    unit_of = {name: effect.unit for effect in effects for name in effect.parameters(problem.context)}
    factors = np.array([unit_of[name].factor for name in names])
    estimate = np.array([levels[name] for name in names]) * factors
    known = GeometricErrors(
        effects=tuple(effects), names=names, estimate=estimate, covariance=np.zeros((len(names), len(names))),
        context=problem.context, run=run,
        tip=found.solution.local[int(np.flatnonzero(problem.runs == run)[0]), tip : tip + 3],
    )  # fmt: skip
    ranges, _ = ranges_of(campaign, known.chain)
    poses = poses_of(known.chain, known.context.positions)
    error = volumetric_error(known, grid(known.chain, ranges, POINTS, poses), middle(known.chain, ranges))
    um = MICROMETRE.factor
    sensitivity = error.sensitivity * factors / um
    at_zero = (error.vectors - error.sensitivity @ estimate) / um
    # With axes that run straight only the corners of the strokes are left, of 343 points at each pose 8.
    long = max(float(error.lengths.max()) / um, 1.0)
    kept = may_be_longest(sensitivity, at_zero, (len(poses), *[POINTS] * len(ranges)), long)
    return _Vectors(
        names, sensitivity[kept], at_zero[kept], tuple(sorted(set(levels) - set(names))), len(at_zero)
    )


def _residuals(lines: Mapping[str, Trend], followed: Mapping[str, Followed], t: Array) -> Array:
    """Value less line (n, p) of the runs that began at ``t`` (n,), NaN where a parameter has none since its change."""
    found = np.full((len(t), len(lines)), np.nan)
    for column, (name, line) in enumerate(lines.items()):
        piece = followed[name].series.part(followed[name].series.t >= followed[name].begins)
        place = np.searchsorted(t, piece.t)
        found[place, column] = piece.values - predict(line, piece.t)[0]
    return found


def _backtest(
    lines: Mapping[str, Trend],
    followed: Mapping[str, Followed],
    t: Array,
    days: npt.NDArray[np.int64],
    vectors: _Vectors,
    rng: np.random.Generator,
) -> tuple[Document | None, str | None]:
    """Days since the last change foretold by those before them; a parameter that is held now was held then."""
    names = list(lines)
    values, u = np.full((len(t), len(names)), np.nan), np.full((len(t), len(names)), np.nan)
    weighed = []
    for column, name in enumerate(names):
        piece = followed[name].series.part(followed[name].series.t >= followed[name].begins)
        place = np.searchsorted(t, piece.t)
        values[place, column], u[place, column] = piece.values, piece.u
        weighed.append(piece.weights() is not None)

    def fit(column: int, keep: npt.NDArray[np.bool_]) -> Trend:
        one = followed[names[column]]
        if one.line is None:
            own = one.series.part(np.isin(one.series.t, t[keep]))
            return _held(own, -np.inf)
        own_u = u[keep, column] if weighed[column] else None
        return trend(values[keep, column], t[keep], u=own_u, days=days[keep], robust=False)

    try:
        found = backtest_longest(values, t, days, fit, vectors.sensitivity, vectors.at_zero, rng=rng)
    except DataError as error:
        return None, f"no backtest of the volumetric error: {error}"
    return {
        "made": found.made, "inside": found.covered, "share_inside": found.coverage, "level": found.level,
        "bias_um": found.bias, "rms_um": found.rms,
    }, None  # fmt: skip


def volumetric_forecast(
    db: Database,
    history: MachineHistory,
    followed: Mapping[str, Followed],
    check: float,
    *,
    model: str | None,
    limit_um: float | None,
    reliability: float,
    rng: np.random.Generator,
    offset: timedelta,
) -> Document:
    """When the volumetric error reaches its limit, and how likely it is in tolerance at the next ``check`` (days).

    The limit is ``limit_um`` or that of the machine file (``volumetric`` among the tolerances). Where there is none,
    or no parameter drifts over long enough a history, ``why`` says so and nothing is computed.
    """
    limit = history.tolerances.get(VOLUMETRIC) if limit_um is None else limit_um
    empty: Document = {
        "limit_um": limit, "latest_um": None, "crosses_limit_at": None, "crosses_limit_interval": None,
        "next_check": date(check, offset), "predicted_um": None, "predicted_interval_um": None,
        "in_tolerance_at_next_check": None, "recommended_interval_days": None, "held": [], "left_out": [],
        "correlation_shrunk_by": None, "method": METHOD, "backtest": None, "why_no_backtest": None,
    }  # fmt: skip
    if limit is None:
        why = (
            "no forecast of the volumetric error: no limit is stated (volumetric in the machine's tolerances)"
        )
        return {**empty, "why": why}
    if not any(one.line is not None for one in followed.values()):
        return {
            **empty,
            "why": "no forecast of the volumetric error: no parameter has a drift to extrapolate",
        }
    try:
        lines = {name: one.line or _held(one.series, one.begins) for name, one in followed.items()}
        now = max(float(one.series.t[-1]) for one in followed.values())
        levels = {name: float(predict(line, now)[0]) for name, line in lines.items()}
        vectors = _vectors(db, history, model, levels)
    except DataError as error:
        return {**empty, "why": f"no forecast of the volumetric error: {error}"}
    kept = {name: lines[name] for name in vectors.names}
    t = np.unique(np.concatenate([followed[name].series.t for name in kept]))
    day_of = dict(
        pair
        for name in kept
        for pair in zip(followed[name].series.t, followed[name].series.days, strict=True)
    )
    days = np.array([day_of[at] for at in t], dtype=np.int64)
    correlation, shrunk, _ = residual_correlation(_residuals(kept, followed, t), days)
    horizon = now + HORIZON_YEARS * DAYS_PER_YEAR
    found = forecast_longest(
        list(kept.values()), correlation, vectors.sensitivity, vectors.at_zero, limit, now, [max(check, now)],
        rng=rng, reliability=reliability, horizon=horizon,
    )  # fmt: skip
    tested, why_untested = _backtest(kept, followed, t, days, vectors, rng)
    low, high = (date(x, offset) if x < horizon else None for x in found.crossing.interval)
    return {
        **empty,
        "latest_um": found.latest,
        "crosses_limit_at": None if found.crossing.at is None else date(found.crossing.at, offset),
        "crosses_limit_interval": None if low is None and high is None else [low, high],
        "predicted_um": float(found.predicted[0]),
        "predicted_interval_um": found.interval[0].tolist(),
        "in_tolerance_at_next_check": float(found.probability[0]),
        "recommended_interval_days": float(min(found.recommended_interval, horizon - now)),
        # Parameters without a drift stay where they are; those that are no error of the chain take no part.
        "held": [name for name in kept if followed[name].line is None],
        "left_out": list(vectors.left_out),
        "points": vectors.points,
        "correlation_shrunk_by": shrunk,
        "backtest": tested,
        "why_no_backtest": why_untested,
        "why": None,
    }
