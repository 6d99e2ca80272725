"""The parameters that all runs of a campaign share, as they are reported: with numbers, or refused with the reason.

Their covariance is that of the stated uncertainties; where readings share their poses (a robot) it is widened to what
the poses show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.effects import Basis, ChainEffect, Effect
from monitor.effects.effect import ChainBasis
from monitor.methods.chain.least_squares import COMMON_RANK_TOLERANCE, MEMBER_SHARE, Solution, eliminate
from monitor.methods.chain.poses import widening_of_common
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.chain.redundant import replaced_by
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


@dataclass(frozen=True)
class FollowedEffects:
    """The a coefficients of added effects that every run determines by itself: what a history of them is made of.

    ``estimate`` (R, a) and ``covariance`` (R, a, a) in internal units, NaN where a run alone says nothing of it. The
    runs' estimates, weighted by their covariances, have the campaign's for their mean. Time constants are held at the
    campaign's, and coefficients of a single run are left out.
    """

    names: tuple[str, ...]
    units: tuple[Unit, ...]
    estimate: Array
    covariance: Array


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


def followed_effects(problem: ChainProblem, solution: Solution) -> FollowedEffects:
    """The added effects' coefficients as each run alone determines them, to first order about the common solution."""
    at, runs = solution.last, len(problem.runs)
    acts = np.any(at.common != 0.0, axis=1).sum(axis=0)
    columns, units, limits = [], [], []
    by_error = (
        problem.evaluated(solution.local, solution.common, jacobian=True).by_error if problem.shared else None
    )
    for added, part in zip(problem.shared, problem.common_columns, strict=True):
        assert by_error is not None
        basis = added.basis(solution.common[part])
        peak = float(np.linalg.norm(problem.observe(basis.displacement(by_error)), axis=1).max(initial=0.0))
        for column in range(part.start, part.start + added.size):
            if runs == 1 or acts[column] > 1:
                columns.append(column)
                units.append(added.effect.unit)
                limits.append(largest_coefficient(added.effect, basis, peak, problem.largest_effect))
    estimate = np.full((runs, len(columns)), np.nan)
    covariance = np.full((runs, len(columns), len(columns)), np.nan)
    own_unknowns = eliminate(at.local).basis
    for run in range(runs if columns else 0):
        whole = at.common[run][:, columns]
        scale = np.linalg.norm(whole, axis=0)
        scale[scale == 0.0] = 1.0
        basis_of_run = own_unknowns[run]
        remainder = whole / scale - basis_of_run @ (basis_of_run.T @ (whole / scale))
        residual = at.residual[run] - basis_of_run @ (basis_of_run.T @ at.residual[run])
        u, s, vt = np.linalg.svd(remainder, full_matrices=False)
        determined = s > COMMON_RANK_TOLERANCE
        inverse = (vt.T * np.where(determined, 1.0 / np.where(determined, s, 1.0), 0.0)) / scale[:, None]
        matrix = inverse @ inverse.T
        free = np.abs(vt[~determined]).max(axis=0, initial=0.0) < MEMBER_SHARE
        free &= np.sqrt(np.diag(matrix)) <= np.array(limits)
        estimate[run] = np.where(free, solution.common[columns] - inverse @ (u.T @ residual), np.nan)
        covariance[run] = np.where(free[:, None] & free, matrix, np.nan)
    names = tuple(problem.added_names[column] for column in columns)
    return FollowedEffects(names, tuple(units), estimate, covariance)


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
    for column in map(int, np.flatnonzero(solution.common_held)):
        at = problem.linearise(solution.local, solution.common)
        same = replaced_by(problem.shared, at, solution.common_held, column)
        reasons[column] = Reason(ReasonKind.HELD_AT_ZERO, same)
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
    # What no model has moves all numbers of a pose together; the stated uncertainties know nothing of it.
    factors = widening_of_common(problem, solution)
    covariance = factors[:, None] * covariance * factors
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
