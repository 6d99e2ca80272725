"""What an oracle can see of a change at an event; results in ``docs/trials-statistics.md``.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_event_oracle.py

Nothing is shared with the package. The oracle knows the layout and every law that the days may follow where nothing
changed, and takes for its statistic the critical value that holds 5 % under the worst of them: independent days, tails
of Student 3, three times the scatter after, days correlated by 0.6, and campaigns that differ by 0.7 of a day. It
estimates the scatter from the days themselves (pooled, Welch), or knows it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np

#: Runs of a day; days differ by as much as runs.
RUNS = 4
LAYOUTS = ((2, 2), (3, 3), (5, 2), (10, 2), (5, 5), (10, 10), (20, 20))
CHANGES = (3.5, 7.0, 12.0)
Days = Callable[[np.random.Generator, int, int], np.ndarray]


def correlated(rng: np.random.Generator, count: int, n: int) -> np.ndarray:
    """Days (count, n) of a first-order process of 0.6."""
    days = rng.normal(size=(count, n))
    for day in range(1, n):
        days[:, day] = 0.6 * days[:, day - 1] + 0.8 * days[:, day]
    return days


#: Laws of the days without a change: their days, and the factor of the scatter after the event.
LAWS: dict[str, tuple[Days, float]] = {
    "independent": (lambda rng, count, n: rng.normal(size=(count, n)), 1.0),
    "Student, 3": (lambda rng, count, n: rng.standard_t(3, (count, n)) / np.sqrt(3.0), 1.0),
    "3 times after": (lambda rng, count, n: rng.normal(size=(count, n)), 3.0),
    "AR 0.6": (correlated, 1.0),
    "campaigns": (
        lambda rng, count, n: 0.7 * (rng.normal(size=(count, n)) + rng.normal(size=(count, 1))),
        1.0,
    ),
}
#: What the oracle has to hold 5 % under, from the laws that every test of two means assumes to all that are claimed.
ALLOWED = (("independent",), ("independent", "Student, 3", "3 times after"), tuple(LAWS))


def statistics(x: np.ndarray, y: np.ndarray, u: float) -> dict[str, np.ndarray]:
    """Sizes (count,) of the difference of day means (count, a) and (count, b) over its uncertainty, by statistic."""
    a, b = x.shape[1], y.shape[1]
    before, after = x.var(axis=1, ddof=1), y.var(axis=1, ddof=1)
    pooled = (before * (a - 1) + after * (b - 1)) / (a + b - 2) * (1.0 / a + 1.0 / b)
    difference = np.abs(y.mean(axis=1) - x.mean(axis=1))
    return {
        "pooled": difference / np.sqrt(pooled),
        "Welch": difference / np.sqrt(before / a + after / b),
        "known scatter": difference / u,
    }


def drawn(
    rng: np.random.Generator, law: str, layout: tuple[int, int], count: int, shift: float
) -> dict[str, np.ndarray]:
    """The statistics of histories under a law, changed by ``shift`` standard deviations of the difference."""
    days, factor = LAWS[law]
    u = float(np.sqrt((1.0 + 1.0 / RUNS) * (1.0 / layout[0] + 1.0 / layout[1])))
    x, y = (
        scale * (days(rng, count, n) + rng.normal(size=(count, n)) / np.sqrt(RUNS))
        for n, scale in zip(layout, (1.0, factor), strict=True)
    )
    return statistics(x, y + shift * u, u)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--histories", type=int, default=40_000)
    parser.add_argument("--seed", type=int, default=31)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    print("| days | statistic | changed by | independent days | and tails, scatter | and AR 0.6, campaigns |")
    print("| --- | --- | --- | --- | --- | --- |")
    for layout in LAYOUTS:
        empty = {law: drawn(rng, law, layout, options.histories, 0.0) for law in LAWS}
        changed = {size: drawn(rng, "independent", layout, options.histories, size) for size in CHANGES}
        for statistic in empty["independent"]:
            for size, sizes in changed.items():
                seen = []
                for laws in ALLOWED:
                    # Whoever knows the scatter knows that it is three times as large after.
                    those = [law for law in laws if statistic != "known scatter" or law != "3 times after"]
                    limit = max(np.quantile(empty[law][statistic], 0.95) for law in those)
                    seen.append(f"{100.0 * np.mean(sizes[statistic] > limit):.0f}")
                print(f"| {layout[0]}, {layout[1]} | {statistic} | {size:g} u | {' | '.join(seen)} |")


if __name__ == "__main__":
    main()
