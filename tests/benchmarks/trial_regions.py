"""How often the joint coverage regions hold the truth; results in ``docs/trials-regions.md``.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_regions.py --replicates 150

Readings are drawn vector by vector with numpy and their covariance is taken by its definition: nothing is shared with
the package but the factors under trial. ``held`` is the probability that the region of a campaign holds the truth: the
share of 2 000 true deviations, averaged over campaigns. Beside the grid stands what the factors do not assume: heavy
tails, readings that depend on one another from run to run; and the law in use before (one Satterthwaite number).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from monitor.uncertainty import BudgetLine, Estimated, effective_dof, ellipsoid_factor, region_factors

DRAWN = 2000
Noise = Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]


@dataclass(frozen=True)
class Budget:
    """What m outputs are uncertain by: ``readings`` (m, m), estimated with ``nu``, and ``known`` (m, m).

    ``size`` (m, m) is a part whose size alone is estimated, with ``size_nu``.
    """

    name: str
    nu: int
    readings: np.ndarray
    known: np.ndarray
    size: np.ndarray | None = None
    size_nu: int = 30


def correlated(m: int, rho: float) -> np.ndarray:
    """Equal correlations."""
    return (1.0 - rho) * np.eye(m) + rho * np.ones((m, m))


def bar(m: int, share: float, readings: np.ndarray) -> np.ndarray:
    """A source of rank one that makes ``share`` of the variance of the first output, and less of others."""
    direction = np.zeros(m)
    direction[0] = 1.0
    direction[1 : m // 3] = 0.2
    return share / (1.0 - share) * readings[0, 0] * np.outer(direction, direction)


def budgets() -> list[Budget]:
    """The grid."""
    rows = []
    for m, nu in ((1, 8), (2, 8), (5, 8), (5, 20), (13, 15), (13, 20), (13, 60), (40, 60)):
        readings = correlated(m, 0.3)
        rows += [Budget("nothing known", nu, readings, 0.0 * readings)]
        rows += [
            Budget(
                f"{100 * share:.0f} % known", nu, readings, share / (1 - share) * np.diag(np.diag(readings))
            )
            for share in (0.1, 0.5, 0.9)
        ]
        rows += [
            Budget(f"a bar, {100 * share:.0f} % of one", nu, readings, bar(m, share, readings))
            for share in (0.5, 0.99)
        ]
    for m, nu in ((13, 15), (5, 8)):
        readings = correlated(m, 0.9)
        rows += [Budget("bar and a size from 30", nu, readings, bar(m, 0.5, readings), 0.5 * np.eye(m))]
    # More outputs than degrees of freedom: no ellipsoid; intervals alone.
    rows += [
        Budget(f"nothing known, r = {rho}", 8, correlated(m, rho), np.zeros((m, m)))
        for m in (13, 40)
        for rho in (0.0, 0.5, 0.9)
    ]
    return rows


def normal(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Normal noise of variance one."""
    return rng.standard_normal(shape)


def heavy(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Student's t with 4 degrees of freedom, of variance one: a whole run is calm or wild."""
    return rng.standard_normal(shape) / np.sqrt(rng.chisquare(4.0, (*shape[:-1], 1)) / 4.0) / math.sqrt(2.0)


def dependent(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Each run depends on the one before, AR(1) with 0.5, variance one."""
    noise = rng.standard_normal(shape)
    for index in range(1, shape[-2]):
        noise[..., index, :] = 0.5 * noise[..., index - 1, :] + math.sqrt(0.75) * noise[..., index, :]
    return noise


def held(budget: Budget, noise: Noise, replicates: int, seed: int) -> np.ndarray:
    """Coverages (replicates, 3) of k_p, k_q and Hotelling's law at Satterthwaite's number; NaN where there is none."""
    rng = np.random.default_rng([seed, budget.nu, len(budget.readings)])
    m = len(budget.readings)
    root = np.linalg.cholesky(budget.readings)
    values, vectors = np.linalg.eigh(budget.known)
    known_root = vectors * np.sqrt(np.maximum(values, 0.0))
    rows = []
    for _ in range(replicates):
        runs = noise(rng, (budget.nu + 1, m)) @ root.T
        estimated = np.atleast_2d(np.cov(runs, rowvar=False))
        lines = [
            BudgetLine("readings", estimated, float(budget.nu)),
            BudgetLine("known", budget.known, math.inf),
        ]
        # The deviation of the run that is certified, of the same kind as those of the others.
        errors = noise(rng, (DRAWN, 1, m))[:, 0] @ root.T + rng.standard_normal((DRAWN, m)) @ known_root.T
        if budget.size is not None:
            observed = budget.size * rng.chisquare(budget.size_nu) / budget.size_nu
            lines.append(BudgetLine("size", observed, float(budget.size_nu), Estimated.SCALE))
            errors += rng.standard_normal((DRAWN, m)) @ np.linalg.cholesky(budget.size).T
        covariance = np.sum([line.covariance for line in lines], axis=0)
        factors = region_factors(lines, most_groups=2)
        before = ellipsoid_factor(
            m,
            0.95,
            effective_dof([line.covariance for line in lines], [line.dof or math.inf for line in lines]),
        )
        inside = np.max(np.abs(errors) / np.sqrt(np.diag(covariance)), axis=1) <= factors.k_q
        if not math.isfinite(factors.k_p):
            rows.append((math.nan, inside.mean(), math.nan))
            continue
        distances = np.sqrt(np.sum(errors * np.linalg.solve(covariance, errors.T).T, axis=1))
        rows.append((np.mean(distances <= factors.k_p), inside.mean(), np.mean(distances <= before)))
    return np.array(rows)


def line(budget: Budget, coverages: np.ndarray) -> str:
    """A row of the table: percent, with the standard error of the mean."""
    cells = []
    for column in coverages.T:
        error = column.std(ddof=1) / math.sqrt(len(column))
        cells.append("none" if np.isnan(column).any() else f"{100 * column.mean():.1f} ± {100 * error:.1f}")
    return f"| {len(budget.readings)} | {budget.nu} | {budget.name} | {' | '.join(cells)} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--replicates", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--outputs", type=int, help="only the budgets of so many outputs")
    options = parser.parse_args()
    asked = [budget for budget in budgets() if options.outputs in (None, len(budget.readings))]
    head = "| outputs | degrees | budget | k_p, % | k_q, % | before: k_p, % |\n| --- | --- | --- | --- | --- | --- |"
    print(f"{head}", flush=True)
    for budget in asked:
        print(line(budget, held(budget, normal, options.replicates, options.seed)), flush=True)
    for title, noise in (("t with 4 degrees of freedom", heavy), ("AR(1) with 0.5", dependent)):
        print(f"\n{title}\n\n{head}", flush=True)
        for budget in asked:
            if (len(budget.readings), budget.nu) in ((5, 20), (13, 20), (13, 60)):
                print(line(budget, held(budget, noise, options.replicates, options.seed)), flush=True)


if __name__ == "__main__":
    main()
