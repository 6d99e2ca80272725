"""The least-squares fit of a curve: one response over its inputs, a base model in one line, and added effects.

Everything linear is solved for exactly at every step; periods, constants and places that are to be estimated from the
data are refined by Gauss-Newton on all unknowns together (variable projection gives the start: Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). Where neighbouring rows resemble each other the standard
uncertainties allow for it; the estimates stay those of ordinary least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.effects.curve import PLACED, CurveEffect
from monitor.exceptions import DataError
from monitor.methods.curve.problem import CurveProblem
from monitor.methods.curve.solver import inverse_normal, refined, searched, slope, solve
from monitor.records import Array
from monitor.refusal import Reason, ReasonKind, Refusal

#: Share of a null vector from which on a coefficient counts as part of it.
MEMBER_SHARE = 1e-5
#: A residual below this share of the response's range is what sixteen digits and a period's search leave.
EXACT = 1e-9


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
        """Whether the residual is the rounding of numbers rather than noise."""
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
    weighted = ~problem.left_out
    y = problem.curve.measured
    effects = _started(problem)
    free = [index for index, effect in enumerate(effects) if effect.free and effect.shape not in PLACED]
    iterations = 1
    if free:
        effects, iterations = refined(problem, effects, free)
    names, units, columns = problem.columns(effects)
    estimate, rank, null = solve(columns[weighted], y[weighted])
    slopes = [slope(problem, names, estimate, effects[index]) for index in free]
    design = np.column_stack([columns, *slopes]) if slopes else columns
    freedom = int(weighted.sum()) - rank - sum(effect.free for effect in effects)
    if freedom < 1:
        raise DataError(
            f"campaign {problem.curve.name} has {int(weighted.sum())} rows for {len(names) + len(free)} unknowns; "
            "measure more, or leave an effect out"
        )
    residual = y - columns @ estimate
    variance = float(np.sum(residual[weighted] ** 2)) / freedom
    covariance = variance * inverse_normal(design[weighted])
    member = np.abs(null).max(axis=0, initial=0.0) > MEMBER_SHARE
    size = len(names)
    return CurveFit(
        problem=problem,
        names=names,
        units=units,
        estimate=np.where(member, np.nan, estimate),
        covariance=np.where(member[:, None] | member, np.nan, covariance[:size, :size]),
        effects=tuple(effects),
        u_values=_u_values(effects, free, np.sqrt(np.diag(covariance)[size:])),
        design=design,
        residual=residual,
        rank=rank,
        degrees_of_freedom=freedom,
        refused=_refused([name for name, inside in zip(names, member, strict=True) if inside]),
        iterations=iterations,
    )


def _started(problem: CurveProblem) -> list[CurveEffect]:
    """The effects with every searched value at its best of the grid, steps and knees last, beside all others."""
    effects = list(problem.effects)
    for index, effect in enumerate(effects):
        if effect.free and effect.value is None:
            effects[index] = searched(problem, effects, index)
    for index, effect in enumerate(effects):
        if effect.free and effect.shape in PLACED:
            effects[index] = searched(problem, effects, index)
    return effects


def _u_values(effects: Sequence[CurveEffect], free: Sequence[int], u_rates: Array) -> tuple[float, ...]:
    """Standard uncertainties of the searched values from those of their inverses, NaN where nothing was refined."""
    u_of = dict(zip(free, u_rates, strict=True))
    return tuple(
        float(u_of[index]) * float(effect.value or 0.0) ** 2 if index in u_of else float("nan")
        for index, effect in enumerate(effects)
    )


def _refused(names: Sequence[str]) -> tuple[Refusal, ...]:
    return (Refusal(tuple(names), Reason(ReasonKind.ROWS_ALIKE)),) if names else ()
