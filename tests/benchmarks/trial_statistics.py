"""Power and false alarms of the statistics by simulation, as tables: ``python tests/benchmarks/trial_statistics.py``.

Slow (a minute or two) and no test: the tests enforce the rates, this prints the curves.
"""

from __future__ import annotations

import numpy as np

from monitor.statistics import (
    ErrorVectors,
    JointSeries,
    anova,
    backtest_longest,
    bartlett,
    find_changes,
    kruskal_wallis,
    levene,
    mann_kendall,
    welch_anova,
)
from monitor.statistics.scan import Scanner
from monitor.statistics.trend import trend

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
    for n in (6, 10, 20, 40, 100):
        for r in (0.0, 0.3, 0.6, 0.8):
            found = [mann_kendall(first_order(rng, n, r), np.arange(n)) for _ in range(1000)]
            rates = [sum(p < 0.05 for p in ps) / 1000 for ps in
                     ([m.p_value for m in found], [m.p_value_independent for m in found])]  # fmt: skip
            rows.append([n, r, *rates])
    table("Mann-Kendall on trend-free series", ["n", "r", "corrected", "plain"], rows)


def shares(scanner: Scanner, series: list[np.ndarray], rng: np.random.Generator) -> tuple[float, float]:
    """Share of series with any finding, as for one parameter and as for each of 13, at 5 % in all."""
    # The search ends as soon as one family of correlations does not reach the level: a level, a search.
    found = [
        np.mean([scanner.scan(y, rng, 3999, level).p_value <= level for y in series])
        for level in (0.05, 0.05 / 13)
    ]
    return float(found[0]), float(found[1])


def false_alarms(rng: np.random.Generator) -> None:
    """Share of histories without a change in which one is called."""
    rows = []
    for n in (12, 20, 44, 100, 200):
        trials = 2000 if n < 100 else 800
        t = np.arange(n, dtype=float)
        plain = Scanner(t, None, "constant")
        for r in (0.0, 0.3, 0.6, 0.8):
            found = shares(plain, [first_order(rng, n, r) for _ in range(trials)], rng)
            rows.append([n, f"r = {r:g}", trials, *found])
        u = np.exp(0.5 * rng.normal(size=n))
        weighted = Scanner(t, u, "constant")
        found = shares(weighted, [u * rng.normal(size=n) for _ in range(trials)], rng)
        rows.append([n, "uncertainties of 1 : 4", trials, *found])
        found = shares(weighted, [u * first_order(rng, n, 0.6) for _ in range(trials)], rng)
        rows.append([n, "the same, r = 0.6", trials, *found])
        found = shares(plain, [rng.standard_t(4, size=n) for _ in range(trials)], rng)
        rows.append([n, "Student, 4 degrees of freedom", trials, *found])
    head = ["runs", "without a change", "histories", "one parameter", "one of 13 (nominal 0.0038)"]
    table("Changes called where there is none, nominal 5 %", head, rows)


def day_alarms(rng: np.random.Generator) -> None:
    """The same for histories whose days differ."""
    rows = []
    for days, runs in ((5, 4), (6, 3), (10, 4)):
        n, day = days * runs, np.repeat(np.arange(days), runs)
        scanner = Scanner(np.arange(n, dtype=float), None, "constant", day)
        for component in (0.0, 0.5, 1.0, 2.0):
            series = [rng.normal(size=n) + component * rng.normal(size=days)[day] for _ in range(1000)]
            found = shares(scanner, series, rng)
            rows.append([n, f"{days} days of {runs}, day component {component:g}", 1000, *found])
    head = ["runs", "without a change", "histories", "one parameter", "one of 13 (nominal 0.0038)"]
    table("Changes called where only the days differ, nominal 5 %", head, rows)


def day_steps(rng: np.random.Generator) -> None:
    """Share of histories of a few days with any finding, by the height of a step between two days."""
    rows = []
    for days, runs, at in ((4, 5, 2), (5, 4, 3), (10, 4, 6)):
        n, day = days * runs, np.repeat(np.arange(days), runs)
        scanner = Scanner(np.arange(n, dtype=float), None, "constant", day)
        for height in (2.0, 3.0, 5.0, 10.0, 20.0):
            series = [rng.normal(size=n) + height * (day >= at) for _ in range(400)]
            rows.append([f"{days} days of {runs}, step after {at}", height, *shares(scanner, series, rng)])
    head = ["history", "height", "one parameter", "one of 13"]
    table("A step between days that are alike otherwise, in standard deviations of a run", head, rows)


def shared_days(rng: np.random.Generator) -> None:
    """Histories of 13 parameters: share with any finding where only the days differ, and with the step found."""
    rows = []
    for days, runs in ((4, 5), (5, 4), (10, 4)):
        n, day = days * runs, np.repeat(np.arange(days), runs)
        for text, wide, component in (
            ("none", 0, 0.0),
            ("1 in all", 13, 1.0),
            ("2 in all", 13, 2.0),
            ("4 in all", 13, 4.0),
            ("2 in six", 6, 2.0),
            ("2 in one", 1, 2.0),
        ):
            for height, stepping in ((0.0, 0), (10.0, 1), (10.0, 13)):
                if height and component > 1.0:
                    continue
                hits = 0
                for _ in range(200):
                    y = rng.normal(size=(n, 13)) + height * (
                        (day >= days - 2)[:, None] & (np.arange(13) < stepping)
                    )
                    y[:, :wide] += component * rng.normal(size=(days, wide))[day]
                    found = find_changes(
                        {str(i): y[:, i] for i in range(13)}, np.arange(n, dtype=float), days=day, rng=rng
                    )
                    names = {one.parameter for one in (*found.changes, *found.trends)}
                    hits += "0" in names if height else bool(names)
                step = f"{height:g} in {stepping}, two days before the end" if height else "none"
                rows.append([f"{days} days of {runs}", text, step, hits / 200])
    head = ["history", "day component", "step", "called (of a step: in the first parameter)"]
    table("Thirteen parameters together, nominal 5 %, in standard deviations of a run", head, rows)


def volumetric(rng: np.random.Generator) -> None:
    """Held-out days of the longest of eight vectors of six drifting parameters in their 95 % interval."""
    rows = []
    for days, runs, component in ((12, 4, 1.0), (24, 3, 1.0), (60, 3, 1.0), (60, 3, 0.0)):
        made = inside = 0
        day = np.repeat(np.arange(days), runs)
        t = 7.0 * day + np.tile(0.05 * np.arange(runs), days)
        for _ in range(150):
            mix = np.linalg.cholesky(0.5 * np.eye(6) + 0.5)
            line = rng.normal(5.0, 3.0, size=6) + rng.normal(0.0, 0.02, size=6) * t[:, np.newaxis]
            y = line + component * (rng.normal(size=(days, 6)) @ mix.T)[day] + rng.normal(size=(len(t), 6))
            found = backtest_longest(
                JointSeries(y, t, day),
                lambda column, keep, y=y, t=t, day=day: trend(y[keep, column], t[keep], days=day[keep]),
                ErrorVectors(rng.normal(size=(8, 3, 6)), np.zeros((8, 3))), rng=rng, foretold=3, draws=1000,
            )  # fmt: skip
            made, inside = made + found.forecasts, inside + found.covered
        rows.append([days, runs, component, made, inside / made])
    head = ["days", "runs", "day component", "forecasts", "inside"]
    table("Forecasts of the volumetric error in their 95 % interval", head, rows)


def changes(rng: np.random.Generator) -> None:
    """Share of histories with any finding, by the height of a step after three fifths of the runs."""
    rows = []
    for n in (12, 20, 44, 100):
        scanner = Scanner(np.arange(n, dtype=float), None, "constant")
        for r in (0.0, 0.3, 0.6):
            for height in (1.0, 2.0, 3.0, 5.0, 8.0):
                step = height * (np.arange(n) >= n * 12 // 20)
                series = [first_order(rng, n, r) + step for _ in range(400)]
                rows.append([n, r, height, *shares(scanner, series, rng)])
    table(
        "A step, in innovation standard deviations",
        ["runs", "r", "height", "one parameter", "one of 13"],
        rows,
    )


if __name__ == "__main__":
    for trial in (
        means,
        variances,
        drifts,
        monotone,
        false_alarms,
        day_alarms,
        day_steps,
        shared_days,
        volumetric,
        changes,
    ):
        trial(np.random.default_rng(SEED))
