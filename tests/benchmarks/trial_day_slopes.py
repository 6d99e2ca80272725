"""Trial of a slope of days that one coefficient for days and runs hides: how often it is said, and said of nothing.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_day_slopes.py 1000

Days of four runs each, weather that resembles itself (0.7) and a hall that warms by up to 1.2 K a day; values with a
scatter of 1 from run to run and 2 from day to day. Of each setting it prints how many p-values are below 5, 1 and
0.1 %: of one coefficient for both (as `trend` had them), and of the condition as `trend` has it.
"""

from __future__ import annotations

import sys
from datetime import timedelta

import numpy as np

from monitor.statistics import dependence
from monitor.workflow.history.series import Series
from monitor.workflow.trend.causes import conditions

RUNS = 4
LEVELS = np.array([0.05, 0.01, 0.001])
#: Settings: days, kind of the day component, slopes between and within days; where both are zero nothing depends.
SETTINGS = [(days, kind, 0.0, 0.0) for days in (40, 12) for kind in ("none", "white", "alike", "heavy")] + [
    (days, kind, *slopes)
    for days in (40, 12)
    for kind in ("white", "alike")
    for slopes in ((2.0, 0.0), (1.0, -1.0), (1.0, -0.5), (0.5, -1.0))
]


def resembling(rng: np.random.Generator, count: int, rho: float) -> np.ndarray:
    """Normal numbers (count,) of unit variance whose neighbours have the correlation rho."""
    values = rng.standard_normal(count)
    for at in range(1, count):
        values[at] = rho * values[at - 1] + np.sqrt(1.0 - rho**2) * values[at]
    return values


def history(
    rng: np.random.Generator, days: int, kind: str, between: float, within: float
) -> tuple[Series, np.ndarray]:
    """A parameter and the temperatures (n,) of its runs."""
    day, hour = np.repeat(np.arange(days), RUNS), np.tile(np.linspace(9.0, 17.0, RUNS), days)
    warming = rng.uniform(0.3, 1.2, days)[day] * np.sin((hour - 9.0) / 16.0 * np.pi)
    hall = 20.0 + 2.0 * resembling(rng, days, 0.7)[day] + warming + 0.2 * rng.standard_normal(len(day))
    of_day = (np.bincount(day, hall) / RUNS)[day]
    if kind == "heavy":
        noise, component = rng.standard_t(3, len(day)), 2.0 * rng.standard_t(3, days)
    else:
        noise = rng.standard_normal(len(day))
        component = {"none": 0.0, "white": 2.0, "alike": 2.0}[kind] * resembling(
            rng, days, 0.6 if kind == "alike" else 0.0
        )
    values = noise + component[day] + between * (of_day - 20.0) + within * (hall - of_day)
    series = Series(
        "EXX", "µm", values, np.ones(len(day)), day + hour / 24.0, day, hour, np.zeros(len(day), bool), timedelta(0)
    )  # fmt: skip
    return series, hall


def main(count: int) -> None:
    print("days  day component  between  within  apart  one for both, below 5, 1, 0.1 %  as trend has it")
    for number, (days, kind, between, within) in enumerate(SETTINGS):
        below, apart = np.zeros((2, 3), dtype=int), 0
        for seed in range(count if not between else max(count // 10, 1)):
            series, hall = history(np.random.default_rng([number, seed]), days, kind, between, within)
            common = dependence(
                series.values, series.t, {"hall": hall}, drift="beside", u=series.weights(), days=series.days
            ).coefficients[0]
            (effect,), _ = conditions(series, {"ambient_degC": hall}, -np.inf)
            assert effect.p_value is not None
            below += np.array([common.p_value, effect.p_value])[:, None] < LEVELS
            apart += effect.within_days is not None
        row = "  ".join(", ".join(map(str, counts)) for counts in below.tolist())
        print(f"{days:4}  {kind:13}  {between:7}  {within:6}  {apart:5}  {row}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
