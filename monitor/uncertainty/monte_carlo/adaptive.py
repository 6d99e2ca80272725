"""The adaptive Monte Carlo procedure for many outputs (JCGM 102:2011 7.8).

Sequences of M trials are added until twice the standard deviation of every estimate, of every standard
uncertainty, of the largest eigenvalue of the correlation matrix and of both coverage factors is no larger than
its numerical tolerance. k_q is part of the rule, as in Los 2017, 4.4; JCGM 102 names k_p. For a validation
(clause 8) the tolerances are divided by 5: ``tighten=5``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from monitor.exceptions import DataError, RefusedResultError
from monitor.progress import is_awaited, told
from monitor.records import Array
from monitor.stopping import checkpoint
from monitor.uncertainty.coverage_regions.coverage import (
    largest_deviations,
    mahalanobis_distances,
    quantile_of,
    quantile_standard_error,
)
from monitor.uncertainty.monte_carlo.propagation import Accumulator, Model, Summary, Trials
from monitor.uncertainty.monte_carlo.sampling import BlockSampler
from monitor.uncertainty.roots import RANK_TOLERANCE, WithCovariance, covariance_root
from monitor.uncertainty.tolerance import numerical_tolerance, tolerances_of


@dataclass(frozen=True)
class Tolerances:
    """Numerical tolerances: ``outputs`` (m,) of estimates and standard uncertainties, and of the rest."""

    outputs: Array
    lambda_max: float
    k_p: float
    k_q: float

    def as_row(self) -> Array:
        """In the order of ``Summary.as_row``."""
        return np.concatenate([self.outputs, self.outputs, [self.lambda_max, self.k_p, self.k_q]])


@dataclass(frozen=True)
class MonteCarloResult(WithCovariance):
    """Estimates, covariance and coverage factors of the outputs by Monte Carlo, and how far to trust them.

    ``standard_errors`` are those of estimate, u, lambda_max, k_p and k_q from the scatter of the
    ``sequences``; ``stable`` says that twice each was within ``tolerances`` when the trials ended. k_p and
    k_q come from ``sample`` (kept, m), the first trials up to the bound; ``k_p_error`` and ``k_q_error`` are
    the standard errors of these quantiles, from order statistics. ``trials`` counts all, ``not_converged``
    those without outputs.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    estimate: Array
    covariance: Array
    k_p: float
    k_q: float
    k_p_error: float
    k_q_error: float
    rank: int
    p: float
    digits: int
    tighten: float
    tolerances: Tolerances
    standard_errors: Summary
    stable: bool
    trials: int
    sequences: int
    not_converged: int
    sample: Array
    seed: int
    block_size: int
    seconds: float


def sequence_length(p: float, block_size: int) -> int:
    """M = max(J, 10^4) with J the smallest integer >= 100/(1 - p) (JCGM 102 7.8.3), in whole blocks."""
    trials = max(math.ceil(100.0 / (1.0 - p) - 1e-9), 10_000)
    return math.ceil(trials / block_size) * block_size


@dataclass(frozen=True)
class MonteCarloOptions:
    """How far a Monte Carlo goes and what it keeps.

    It is stable to ``digits`` significant digits, with tolerances divided by ``tighten``, after ``min_sequences`` at
    least; ``max_trials`` end it in any case. ``keep`` bounds the sample behind k_p and k_q. Directions with an
    eigenvalue of the correlation matrix below ``rank_tolerance`` times the largest take no part in k_p. ``workers``
    are threads. Raises DataError for numbers that are too small.
    """

    p: float = 0.95
    digits: int = 2
    tighten: float = 1.0
    min_sequences: int = 10
    max_trials: int = 10_000_000
    keep: int = 200_000
    workers: int = 1
    rank_tolerance: float = RANK_TOLERANCE

    def __post_init__(self) -> None:
        if self.digits < 1 or not self.tighten > 0.0 or self.min_sequences < 1 or self.keep < 1000:
            raise DataError(
                f"digits and min_sequences must be at least 1, tighten positive and keep at least 1000, but are "
                f"{self.digits}, {self.min_sequences}, {self.tighten} and {self.keep}"
            )


def adaptive_monte_carlo(
    model: Model,
    sampler: BlockSampler,
    names: Sequence[str],
    units: Sequence[str],
    options: MonteCarloOptions | None = None,
) -> MonteCarloResult:
    """Propagate by sequences of M trials until stable, or until the most trials that ``options`` allow.

    ``names`` and ``units`` are those of the m outputs of ``model``. Where the most trials end the work before
    stability, ``stable`` is false.

    Raises DataError where an output lacks a name or a unit, RefusedResultError where trials did not converge and could
    matter: the result is refused when, with all of them outside the coverage region, k_p or k_q would move by more than
    its tolerance, or, with all of them as far out as the farthest trial seen, a standard uncertainty would.
    """
    if not names or len(names) != len(units):
        raise DataError(f"every output needs a name and a unit, but there are {len(names)} and {len(units)}")
    options = options or MonteCarloOptions()
    length = sequence_length(options.p, sampler.block_size)
    total = Accumulator(len(names), options.p, options.keep, options.rank_tolerance)
    with Trials(model, sampler, len(names), options.workers).pool() as trials:
        while True:
            checkpoint()
            total.add(trials.sequence(length // sampler.block_size))
            _refuse_without_trials(total)
            last = total.trials >= options.max_trials
            enough = len(total.rows) >= max(options.min_sequences, 2)
            if last or (enough and _stable(total, _tolerances(total.quick(), options))):
                summary = total.summary()
                tolerances = _tolerances(summary, options)
                if last or _stable(total, tolerances):
                    break
            if is_awaited():
                told(_share_done(total, options))
    _refuse_where_it_matters(total, summary, tolerances)
    return _result(total, tolerances, sampler, names, units, options)


def monte_carlo(
    model: Model,
    sampler: BlockSampler,
    names: Sequence[str],
    units: Sequence[str],
    trials: int,
    options: MonteCarloOptions | None = None,
) -> MonteCarloResult:
    """Propagate a fixed number of ``trials``, rounded up to whole sequences (JCGM 102 7.2); else as above."""
    options = options or MonteCarloOptions()
    sequences = max(2, math.ceil(trials / sequence_length(options.p, sampler.block_size)))
    options = replace(options, min_sequences=sequences, max_trials=trials)
    return adaptive_monte_carlo(model, sampler, names, units, options)


def _tolerances(summary: Summary, options: MonteCarloOptions) -> Tolerances:
    rest = [
        numerical_tolerance(value, options.digits) / options.tighten if value > 0.0 else 0.0
        for value in (summary.lambda_max, summary.k_p, summary.k_q)
    ]
    return Tolerances(tolerances_of(summary.u, options.digits) / options.tighten, *rest)


def _share_done(total: Accumulator, options: MonteCarloOptions) -> float:
    """Return the share of the trials that are done of those needed: standard errors fall with the root of their number.

    An estimate, which moves with the scatter of the sequences; 0 before two of them.
    """
    if len(total.rows) < 2:
        return 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        times_too_large = 2.0 * total.standard_errors() / _tolerances(total.quick(), options).as_row()
    # What neither scatters nor has a tolerance is done.
    worst = float(np.nanmax(times_too_large, initial=0.0))
    needed = max(len(total.rows) * worst**2, options.min_sequences)
    return max(len(total.rows) / needed, total.trials / options.max_trials)


def _stable(total: Accumulator, tolerances: Tolerances) -> bool:
    return bool(np.all(2.0 * total.standard_errors() <= tolerances.as_row()))


def _refuse_without_trials(total: Accumulator) -> None:
    if not total.rows:
        raise RefusedResultError(
            f"Monte Carlo result refused: {total.not_converged} of the first {total.trials} trials did not "
            f"converge; the input uncertainty is too large for this model, or the model is rank deficient"
        )


def _refuse_where_it_matters(total: Accumulator, summary: Summary, tolerances: Tolerances) -> None:
    """The criterion that ``adaptive_monte_carlo`` states."""
    if not total.not_converged:
        return
    share = total.not_converged / total.trials
    covariance = total.moments.covariance
    distances = mahalanobis_distances(total.sample, summary.estimate, covariance, total.tolerance)
    deviations = largest_deviations(total.sample, summary.estimate, covariance)
    inside = total.p / (1.0 - share)
    why = None
    if inside >= 1.0:
        why = f"only {100 * (1 - share):.2f} % of the trials gave outputs, less than p"
    elif (moved := quantile_of(distances, inside) - summary.k_p) > tolerances.k_p:
        why = f"k_p could be {moved:.3g} larger (tolerance {tolerances.k_p:.3g})"
    elif (moved := quantile_of(deviations, inside) - summary.k_q) > tolerances.k_q:
        why = f"k_q could be {moved:.3g} larger (tolerance {tolerances.k_q:.3g})"
    else:
        grown = summary.u * (math.sqrt(1.0 - share + share * float(np.max(deviations)) ** 2) - 1.0)
        if np.any(grown > tolerances.outputs):
            why = "a standard uncertainty could be larger by more than its numerical tolerance"
    if why is not None:
        raise RefusedResultError(
            f"Monte Carlo result refused: {total.not_converged} of {total.trials} trials did not converge, "
            f"and it matters: {why}"
        )


def _result(
    total: Accumulator,
    tolerances: Tolerances,
    sampler: BlockSampler,
    names: Sequence[str],
    units: Sequence[str],
    options: MonteCarloOptions,
) -> MonteCarloResult:
    outputs = len(names)
    covariance = total.moments.covariance
    estimate = total.moments.mean
    distances = mahalanobis_distances(total.sample, estimate, covariance, total.tolerance)
    deviations = largest_deviations(total.sample, estimate, covariance)
    errors = total.standard_errors()
    return MonteCarloResult(
        names=tuple(names),
        units=tuple(units),
        estimate=estimate,
        covariance=covariance,
        k_p=quantile_of(distances, total.p),
        k_q=quantile_of(deviations, total.p),
        k_p_error=quantile_standard_error(distances, total.p),
        k_q_error=quantile_standard_error(deviations, total.p),
        rank=covariance_root(covariance, total.tolerance).rank,
        p=total.p,
        digits=options.digits,
        tighten=options.tighten,
        tolerances=tolerances,
        standard_errors=Summary(errors[:outputs], errors[outputs : 2 * outputs], *map(float, errors[-3:])),
        stable=_stable(total, tolerances),
        trials=total.trials,
        sequences=len(total.rows),
        not_converged=total.not_converged,
        sample=total.sample,
        seed=sampler.seed,
        block_size=sampler.block_size,
        seconds=time.perf_counter() - total.started,
    )
