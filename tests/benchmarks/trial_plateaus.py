"""How often a change that was put right again is found, and how often one that is none: with and without the search.

``python tests/benchmarks/trial_plateaus.py [SERIES]`` prints the tables of docs/trials-statistics.md, paired: the same
series, searched for one change alone and for plateaus as well, at 1 % a series. ``... machines [MACHINES]`` asks as
``trend`` does: thirteen parameters share 1 %. ``... ends [SERIES]`` prints how far the sizes of both ends are off, in
their u, beside a drift and a season.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
import scipy

from monitor.statistics import changes

SEED, LEVEL, YEAR = 20261128, 0.01, 365.25
WEEKS = (16, 26, 35, 52, 104)
NOISES = (
    "normal", "AR 0.3", "AR 0.6", "AR 0.8", "Student 3", "exponential", "drift of 4", "drift of 4, AR 0.6",
    "drift of 16", "season of 1", "season of 2", "season of 4", "season of 2, AR 0.6", "walk of 0.3", "two scatters",
)  # fmt: skip
#: Noise, weeks, length and height of the plateaus.
PLATEAUS = (
    ("normal", 35, 11, 3.0), ("normal", 35, 11, 5.0), ("normal", 35, 11, 10.0), ("normal", 52, 11, 5.0),
    ("normal", 52, 25, 5.0), ("normal", 104, 11, 5.0), ("normal", 35, 4, 5.0), ("normal", 35, 4, 10.0),
    ("AR 0.6", 35, 11, 5.0), ("AR 0.6", 35, 11, 10.0), ("AR 0.6", 52, 11, 10.0), ("Student 3", 35, 11, 10.0),
    ("season of 2", 52, 11, 10.0), ("drift of 4", 52, 11, 10.0),
)  # fmt: skip


def noise(kind: str, weeks: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Series (count, weeks) without a step; scatter 1, drifts over the whole history."""
    draws = rng.standard_normal((count, weeks))
    if "AR" in kind:
        r = float(kind.split("AR ")[1])
        for week in range(1, weeks):
            draws[:, week] = r * draws[:, week - 1] + np.sqrt(1.0 - r * r) * draws[:, week]
    if kind == "Student 3":
        draws = rng.standard_t(3, (count, weeks)) / np.sqrt(3.0)
    if kind == "exponential":
        draws = rng.exponential(size=(count, weeks))
    if kind == "two scatters":
        draws[:, weeks // 2 :] *= 2.0
    if kind.startswith("walk of"):
        draws += np.cumsum(float(kind[8:]) * rng.standard_normal((count, weeks)), axis=1)
    amount = float(kind.split(",")[0].split()[-1]) if kind.startswith(("drift", "season")) else 0.0
    if kind.startswith("drift"):
        draws += amount * np.linspace(0.0, 1.0, weeks)
    if kind.startswith("season"):
        start = rng.uniform(0.0, 2.0 * np.pi, (count, 1))
        draws += amount * np.cos(2.0 * np.pi * 7.0 * np.arange(weeks) / YEAR + start)
    return draws


def found(
    series: np.ndarray, with_plateaus: bool, level: float = LEVEL, trials: int = 1999
) -> list[tuple[list[int], bool]]:
    """Of each series the steps and bends that are found, and whether a drift or transient is."""
    times = 7.0 * np.arange(series.shape[1])
    parts = [(changes._Series(str(i), y, times, None, None, YEAR), 0) for i, y in enumerate(series)]
    search = changes._Search(np.random.default_rng(SEED), trials, with_plateaus)
    steps, trends = search.pieces(parts, level)
    at: dict[str, list[int]] = {}
    for step in steps:
        at.setdefault(step.parameter, []).append(step.index)
    moving = {trend.parameter for trend in trends}
    return [(sorted(at.get(str(i), [])), str(i) in moving) for i in range(len(series))]


def rate(hits: Sequence[bool]) -> str:
    """Return the rate in %, with its exact 95 % interval."""
    k, n = sum(hits), len(hits)
    low = scipy.stats.beta.ppf(0.025, k, n - k + 1) if k else 0.0
    high = scipy.stats.beta.ppf(0.975, k + 1, n - k) if k < n else 1.0
    return f"{100 * k / n:.1f} ({100 * low:.1f} to {100 * high:.1f})"


def false_rates(count: int) -> None:
    """Print how many series without a step have one (or a bend), or any finding: without plateaus and with them."""
    print(
        "| noise | weeks | steps, % | with plateaus | any finding | with plateaus | only with | only without |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for kind in NOISES:
        for weeks in WEEKS:
            series = noise(kind, weeks, count, np.random.default_rng([SEED, weeks, NOISES.index(kind)]))
            old, new = found(series, False), found(series, True)
            either = [(bool(a[0] or a[1]), bool(b[0] or b[1])) for a, b in zip(old, new, strict=True)]
            print(
                f"| {kind} | {weeks} | {rate([bool(a[0]) for a in old])} | {rate([bool(b[0]) for b in new])} |"
                f" {rate([a for a, _ in either])} | {rate([b for _, b in either])} |"
                f" {sum(b and not a for a, b in either)} | {sum(a and not b for a, b in either)} |",
                flush=True,
            )


def power(count: int) -> None:
    """Print how often both ends of a plateau are found, each within a week, and how often a single step is."""
    print("\n| noise | weeks | plateau of | height | both ends, % | with plateaus |")
    print("| --- | --- | --- | --- | --- | --- |")
    for row, (kind, weeks, length, height) in enumerate(PLATEAUS):
        rng = np.random.default_rng([SEED, row])
        series = noise(kind, weeks, count, rng)
        start = rng.integers(4, weeks - length - 3, count)
        week = np.arange(weeks)
        series += height * ((week >= start[:, None]) & (week < start[:, None] + length))
        cells = []
        for with_plateaus in (False, True):
            hits = [
                all(min((abs(place - end) for place in steps), default=9) <= 1 for end in (at, at + length))
                for (steps, _), at in zip(found(series, with_plateaus), start, strict=True)
            ]
            cells.append(rate(hits))
        print(f"| {kind} | {weeks} | {length} | {height:g} | {cells[0]} | {cells[1]} |", flush=True)
    print("\n| noise | weeks | single step | found, % | with plateaus | only with | only without |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row, (kind, weeks, height) in enumerate(
        (("normal", 35, 2.0), ("normal", 52, 2.0), ("normal", 52, 3.0), ("AR 0.6", 52, 5.0), ("season of 2", 52, 5.0))
    ):  # fmt: skip
        rng = np.random.default_rng([SEED, 100 + row])
        series = noise(kind, weeks, count, rng)
        start = rng.integers(4, weeks - 3, count)
        series += height * (np.arange(weeks) >= start[:, None])
        old, new = (
            [
                any(abs(place - at) <= 2 for place in steps)
                for (steps, _), at in zip(found(series, with_plateaus), start, strict=True)
            ]
            for with_plateaus in (False, True)
        )
        only = (
            sum(b and not a for a, b in zip(old, new, strict=True)),
            sum(a and not b for a, b in zip(old, new, strict=True)),
        )
        print(
            f"| {kind} | {weeks} | {height:g} | {rate(old)} | {rate(new)} | {only[0]} | {only[1]} |",
            flush=True,
        )


def machines(count: int) -> None:
    """Print the share of machines of thirteen steady parameters of which any is said to have changed."""
    print("| noise | weeks | machines | any finding, % | with plateaus |")
    print("| --- | --- | --- | --- | --- |")
    for kind, weeks in (("normal", 35), ("normal", 52), ("AR 0.6", 35), ("AR 0.8", 35), ("Student 3", 52)):
        rng = np.random.default_rng([SEED, weeks, NOISES.index(kind), 13])
        series = noise(kind, weeks, 13 * count, rng)
        cells = []
        for with_plateaus in (False, True):
            hits = [bool(steps or moves) for steps, moves in found(series, with_plateaus, LEVEL / 13, 6500)]
            cells.append([any(hits[13 * i : 13 * i + 13]) for i in range(count)])
        print(f"| {kind} | {weeks} | {count} | {rate(cells[0])} | {rate(cells[1])} |", flush=True)


def ends(count: int) -> None:
    """Print how far the sizes of the ends of a plateau of 15 in weeks 10 to 20 of 30 are off, in their u."""
    print("| beside | both found | mean, first | last | beyond 2 u, % | last | median u |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row, (drift, season) in enumerate(((0.0, 0.0), (3.0, 0.0), (12.0, 0.0), (0.0, 1.0), (0.0, 3.0))):
        rng = np.random.default_rng([SEED, 200 + row])
        week = np.arange(30)
        off, u = [], []
        for _ in range(count):
            wave = season * np.cos(2.0 * np.pi * 7.0 / YEAR * week + rng.uniform(0.0, 2.0 * np.pi))
            y = rng.normal(size=30) + 15.0 * ((week >= 10) & (week < 20)) + drift * week / 30.0 + wave
            history = changes.find_changes(
                {"y": y}, 7.0 * week, rng=np.random.default_rng(1), cycle=YEAR, false_alarm=LEVEL
            )
            step = {change.index: change for change in history.changes if change.kind == "step"}
            if {10, 20} <= set(step):
                off.append([(step[10].size - 15.0) / step[10].u, (step[20].size + 15.0) / step[20].u])
                u.append(step[10].u)
        mean, far = np.mean(off, axis=0), 100.0 * np.mean(np.abs(off) > 2.0, axis=0)
        print(
            f"| drift of {drift:g}, season of {season:g} | {len(off)} of {count} | {mean[0]:.2f} | {mean[1]:.2f} | "
            f"{far[0]:.0f} | {far[1]:.0f} | {np.median(u):.2f} |",
            flush=True,
        )


def main() -> None:
    arguments = sys.argv[1:]
    if arguments[:1] == ["ends"]:
        ends(int(arguments[1]) if len(arguments) > 1 else 100)
        return
    if arguments[:1] == ["machines"]:
        machines(int(arguments[1]) if len(arguments) > 1 else 400)
        return
    count = int(arguments[0]) if arguments else 2000
    false_rates(count)
    power(count // 5)


if __name__ == "__main__":
    main()
