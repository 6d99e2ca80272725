"""How often an uncertainty that holds within a day, and one that holds over the campaign, cover the long-run value.

``python tests/benchmarks/trial_days.py [SEEDS]`` prints the table of docs/trials-uncertainty-days.md. One parameter, 95
% for it alone: U is t u, u² of the scatter within days and, over the campaign, of the day component, t with effective
degrees of freedom (Welch-Satterthwaite, days - 1 for the days). What is simulated besides normal and independent days:
heavy tails, days that follow each other, unequal days.
"""

from __future__ import annotations

import sys

import numpy as np
import scipy

from monitor.statistics.components import variance_components
from monitor.statistics.sums import grouped_sums

KINDS = ("normal", "t with 3 degrees", "AR(1) 0.6", "unequal days")
RATIOS = (0.0, 0.5, 1.0, 3.0)
DAYS = (3, 5, 10)
RUNS = 4


def levels(kind: str, days: int, seeds: int, rng: np.random.Generator) -> np.ndarray:
    """Levels (days, seeds) of unit variance about the long-run value 0."""
    if kind.startswith("t with"):
        return rng.standard_t(3, (days, seeds)) / np.sqrt(3.0)
    drawn = rng.standard_normal((days, seeds))
    if kind.startswith("AR"):
        for day in range(1, days):
            drawn[day] = 0.6 * drawn[day - 1] + 0.8 * drawn[day]
    return drawn


def coverages(
    kind: str, days: int, ratio: float, seeds: int, rng: np.random.Generator
) -> tuple[float, float]:
    """Rates at which the value lies within U of the last run, for U within a day and over the campaign."""
    sizes = [RUNS] * days if kind != "unequal days" else [2 + 4 * (day % 2) for day in range(days)]
    labels = np.repeat(np.arange(days), sizes)
    values = ratio * levels(kind, days, seeds, rng)[labels] + rng.standard_normal((len(labels), seeds))
    components = variance_components(values, labels)
    within = grouped_sums(values, labels).ms_within
    of_days, freedom = components.between**2, len(labels) - days
    effective = (within + of_days) ** 2 / (within**2 / freedom + of_days**2 / (days - 1))
    error = np.abs(values[-1])
    of_day = scipy.stats.t.ppf(0.975, freedom) * np.sqrt(within)
    of_campaign = scipy.stats.t.ppf(0.975, effective) * np.sqrt(within + of_days)
    return float(np.mean(error <= of_day)), float(np.mean(error <= of_campaign))


def table(seeds: int) -> list[str]:
    """The rows of the table, in Markdown."""
    rng = np.random.default_rng(20260302)
    rows = []
    for kind in KINDS:
        for days in DAYS:
            cells = [coverages(kind, days, ratio, seeds, rng) for ratio in RATIOS]
            numbers = " | ".join(f"{100 * day:.1f} / {100 * campaign:.1f}" for day, campaign in cells)
            rows.append(f"| {kind} | {days} | {numbers} |")
    return rows


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
    print("\n".join(table(seeds)))


if __name__ == "__main__":
    main()
