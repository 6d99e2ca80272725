"""Coverage factors of both regions for a covariance that is a sum of parts, by seeded Monte Carlo where needed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from monitor.uncertainty.coverage_regions.coverage import single_factor
from monitor.uncertainty.coverage_regions.ellipsoid import EllipsoidLaw, SizeLaw, ellipsoid_law
from monitor.uncertainty.coverage_regions.rectangle import RectangleLaw, rectangle_law
from monitor.uncertainty.coverage_regions.smoothed import Quantile, scattered
from monitor.uncertainty.parts import BudgetLine

#: Seed where none is given: a certificate made again has the same digits.
SEED = 102
#: Groups are added until the standard error is below half of the second decimal, or this part of the factor.
_ERROR, _RELATIVE_ERROR = 0.005, 5e-4
_FEWEST_GROUPS, MOST_GROUPS = 10, 60


@dataclass(frozen=True)
class RegionFactors:
    """Coverage factors for probability ``p`` and the standard errors of their sampling, zero for closed forms.

    ``k_p`` is infinite where the parts bound no ellipsoid. ``trials`` are the drawn covariances of both factors
    together, from ``seed``; none where both have closed forms.
    """

    p: float
    k_p: float
    k_q: float
    k_p_error: float
    k_q_error: float
    seed: int
    trials: int


def region_factors(
    parts: Sequence[BudgetLine], p: float = 0.95, seed: int = SEED, most_groups: int = MOST_GROUPS
) -> RegionFactors:
    """Return k_p and k_q for the sum of ``parts``, each (m, m) (``ellipsoid``, ``rectangle``).

    Groups of trials are added until the factors are known to two decimals, or ``most_groups`` of each.
    """
    p_rng, q_rng = (np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(2))
    # Many small matrices: threads of the linear algebra would wait for one another, and might round otherwise.
    with threadpool_limits(1, "blas"):
        k_p, p_trials = _factor(ellipsoid_law(parts, p), p_rng, p, most_groups)
        single = _single(parts, p)
        k_q, q_trials = _factor(rectangle_law(parts) if single is None else single, q_rng, p, most_groups)
    return RegionFactors(
        p, k_p.value, k_q.value, k_p.standard_error, k_q.standard_error, seed, p_trials + q_trials
    )


def _factor(
    law: EllipsoidLaw | SizeLaw | RectangleLaw | float, rng: np.random.Generator, p: float, most: int
) -> tuple[Quantile, int]:
    """The factor of a law, which may be that factor itself, and how many trials it took."""
    if isinstance(law, float):
        return Quantile(law, 0.0), 0
    values: list[float] = []
    while True:
        values += [law.factor(rng, p) for _ in range(min(_FEWEST_GROUPS, most))]
        quantile = scattered(values)
        enough = quantile.standard_error <= max(_ERROR, _RELATIVE_ERROR * quantile.value)
        if enough or len(values) >= most:
            common = law.common_error * quantile.value if isinstance(law, RectangleLaw) else 0.0
            error = math.hypot(quantile.standard_error, common)
            return Quantile(quantile.value, error), len(values) * law.trials


def _single(parts: Sequence[BudgetLine], p: float) -> float | None:
    """Return k of one output whose variance has one part: normal or Student's t; None for anything else."""
    if parts[0].covariance.shape != (1, 1):
        return None
    total = sum(float(part.covariance[0, 0]) for part in parts)
    estimated = [part for part in parts if not part.known and float(part.covariance[0, 0]) > 0.0]
    if not estimated:
        return single_factor(p)
    if len(estimated) == 1 and math.isclose(float(estimated[0].covariance[0, 0]), total, rel_tol=1e-9):
        return single_factor(p, float(estimated[0].dof or math.inf))
    return None
