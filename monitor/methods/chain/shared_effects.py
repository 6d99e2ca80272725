"""The parameters that all runs of a campaign share, as they are reported: with numbers, or refused with the reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects import Basis, ChainEffect, Effect
from monitor.effects.effect import ChainBasis
from monitor.methods.chain.least_squares import Solution
from monitor.methods.chain.problem import ChainProblem
from monitor.records import Array
from monitor.refusal import Reason, ReasonKind, Refusal
from monitor.units import MINUTE, Unit


@dataclass(frozen=True)
class SharedParameters:
    """``estimate`` (c,) and ``covariance`` (c, c) in internal units, NaN where refused; time constants in s."""

    names: tuple[str, ...]
    units: tuple[Unit, ...]
    estimate: Array
    covariance: Array
    refused: tuple[Refusal, ...]


def largest_coefficient(effect: Effect, basis: Basis, peak: float, largest: tuple[float, float]) -> float:
    """The size of the coefficients that a machine in use is likely to have at most, in internal units.

    ``largest`` is the displacement in mm and the angle in rad of the largest effect;
    ``peak`` mm is the largest displacement that a unit of any coefficient causes at any probing.
    """
    if peak == 0.0:
        return 0.0
    limit = largest[0] / peak
    if isinstance(effect, ChainEffect) and isinstance(basis, ChainBasis) and effect.term.is_rotation:
        limit = min(limit, largest[1] / float(np.abs(basis.columns).max()))
    return limit


def shared_parameters(problem: ChainProblem, solution: Solution) -> SharedParameters:
    """The common unknowns of a solution: time constants in seconds, and no number for what the plan barely sees."""
    if not problem.shared:
        return SharedParameters((), (), np.zeros(0), np.zeros((0, 0)), ())
    estimate = solution.common.copy()
    covariance = solution.common_covariance.copy()
    units: list[Unit] = []
    reasons: list[Reason | None] = [
        None if free else Reason(ReasonKind.UNSEEN) for free in solution.common_free
    ]
    by_error = problem.evaluated(solution.local, solution.common, jacobian=True).by_error
    assert by_error is not None
    for added, columns in zip(problem.shared, problem.common_columns, strict=True):
        basis = added.basis(solution.common[columns])
        moved = problem.observe(basis.displacement(by_error))
        limit = largest_coefficient(
            added.effect,
            basis,
            float(np.linalg.norm(moved, axis=1).max(initial=0.0)),
            problem.largest_effect,
        )
        for column in range(columns.start, columns.start + added.size):
            units.append(added.effect.unit)
            u = float(np.sqrt(covariance[column, column]))
            if reasons[column] is None and u > limit:
                unit = added.effect.unit
                reasons[column] = Reason(ReasonKind.BARELY_SEEN, u=unit.to_display(u), unit=unit.name)
        if added.searched:
            last = columns.stop - 1
            units.append(MINUTE)
            tau = float(np.exp(estimate[last]))
            estimate[last] = tau
            covariance[last, :] *= tau
            covariance[:, last] *= tau
    determined = np.array([reason is None for reason in reasons], dtype=bool)
    return SharedParameters(
        names=problem.added_names,
        units=tuple(units),
        estimate=np.where(determined, estimate, np.nan),
        covariance=np.where(determined[:, None] & determined, covariance, np.nan),
        refused=tuple(
            Refusal((name,), reason)
            for name, reason in zip(problem.added_names, reasons, strict=True)
            if reason is not None
        ),
    )
