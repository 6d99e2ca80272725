"""The Monte Carlo trials of two parameters, with the regions that hold the pair and those that hold all parameters."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace

import numpy as np

from monitor.exceptions import InputError
from monitor.records import Array
from monitor.store import Database
from monitor.uncertainty.coverage_regions.coverage import (
    largest_deviations,
    mahalanobis_distances,
    quantile_of,
)
from monitor.uncertainty.coverage_regions.regions import region_factors
from monitor.uncertainty.framework import FrameworkResult
from monitor.uncertainty.parts import BudgetLine, one_of_each_estimate
from monitor.workflow.uncertainty.evaluation import evaluate
from monitor.workflow.uncertainty.request import COVERAGE, UncertaintyRequest

#: Trials that are handed out: enough to see 1 in 20 outside, few enough for an old telephone.
SHOWN = 2000


@dataclass(frozen=True)
class CloudRequest:
    """Two parameters of one ``run`` (the last by default). Raises InputError where they are the same."""

    campaign: str
    first: str
    second: str
    run: int | None = None
    _: KW_ONLY
    model: str | None = None
    p: float = COVERAGE
    trials: int = SHOWN

    def __post_init__(self) -> None:
        if self.first == self.second:
            raise InputError("choose two different parameters for the ellipse and the rectangle")
        if not 1 <= self.trials <= 100_000:
            raise InputError(f"{self.trials} trials: 1 to 100 000 can be handed out")


@dataclass(frozen=True, eq=False)
class CloudAnswer:
    """Estimates and standard uncertainties (2,) of the pair in its ``units``, and the first n of all ``trial_count``
    trials (n, 2).

    ``k_p`` of the ellipse and ``k_q`` of the rectangle hold the pair with ``p``, as quantiles of the trials; those
    ``_of_all`` hold all ``parameters`` of the run together. The trials take the covariance as known: those
    ``with_degrees_of_freedom`` of what was estimated may be claimed, as in ``FrameworkAnswer`` (None: no such region).
    """

    campaign: str
    run: int
    parameters: int
    names: tuple[str, str]
    units: tuple[str, str]
    estimate: tuple[float, float]
    u: tuple[float, float]
    correlation: float
    p: float
    k_p: float
    k_q: float
    k_p_of_all: float
    k_q_of_all: float
    trial_count: int
    seed: int
    trials: Array
    k_p_with_degrees_of_freedom: float | None = None
    k_q_with_degrees_of_freedom: float | None = None
    k_p_of_all_with_degrees_of_freedom: float | None = None
    k_q_of_all_with_degrees_of_freedom: float | None = None


def cloud(db: Database, request: CloudRequest) -> CloudAnswer:
    """Sample one run and hand out the trials of two of its parameters. Nothing is stored.

    Raises what ``uncertainty`` raises, InputError for a parameter that has no number in this run.
    """
    asked = UncertaintyRequest(request.campaign, request.run, model=request.model, method="mcm", p=request.p)
    result = evaluate(db, asked)
    sampled = result.monte_carlo
    assert sampled is not None
    for name in (request.first, request.second):
        if name not in sampled.names:
            raise InputError(f"'{name}' has no number in this campaign; choose of {', '.join(sampled.names)}")
    columns = [sampled.names.index(name) for name in (request.first, request.second)]
    units = [result.units[column] for column in columns]
    trials = sampled.sample[:, columns]
    centre = sampled.estimate[columns]
    covariance = sampled.covariance[np.ix_(columns, columns)]
    first, second = (unit.to_display(1.0) for unit in units)
    u = np.sqrt(np.diag(covariance))
    framework = result.framework
    of_pair = region_factors(_of_pair(framework, request), request.p)
    return CloudAnswer(
        campaign=request.campaign,
        run=result.run,
        parameters=len(sampled.names),
        names=(request.first, request.second),
        units=(units[0].name, units[1].name),
        estimate=(float(centre[0] * first), float(centre[1] * second)),
        u=(float(u[0] * first), float(u[1] * second)),
        correlation=float(covariance[0, 1] / (u[0] * u[1])) if u.all() else 0.0,
        p=request.p,
        k_p=quantile_of(mahalanobis_distances(trials, centre, covariance), request.p),
        k_q=quantile_of(largest_deviations(trials, centre, covariance), request.p),
        k_p_of_all=sampled.k_p,
        k_q_of_all=sampled.k_q,
        trial_count=sampled.trials,
        seed=sampled.seed,
        trials=np.round(trials[: request.trials] * np.array([first, second]), 6),
        k_p_with_degrees_of_freedom=_finite(of_pair.k_p),
        k_q_with_degrees_of_freedom=_finite(of_pair.k_q),
        k_p_of_all_with_degrees_of_freedom=_finite(framework.k_p),
        k_q_of_all_with_degrees_of_freedom=_finite(framework.k_q),
    )


def _of_pair(framework: FrameworkResult, request: CloudRequest) -> list[BudgetLine]:
    """Return the parts of the covariance of the two parameters, with the degrees of freedom of each."""
    places = [framework.names.index(name) for name in (request.first, request.second)]
    block = np.ix_(places, places)
    return [
        replace(part, covariance=part.covariance[block]) for part in one_of_each_estimate(framework.budget)
    ]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
