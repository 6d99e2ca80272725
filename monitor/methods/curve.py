"""The method ``curve``: one response over its inputs, a base model in one line, and the effects added to it.

Everything linear is solved for exactly at every step; periods, constants and places that are to be found from the
data are refined by Gauss-Newton on all unknowns together (variable projection gives the start: Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). Where neighbouring rows resemble each other the standard
uncertainties allow for it; the estimates stay those of ordinary least squares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import linalg

from monitor.effects.curve import (
    SEARCHED,
    CurveEffect,
    Inputs,
    coefficient_names,
    coefficient_unit,
    curve_columns,
    inputs_of,
    parse_base,
    parse_curve_effect,
)
from monitor.exceptions import DataError, EffectError
from monitor.methods.identification import Refusal
from monitor.methods.model import Model
from monitor.records import Array, CurveCampaign

NAME = "curve"
DEFAULT_MODEL = Model(NAME)
CONSTANT = "constant"
#: Singular values of the scaled design below this belong to coefficients that the rows cannot separate. The cubic
#: in a calendar year has 1e-9.
RANK_TOLERANCE = 1e-12
#: Share of a null vector from which on a coefficient counts as part of it.
MEMBER_SHARE = 1e-5
#: A residual below this share of the response's range is what sixteen digits and a period's search leave.
EXACT = 1e-9
MOST_ITERATIONS = 60
CONVERGED = 1e-13
#: A period is searched from twice the mean spacing to the whole range, three steps a resolvable period; a constant
#: from a fiftieth of the range to all of it; places where at least three rows lie on either side.
FREQUENCY_STEPS = 3.0
CONSTANTS = tuple(0.02 * 50.0 ** (step / 9.0) for step in range(10))
FEWEST_ON_A_SIDE = 3
SHORTEST_CONSTANT = 1.0
MOST_PLACES = 400


@dataclass(frozen=True)
class CurveProblem:
    """A curve under a model: rows with weight are those not ``left_out`` (n,)."""

    curve: CurveCampaign
    inputs: Inputs
    constant: bool
    base: tuple[CurveEffect, ...]
    added: tuple[CurveEffect, ...]
    left_out: npt.NDArray[np.bool_]

    @property
    def effects(self) -> tuple[CurveEffect, ...]:
        """Base and added."""
        return (*self.base, *self.added)

    @cached_property
    def order(self) -> npt.NDArray[np.int64]:
        """The rows that have weight, in the order in which they were measured."""
        kept = np.flatnonzero(~self.left_out)
        if self.curve.time is None:
            return kept
        return kept[np.argsort(self.inputs.numbers[self.curve.time][kept], kind="stable")]

    def with_effects(self, effects: Sequence[CurveEffect]) -> CurveProblem:
        """The problem with further effects."""
        return replace(self, added=(*self.added, *effects))

    def columns(self, effects: Sequence[CurveEffect]) -> tuple[tuple[str, ...], tuple[str, ...], Array]:
        """Names, units and columns (n, k) of the coefficients; lower powers come along, nothing comes twice."""
        unit = self.curve.units.get(self.curve.response, "")
        names, units, columns = [], [], []
        if self.constant:
            names, units, columns = [CONSTANT], [unit or "1"], [np.ones((len(self.curve), 1))]
        for effect in _with_lower_powers(effects):
            own = coefficient_names(effect, self.inputs)
            if own[0] in names:
                continue
            names += own
            units += [coefficient_unit(effect, self.inputs, unit)] * len(own)
            columns.append(curve_columns(effect, self.inputs))
        stacked = np.concatenate(columns, axis=1) if columns else np.zeros((len(self.curve), 0))
        return tuple(names), tuple(units), stacked


def _with_lower_powers(effects: Sequence[CurveEffect]) -> Iterator[CurveEffect]:
    for effect in effects:
        for power in range(1, effect.order):
            yield CurveEffect(effect.column, f"poly{power}")
        yield CurveEffect(effect.column, "poly1") if effect.shape == "drift" else effect


def problem_of(campaign: CurveCampaign, model: Model = DEFAULT_MODEL) -> CurveProblem:
    """The least-squares problem of a curve under a model. Raises EffectError for an effect that it does not have."""
    inputs = inputs_of(campaign)
    constant, base = parse_base(campaign.base, campaign.response, inputs)
    added = tuple(parse_curve_effect(text, inputs) for text in model.added)
    known = [effect.text for effect in base]
    for effect in added:
        if effect.text in known:
            raise EffectError(f"model {model.name} has {effect.text} already; name an effect once")
        known.append(effect.text)
    return CurveProblem(campaign, inputs, constant, base, added, np.zeros(len(campaign), dtype=bool))


def grid(effect: CurveEffect, inputs: Inputs) -> Array:
    """The values (g,) of a searched effect to look at; empty where the input takes too few values."""
    x = np.unique(inputs.numbers[effect.column])
    span = float(x[-1] - x[0])
    if len(x) < 2 * FEWEST_ON_A_SIDE + 2 or span == 0.0:
        return np.zeros(0)
    if effect.shape == "sin":
        count = int(FREQUENCY_STEPS * (len(x) - 1) / 2.0)
        return span / np.arange(FREQUENCY_STEPS, max(count, FREQUENCY_STEPS) + 1.0) * FREQUENCY_STEPS
    if effect.shape == "exp":
        # A constant shorter than the distance of the rows would follow single values of the input.
        constants = span * np.array(CONSTANTS)
        constants = constants[constants >= SHORTEST_CONSTANT * float(np.median(np.diff(x)))]
        return np.concatenate([constants, -constants])
    ordered = np.sort(inputs.numbers[effect.column])
    middles = (x[1:] + x[:-1]) / 2.0
    below = np.searchsorted(ordered, middles)
    inside = middles[(below >= FEWEST_ON_A_SIDE) & (len(ordered) - below >= FEWEST_ON_A_SIDE)]
    if len(inside) > MOST_PLACES:
        inside = inside[np.linspace(0, len(inside) - 1, MOST_PLACES).astype(int)]
    return inside


@dataclass(frozen=True)
class CurveFit:
    """A problem at its least-squares point.

    ``estimate`` (k,) and ``covariance`` (k, k) belong to ``names`` in ``units``, NaN where refused; ``values`` are
    the effects with their searched values at their best and ``u_values`` the standard uncertainties of these
    (NaN for a place). ``design`` (n, k + v) are the columns and the derivatives by the searched values,
    ``residual`` (n,) is measured less modelled, rows left out included. The covariance takes the scatter of the
    residual as the noise, rows independent.
    """

    problem: CurveProblem
    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    effects: tuple[CurveEffect, ...]
    u_values: tuple[float, ...]
    design: Array
    residual: Array
    rank: int
    degrees_of_freedom: int
    refused: tuple[Refusal, ...]
    iterations: int

    @property
    def sum_of_squares(self) -> float:
        """Of the residual of the rows that have weight."""
        return float(np.sum(self.residual[~self.problem.left_out] ** 2))

    @property
    def rms(self) -> float:
        """Root mean square of the residual."""
        return float(np.sqrt(self.sum_of_squares / np.sum(~self.problem.left_out)))

    @property
    def deviation(self) -> float:
        """Residual standard deviation: per degree of freedom."""
        return float(np.sqrt(self.sum_of_squares / self.degrees_of_freedom))

    @property
    def exact(self) -> bool:
        """Whether what is left is the rounding of numbers and no noise that says anything."""
        return self.rms < EXACT * float(np.ptp(self.problem.curve.measured[~self.problem.left_out]))

    @property
    def settled(self) -> CurveProblem:
        """The problem with every searched value at its best."""
        base = len(self.problem.base)
        return replace(self.problem, base=self.effects[:base], added=self.effects[base:])


def fit(problem: CurveProblem) -> CurveFit:
    """The least-squares point of a problem.

    Raises DataError where there are no more rows than unknowns, EffectError where a value cannot be searched.
    """
    kept = ~problem.left_out
    y = problem.curve.measured
    effects = list(problem.effects)
    for place, effect in enumerate(effects):
        if effect.free and effect.value is None:
            effects[place] = _searched(problem, effects, place)
    for place, effect in enumerate(effects):
        if effect.free and effect.shape == "step":
            effects[place] = _searched(problem, effects, place)
    free = [place for place, effect in enumerate(effects) if effect.free and effect.shape != "step"]
    iterations = 1
    if free:
        effects, iterations = _refined(problem, effects, free)
    names, units, columns = problem.columns(effects)
    estimate, rank, null = _solve(columns[kept], y[kept])
    slopes = [_slope(problem, names, estimate, effects[place]) for place in free]
    design = np.column_stack([columns, *slopes]) if slopes else columns
    freedom = int(kept.sum()) - rank - sum(effect.free for effect in effects)
    if freedom < 1:
        raise DataError(
            f"campaign {problem.curve.name} has {int(kept.sum())} rows for {len(names) + len(free)} unknowns; "
            "measure more, or leave an effect out"
        )
    residual = y - columns @ estimate
    variance = float(np.sum(residual[kept] ** 2)) / freedom
    inverse = inverse_normal(design[kept])
    covariance = variance * inverse
    u_values = []
    for effect in effects:
        if effect.free and effect.shape != "step":
            place = len(names) + free.index(effects.index(effect))
            u_values.append(float(np.sqrt(covariance[place, place])) * float(effect.value or 0.0) ** 2)
        else:
            u_values.append(float("nan"))
    member = np.abs(null).max(axis=0, initial=0.0) > MEMBER_SHARE
    refused: tuple[Refusal, ...] = ()
    if member.any():
        group = tuple(name for name, one in zip(names, member, strict=True) if one)
        refused = (
            Refusal(
                group, f"with these rows {' and '.join(group)} cannot be told apart; vary them separately"
            ),
        )
    size = len(names)
    return CurveFit(
        problem, names, units, np.where(member, np.nan, estimate),
        np.where(member[:, None] | member, np.nan, covariance[:size, :size]),
        tuple(effects), tuple(u_values), design, residual, rank, freedom, refused, iterations,
    )  # fmt: skip


def _solve(columns: Array, y: Array) -> tuple[Array, int, Array]:
    """Least-squares coefficients (k,), rank, and an orthonormal basis (m, k) of what the rows cannot separate, for
    columns scaled to unit length."""
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    u, values, vectors = linalg.svd(columns / scale, full_matrices=False)
    rank = int(np.sum(values > RANK_TOLERANCE * max(values.max(initial=0.0), 1e-300)))
    # QR keeps more digits than the normal equations, and so does a second step on what is left.
    if rank == columns.shape[1]:
        q, r = linalg.qr(columns / scale, mode="economic")
        found = linalg.solve_triangular(r, q.T @ y)
        found = found + linalg.solve_triangular(r, q.T @ (y - (columns / scale) @ found))
        return np.asarray(found / scale), rank, np.zeros((0, columns.shape[1]))
    found = vectors[:rank].T @ ((u[:, :rank].T @ y) / values[:rank])
    full = linalg.svd(columns / scale, full_matrices=True)[2]
    return np.asarray(found / scale), rank, np.asarray(full[rank:])


def inverse_normal(columns: Array) -> Array:
    """(X'X)^-1 of columns (n, k), by a pseudo-inverse of the scaled columns."""
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv(columns / scale, rcond=RANK_TOLERANCE)
    return np.asarray((inverse @ inverse.T) / np.outer(scale, scale))


def _slope(problem: CurveProblem, names: Sequence[str], estimate: Array, effect: CurveEffect) -> Array:
    """How the model (n,) moves with the inverse of an effect's searched value (a frequency or a rate)."""
    own = coefficient_names(effect, problem.inputs)
    size = estimate[[names.index(name) for name in own]]
    x = problem.inputs.numbers[effect.column]
    columns = curve_columns(effect, problem.inputs)
    if effect.shape == "sin":
        turned = np.column_stack([-columns[:, 1], columns[:, 0]]) * (2.0 * np.pi * x)[:, None]
        return np.asarray(turned @ size)
    assert effect.value is not None
    start = x.min() if effect.value > 0 else x.max()
    return np.asarray(-(x - start) * columns[:, 0] * size[0])


def _refined(
    problem: CurveProblem, effects: Sequence[CurveEffect], free: Sequence[int]
) -> tuple[list[CurveEffect], int]:
    """Effects with all searched values at the least-squares point, by Gauss-Newton with halved steps."""
    kept, y, now = ~problem.left_out, problem.curve.measured, list(effects)

    def state(at: Sequence[CurveEffect]) -> tuple[tuple[str, ...], Array, Array, Array]:
        names, _, columns = problem.columns(at)
        estimate, _, _ = _solve(columns[kept], y[kept])
        return names, columns, estimate, (y - columns @ estimate)[kept]

    low, high = np.array([_bounds(problem, now[place]) for place in free]).T
    names, columns, estimate, left = state(now)
    for iteration in range(1, MOST_ITERATIONS + 1):
        slopes = np.column_stack([_slope(problem, names, estimate, now[place]) for place in free])
        both = np.column_stack([columns, slopes])[kept]
        step = _solve(both, left)[0][columns.shape[1] :]
        rates = np.array([1.0 / float(now[place].value or 1.0) for place in free])
        for halving in range(30):
            trial = list(now)
            moved = np.clip(rates + step / 2.0**halving, low, high)
            for place, rate in zip(free, moved, strict=True):
                trial[place] = now[place].at(1.0 / float(rate))
            then = state(trial)
            if then[3] @ then[3] <= left @ left:
                break
        else:
            return now, iteration
        change = float(np.max(np.abs(moved / rates - 1.0)))
        now, (names, columns, estimate, left) = trial, then
        if change < CONVERGED:
            return now, iteration
    return now, MOST_ITERATIONS


def _bounds(problem: CurveProblem, effect: CurveEffect) -> tuple[float, float]:
    """How far the frequency or rate of a searched value may go from where it begins: half of what two periods have to
    differ by to be told apart, so that they do not run into each other; a factor of ten or a hundred for a constant."""
    rate = 1.0 / float(effect.value or 1.0)
    if effect.shape == "sin":
        # A cycle longer than the range is a bend, not a cycle.
        least = 1.0 / float(np.ptp(problem.inputs.numbers[effect.column]))
        return max(rate - 0.5 * least, min(least, rate)), rate + 0.5 * least
    return min(rate / 100.0, rate * 10.0), max(rate / 100.0, rate * 10.0)


def _searched(problem: CurveProblem, effects: Sequence[CurveEffect], place: int) -> CurveEffect:
    """The effect with the value of the grid that leaves least, the other effects fitted along."""
    effect = effects[place]
    values = grid(effect, problem.inputs)
    if effect.shape == "step" and effect.value is not None:
        values = np.append(values, effect.value)
    if len(values) == 0:
        raise EffectError(
            f"'{effect.text}': the {SEARCHED[effect.shape]} cannot be searched, {effect.column} takes too few "
            f"values; write it, such as {effect.column}:{effect.shape}12"
        )
    kept, y = ~problem.left_out, problem.curve.measured
    others = [one for other, one in enumerate(effects) if other != place and (one.value or not one.free)]
    _, _, nuisance = problem.columns(others)
    basis = linalg.orth(nuisance[kept] / np.maximum(np.linalg.norm(nuisance[kept], axis=0), 1e-300))
    left = y[kept] - basis @ (basis.T @ y[kept])
    best, least = effect.at(float(values[0])), np.inf
    for value in values:
        columns = curve_columns(effect, problem.inputs, float(value))[kept]
        columns = columns - basis @ (basis.T @ columns)
        found = np.linalg.lstsq(columns, left, rcond=1e-10)[0]
        rest = float(np.sum((left - columns @ found) ** 2))
        if rest < least:
            best, least = effect.at(float(value)), rest
    return best
