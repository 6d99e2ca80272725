"""The residual against what drives a missing effect, before and after it is added, and over the workspace: what
the pictures of an explanation are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.discovery import Explanation, Fit
from monitor.effects import Basis, ChainEffect, ParsedEffect, parse_effect
from monitor.effects.context import REFERENCE_TEMPERATURE_DEGC
from monitor.effects.drivers import Channel, EachRun, LaggedTemperature, RunTime, Settling, WarmUp
from monitor.effects.shapes import Const, Cyclic, FormulaShape, Reversal, Sawtooth, WindUp
from monitor.exceptions import InputError
from monitor.records import Array
from monitor.reporting.figures import driver_names
from monitor.reporting.health.comparison import GroupMean, ResidualAgainst, ResidualMap
from monitor.units import COLUMN_UNITS, MICROMETRE, MINUTE
from monitor.workflow.explain.residuals import drivers_followed, in_machine_frame, mean_over_runs

#: Up to so many different values of a driver are groups of their own; of more, parts of equal width are made.
OWN_GROUPS, PARTS = 16, 10
#: Single points of a picture; more only blacken it.
POINTS = 240
#: Significant digits of what is only drawn.
DIGITS = 4


@dataclass(frozen=True)
class Against:
    """Residuals (n,) in µm along what an effect displaces, against what drives it (n,), before and after it is added.

    ``after`` is None where no fit has the effect. ``driver`` and ``along`` are text for people.
    """

    driver: str
    along: str
    at: Array
    before: Array
    after: Array | None

    @property
    def groups(self) -> npt.NDArray[np.int64]:
        """The group (n,) of each point: its value, or a part of the range."""
        return _groups(self.at)


def against_effect(explanation: Explanation, effect: str) -> Against | None:
    """The residual in the direction in which ``effect`` acts, against what drives it; of several that do (position,
    channel, their product) that which it follows most. None for an effect that cannot be drawn so.

    A positive residual is what the measurement calls for. Of a channel that also changes from run to run, only the
    change within the run acts, since balls and tip are free in every run: it is taken from its mean in the run.
    """
    fit = explanation.final
    fitted = _fitted(fit, effect)
    try:
        drawn = parse_effect(effect, fit.problem.context.chain) if fitted is None else fitted[0]
        basis = drawn.basis(fit.problem.context)
    except InputError:
        return None
    size = None if fitted is None else fitted[1]
    direction = _direction(fit, drawn, basis, size)
    length = np.linalg.norm(direction, axis=1)
    acts = ~fit.left_out & (length > 1e-9 * max(float(length.max()), 1e-300))
    if not acts.any():
        return None
    unit = direction[acts] / length[acts, None]
    um = -MICROMETRE.to_display(1.0)
    before = um * np.sum(explanation.comparison.vectors[acts] * unit, axis=1)
    after = None if size is None else um * np.sum(fit.vectors[acts] * unit, axis=1)
    columns = {name: values[acts] for name, values in _what_drives(fit, drawn).items()}
    if size is not None and (not columns or (isinstance(drawn, ChainEffect) and len(columns) > 1)):
        moved = np.sum(fit.moved_by(basis) * size, axis=2)[acts]
        columns[driver_names.predicted(effect)] = -um * np.sum(moved * unit, axis=1)
    driver = _most_followed(columns, before)
    if driver is None:
        return None
    along = drawn.term.symbol if isinstance(drawn, ChainEffect) else drawn.text
    return Against(driver, along, columns[driver], before, after)


def _fitted(fit: Fit, effect: str) -> tuple[ParsedEffect, Array] | None:
    """The added effect of that text and its coefficients (k,); None where the fit has none."""
    start = 0
    for added in fit.problem.added:
        size = added.basis(fit.problem.context).size
        if added.text == effect and isinstance(added, ParsedEffect):
            return added, fit.solution.common[start : start + size]
        start += size
    return None


def _direction(fit: Fit, effect: ParsedEffect, basis: Basis, size: Array | None) -> Array:
    """The displacement (n, d) along which an effect acts: that of its error motion, else that of its coefficients."""
    if isinstance(effect, ChainEffect):
        term = effect.term
        by_term = fit.by_error[:, :, term.joint, term.stage, term.component]
        return fit.problem.observe(by_term[:, :, None])[:, :, 0]
    displacement: Array = np.sum(fit.moved_by(basis) * (1.0 if size is None else size), axis=2)
    return displacement


def _what_drives(fit: Fit, effect: ParsedEffect) -> dict[str, Array]:
    """The columns (n,) that an effect names: its axis's position and its driver, each as people know it."""
    columns = _axis_columns(fit, effect) | _driver_columns(fit, effect)
    if isinstance(effect.driver, EachRun) or (not columns and isinstance(effect, ChainEffect)):
        columns["run"] = fit.problem.context.run.astype(np.float64)
    return columns


def _axis_columns(fit: Fit, effect: ParsedEffect) -> dict[str, Array]:
    """The position of the axis whose shape an effect follows."""
    if not isinstance(effect, ChainEffect) or isinstance(effect.shape, Const | FormulaShape):
        return {}
    context, joint = fit.problem.context, effect.joint
    reading = joint.sign * context.positions[:, effect.term.joint] * (180.0 / np.pi if joint.turns else 1.0)
    if isinstance(effect.shape, Reversal | WindUp):
        travel = joint.sign * context.travel[:, effect.term.joint]
        return {driver_names.last_travel(joint.name): travel}
    if isinstance(effect.shape, Cyclic | Sawtooth):
        pitch = effect.shape.pitch
        return {driver_names.within_pitch(joint.name, pitch): reading % pitch}
    return {driver_names.reading(joint.name, turns=joint.turns): reading}


def _driver_columns(fit: Fit, effect: ParsedEffect) -> dict[str, Array]:
    """What a driver reads: a channel, the time since the first start, the part of the run."""
    context, driver = fit.problem.context, effect.driver
    if isinstance(driver, Channel):
        unit = COLUMN_UNITS[driver.name.rpartition("_")[2]].name
        values = context.columns[driver.name]
        return {
            driver_names.channel(driver.name, unit): values,
            driver_names.channel_within_run(driver.name, unit): _within_run(context.run, values),
        }
    if isinstance(driver, LaggedTemperature):
        late = driver.columns(context, None)[:, 0] + REFERENCE_TEMPERATURE_DEGC
        return {
            driver_names.channel(driver.channel, "°C", late=True): late,
            driver_names.channel_within_run(driver.channel, "K", late=True): _within_run(context.run, late),
        }
    if isinstance(driver, WarmUp):
        warmth = driver.columns(context, None)[:, 0]
        return {
            driver_names.SINCE_DAY_BEGAN: context.day_time / MINUTE.factor,
            driver_names.WARM_UP_WITHIN_RUN: _within_run(context.run, warmth),
        }
    of_run = isinstance(driver, RunTime | Settling)
    return {driver_names.PART_OF_RUN: 100.0 * context.run_time} if of_run else {}


def _within_run(run: npt.NDArray[np.int64], values: Array) -> Array:
    _, index = np.unique(run, return_inverse=True)
    mean: Array = np.bincount(index, weights=values) / np.bincount(index)
    return values - mean[index]


def _groups(values: Array) -> npt.NDArray[np.int64]:
    distinct, group = np.unique(np.round(values, 6), return_inverse=True)
    if len(distinct) > OWN_GROUPS:
        low, high = np.quantile(values, [0.02, 0.98])
        cuts = np.linspace(low, high, PARTS + 1)[1:-1]
        group = np.unique(np.searchsorted(cuts, values, side="right"), return_inverse=True)[1]
    return np.asarray(group, dtype=np.int64)


def _most_followed(columns: Mapping[str, Array], residual: Array) -> str | None:
    """The column that a residual follows most; None where none varies."""
    varying = [
        name for name, x in columns.items() if np.isfinite(x).all() and np.ptp(x) > 1e-9 * np.abs(x).max()
    ]
    return max(varying, key=lambda name: _followed(columns[name], residual), default=None)


def _followed(driver: Array, residual: Array) -> float:
    """How much of the residual's sum of squares its means over the groups of a driver explain, beyond chance."""
    group = _groups(driver)
    count = np.bincount(group)
    means = np.bincount(group, weights=residual) / count
    return float(np.sum(count * means**2) - len(count) * np.var(residual))


def pictures_of(
    explanation: Explanation, effect: str | None
) -> tuple[ResidualMap | None, ResidualAgainst | None]:
    """What the pictures of an explanation show: the mean residual over the workspace, and the residual against what
    drives the missing ``effect``, or where none is named against what it follows most."""
    fit, vectors = explanation.final, explanation.comparison.vectors
    in_space = vectors.shape[1] == 3
    residual_map = None
    if in_space:
        positions, means = mean_over_runs(fit, *in_machine_frame(fit, vectors))
        residual_map = ResidualMap(_rounded_rows(positions), _rounded_rows(means))
    against = None if effect is None else against_effect(explanation, effect)
    if against is None and in_space:
        name, values, axis, residual = drivers_followed(fit)[0]
        against = Against(name.replace("_", " "), axis, values, residual, None)
    return residual_map, None if against is None else grouped(against)


def grouped(against: Against) -> ResidualAgainst:
    """State the means of the groups in the order of the driver, and some of the single points."""
    group = against.groups
    count = np.bincount(group)
    middle = _means(against.at, group)[0]
    before, u_before = _means(against.before, group)
    after, u_after = (None, None) if against.after is None else _means(against.after, group)
    shown = np.unique(np.linspace(0, len(group) - 1, min(POINTS, len(group))).astype(int))
    return ResidualAgainst(
        driver=against.driver,
        along=against.along,
        groups=tuple(
            GroupMean(
                n=int(count[index]),
                at=_number(middle[index]),
                before_um=_number(before[index]),
                u_before_um=_number(u_before[index]),
                after_um=None if after is None else _number(after[index]),
                u_after_um=None if u_after is None else _number(u_after[index]),
            )
            for index in np.argsort(middle)
        ),
        at=tuple(map(_number, against.at[shown])),
        before_um=tuple(map(_number, against.before[shown])),
    )


def _means(values: Array, group: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Means over the groups and their standard uncertainties (0 where a group has one point)."""
    count = np.bincount(group)
    means = np.bincount(group, weights=values) / count
    scatter = np.bincount(group, weights=(values - means[group]) ** 2)
    return means, np.sqrt(scatter / np.maximum(count - 1, 1) / count)


def _number(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _rounded_rows(rows: Array) -> tuple[tuple[float, float, float], ...]:
    return tuple((_number(x), _number(y), _number(z)) for x, y, z in rows)
