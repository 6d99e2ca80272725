"""Power and false alarms of the statistics by simulation, as tables: ``python tests/benchmarks/trial_statistics.py``.

Slow (a minute or two) and no test: the tests enforce the rates, this prints the curves.
"""

from __future__ import annotations

import numpy as np

from monitor.statistics import (
    anova,
    bartlett,
    find_changes,
    kruskal_wallis,
    levene,
    mann_kendall,
    trend,
    welch_anova,
)

SEED = 20261121


def first_order(rng: np.random.Generator, n: int, r: float) -> np.ndarray:
    """Stationary first-order series with innovations of unit variance."""
    e = rng.normal(size=n)
    e[0] /= np.sqrt(1 - r * r)
    for i in range(1, n):
        e[i] += r * e[i - 1]
    return e


def table(title: str, head: list[str], rows: list[list[object]]) -> None:
    """One table in Markdown."""
    print(f"\n## {title}\n")
    print("| " + " | ".join(head) + " |\n|" + " --- |" * len(head))
    for row in rows:
        print("| " + " | ".join(f"{x:.3f}" if isinstance(x, float) else str(x) for x in row) + " |")


def means(rng: np.random.Generator) -> None:
    """Share of 20 000 columns called at 5 %, five days of four runs, by the day component."""
    groups = np.repeat(np.arange(5), 4)
    rows = []
    for ratio in (0.0, 0.5, 1.0, 2.0):
        y = rng.normal(size=(20, 20_000)) + ratio * rng.normal(size=(5, 20_000))[groups]
        rows.append(
            [
                ratio,
                *(float((t(y, groups).p_value < 0.05).mean()) for t in (anova, welch_anova, kruskal_wallis)),
            ]
        )
    table(
        "Equal means, by the day component (in run standard deviations)",
        ["day", "ANOVA", "Welch", "Kruskal-Wallis"],
        rows,
    )


def variances(rng: np.random.Generator) -> None:
    """The same with the scatter of one day larger."""
    groups = np.repeat(np.arange(5), 4)
    rows = []
    for ratio in (1.0, 2.0, 4.0, 8.0):
        y = rng.normal(size=(20, 20_000)) * np.where(groups == 0, ratio, 1.0)[:, None]
        rows.append([ratio, *(float((t(y, groups).p_value < 0.05).mean()) for t in (bartlett, levene))])
    table("Equal variances, by the scatter of one day", ["factor", "Bartlett", "Brown-Forsythe"], rows)


def drifts(rng: np.random.Generator) -> None:
    """Share of histories in which a drift is called at 5 %: 20 days of 4 runs, day component 1."""
    day = np.repeat(np.arange(20), 4)
    t = day + np.tile(0.01 * np.arange(4), 20)
    rows = []
    for slope in (0.0, 0.03, 0.06, 0.1, 0.15):
        weighted = monotone = 0
        for _ in range(400):
            y = slope * t + rng.normal(size=80) + rng.normal(size=20)[day]
            found = trend(y, t, days=day)
            weighted += found.p_value < 0.05
            monotone += found.monotone is not None and found.monotone.p_value < 0.05
        rows.append([slope, weighted / 400, monotone / 400])
    table("Drift a day, 20 days of 4 runs, day component 1", ["slope", "weighted", "Mann-Kendall"], rows)


def monotone(rng: np.random.Generator) -> None:
    """False alarms of Mann-Kendall on trend-free first-order series."""
    rows = []
    for n in (10, 20, 40, 100):
        for r in (0.0, 0.3, 0.6, 0.8):
            found = [mann_kendall(first_order(rng, n, r), np.arange(n)) for _ in range(500)]
            rates = [sum(p < 0.05 for p in ps) / 500 for ps in
                     ([m.p_value for m in found], [m.p_value_independent for m in found])]  # fmt: skip
            rows.append([n, r, *rates])
    table("Mann-Kendall on trend-free series", ["n", "r", "corrected", "plain"], rows)


def changes(rng: np.random.Generator) -> None:
    """Share of histories with any finding, and with the step's interval covering, by its height."""
    rows = []
    for n in (20, 44):
        for r in (0.0, 0.3, 0.6):
            for height in (0.0, 1.0, 2.0, 3.0, 5.0):
                at, called, covered = n * 12 // 20, 0, 0
                # The rows without a step state a rate of a few per cent: they need more histories.
                trials = 150 if height else 1500
                for _ in range(trials):
                    y = first_order(rng, n, r) + height * (np.arange(n) >= at)
                    found = find_changes({"a": y}, np.arange(n), rng=rng, trials=399)
                    called += bool(found.changes or found.trends)
                    covered += any(c.interval[0] <= at - 1 and at <= c.interval[1] for c in found.changes)
                rows.append([n, r, height, called / trials, covered / trials if height else ""])
    table(
        "A step, in innovation standard deviations", ["runs", "r", "height", "called", "covering step"], rows
    )


if __name__ == "__main__":
    for trial in (means, variances, drifts, monotone, changes):
        trial(np.random.default_rng(SEED))
