"""In how many histories without any dependence `trend` states a condition; results in ``docs/trials-statistics.md``.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_conditions.py

Thirteen parameters of 7 to 20 campaigns of one day, 6 to 20 runs each; two temperatures walk within a day and between
days. Nothing depends on them. A minute or so for a hundred histories, and no test.
"""

from __future__ import annotations

import argparse
from datetime import timedelta

import numpy as np
from scipy import stats

from monitor.statistics import control_false_discoveries
from monitor.workflow.history.series import Series
from monitor.workflow.trend.causes import conditions

PARAMETERS, CONDITIONS, CALLED = 13, 2, 0.05
#: How days differ and how each resembles the one before, in standard deviations of a run.
LAWS = {"days alike": (0.0, 0.0), "days differ by 1": (1.0, 0.0), "and resemble each other, 0.6": (1.0, 0.6)}


def temperature(rng: np.random.Generator, runs: np.ndarray) -> np.ndarray:
    """Temperatures in °C of all runs: days walk by 0.7 K, the runs of each by 0.15 K."""
    of_days = 20.0 + np.cumsum(rng.normal(0.0, 0.7, len(runs)))
    return np.concatenate(
        [of_day + np.cumsum(rng.normal(0.0, 0.15, n)) for of_day, n in zip(of_days, runs, strict=True)]
    )


def p_values(rng: np.random.Generator, differ: float, follow: float) -> np.ndarray:
    """What `trend` computes of a machine (13, 2); NaN where it computes nothing."""
    campaigns = int(rng.integers(7, 21))
    runs = rng.integers(6, 21, campaigns)
    day = np.repeat(np.arange(campaigns), runs)
    within = np.concatenate([np.arange(n) for n in runs]) * 0.3
    starts = np.arange(campaigns) * 30.0 + rng.uniform(0.0, 5.0, campaigns)
    count = len(day)
    channels = {f"channel_{i}_degC": temperature(rng, runs) for i in range(CONDITIONS)}
    rows = []
    for _ in range(PARAMETERS):
        of_day = rng.normal(size=campaigns)
        for i in range(1, campaigns):
            of_day[i] = follow * of_day[i - 1] + np.sqrt(1.0 - follow**2) * of_day[i]
        series = Series(
            "E", "µrad", rng.normal(size=count) + differ * of_day[day], np.ones(count),
            20000.0 + starts[day] + within / 24.0, day, within, np.zeros(count, dtype=np.bool_), timedelta(),
            campaign=day,
        )  # fmt: skip
        effects = {effect.channel: effect.p_value for effect in conditions(series, channels, -np.inf)[0]}
        rows.append([effects.get(name, np.nan) for name in channels])
    return np.array(rows, dtype=np.float64)


def stated(p: np.ndarray, joint: bool) -> int:
    """How many lines of a machine are stated where the rate is over all of them, or over those of one parameter."""
    if joint:
        return int((control_false_discoveries(p.ravel()).q_value < CALLED).sum())
    return sum(int((control_false_discoveries(row).q_value < CALLED).sum()) for row in p)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("histories", nargs="?", type=int, default=200)
    parser.add_argument("seed", nargs="?", type=int, default=16)
    given = parser.parse_args()
    print("| machine | p < 5 %, % | one parameter at a time | all of the machine | lines |")
    print("| --- | --- | --- | --- | --- |")
    for law, (differ, follow) in LAWS.items():
        rng = np.random.default_rng(given.seed)
        each = [p_values(rng, differ, follow) for _ in range(given.histories)]
        cells = []
        for joint in (False, True):
            lines = [stated(p, joint) for p in each]
            calls = sum(count > 0 for count in lines)
            low, high = stats.binomtest(calls, len(each)).proportion_ci(0.95, "exact")
            cells.append((f"{100 * calls / len(each):.1f} ({100 * low:.1f} to {100 * high:.1f})", sum(lines)))
        small = 100.0 * np.mean(np.concatenate([p.ravel() for p in each]) < CALLED)
        print(
            f"| {law} | {small:.1f} | {cells[0][0]} | {cells[1][0]} | {cells[0][1]}, {cells[1][1]} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
