"""Trial of days that wander where a condition has one slope for days and runs: how often two are said, and the price.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_wandering_days.py 2000 40

A day a week of runs in a hall with the season's ±3 K, whose temperature differs by 1 K from run to run. A day is off by
something white, by a process that follows itself, or by a random walk. Of each setting it prints in how many histories
days and runs contradict each other by the fit alone (``before``) and with days that wander allowed for (``since``), and
the root mean square error of the coefficient: of as many histories as the first number says with a slope of 0.5 for
both, and of as many as the second says with 2.24 from day to day and 0.01 from run to run.
"""

from __future__ import annotations

import sys
from datetime import timedelta

import numpy as np

from monitor.workflow.history.series import Series
from monitor.workflow.trend import causes

#: Kind of what a day is off by, its correlation from day to day, its size.
KINDS = (
    ("white", 0.0, 1.0),
    ("follows itself", 0.9, 3.0),
    ("follows itself", 0.97, 3.0),
    ("walks", 1.0, 4.0),
)
PLANS = ((40, 4), (15, 4), (100, 2))


def off_by(rng: np.random.Generator, days: int, correlation: float, size: float) -> np.ndarray:
    """What each day is off by (days,)."""
    if correlation == 1.0:
        return np.asarray(np.cumsum(rng.normal(size=days)) / np.sqrt(days) * 2.0 * size)
    process = np.zeros(days)
    process[0] = rng.normal()
    for day in range(1, days):
        process[day] = correlation * process[day - 1] + np.sqrt(1.0 - correlation**2) * rng.normal()
    return process * size


def history(
    seed: int, plan: tuple[int, int], slopes: tuple[float, float], correlation: float, size: float
) -> tuple[Series, np.ndarray]:
    """A parameter and the temperatures (n,) of its runs."""
    rng, (days, runs) = np.random.default_rng([seed, 77]), plan
    day = np.repeat(np.arange(days), runs)
    season = 3.0 * np.sin(2.0 * np.pi * np.arange(days) * 7.0 / 365.0 + rng.uniform(0.0, 6.0))
    weather, of_run = (season + 0.1 * rng.normal(size=days))[day], rng.normal(size=len(day))
    hall = weather + of_run
    wander = off_by(rng, days, correlation, size)[day]
    of_day = (np.bincount(day, hall) / runs)[day]
    between, within = slopes
    values = between * of_day + within * (hall - of_day) + wander + 0.2 * rng.normal(size=len(day))
    series = Series(
        "E", "µm", values, np.full(len(day), 0.2), 7.0 * day + 0.05 * np.tile(np.arange(runs), days), day,
        np.full(len(day), 8.0), np.zeros(len(day), bool), timedelta(0),
    )  # fmt: skip
    return series, 21.0 + hall


def main(alike: int, apart: int) -> None:
    asked: list[float] = []
    slope_as_far = causes.slope_as_far

    def noted(*arguments: float) -> float:
        asked.append(slope_as_far(*arguments))
        return asked[-1]

    causes.slope_as_far = noted
    print("slopes  a day  correlation  days, runs  before  since  of  root mean square error")
    for slopes, count in (((0.5, 0.5), alike), ((2.24, 0.01), apart)):
        for kind, correlation, size in KINDS:
            for plan in PLANS:
                since, errors = 0, []
                asked.clear()
                for seed in range(count):
                    scale = size if slopes[0] == slopes[1] else 1.0
                    series, hall = history(seed, plan, slopes, correlation, scale)
                    (effect,), _ = causes.conditions(series, {"ambient_degC": hall}, -np.inf)
                    since += effect.within_days is not None
                    errors.append(effect.coefficient - slopes[0])
                error = np.sqrt(np.mean(np.square(errors)))
                print(slopes, kind, correlation, plan, len(asked), since, count, f"{error:.3f}", flush=True)


if __name__ == "__main__":
    main(*(map(int, sys.argv[1:3]) if len(sys.argv) > 2 else (2000, 40)))
