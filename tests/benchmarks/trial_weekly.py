"""Weekly looks at a fleet: how many notices are false, and how late the true ones come.

``python tests/benchmarks/trial_weekly.py [MACHINES [SEED]]`` prints the tables of docs/trials-statistics.md (numpy;
some five minutes for 1000 machines in the first row, a fifth of them in the others). Each fleet is followed for five
years of weeks; a tenth of its parameters steps once, by 1 to 4 standard deviations, at any week. A notice is false
where nothing changed since the series began (or began anew).

The rival that knows where to look is a CUSUM of that one parameter which knows mean, scatter and the size of the step,
with a limit that a parameter without a step passes within the five years in 5 %.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from monitor.statistics.weekly_looks import WeeklyLooks

PARAMETERS, WEEKS = 13, 260
SIZES = (1.0, 2.0, 3.0, 4.0)
Noise = Callable[[np.random.Generator, tuple[int, int, int]], np.ndarray]


def ar(correlation: np.ndarray | float) -> Noise:
    def noise(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
        x = rng.standard_normal(shape)
        for week in range(1, shape[0]):
            x[week] = correlation * x[week - 1] + np.sqrt(1.0 - np.square(correlation)) * x[week]
        return x

    return noise


def mixed_ar(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    return ar(rng.uniform(0.0, 0.8, shape[1:]))(rng, shape)


def normal(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    return rng.standard_normal(shape)


def student(freedom: float) -> Noise:
    return lambda rng, shape: rng.standard_t(freedom, shape) / np.sqrt(freedom / (freedom - 2.0))


def half_student(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    x, heavy = rng.standard_normal(shape), student(3.0)(rng, shape)
    return np.where(np.arange(shape[1])[:, np.newaxis] % 2 == 0, x, heavy)


def skewed(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    return rng.exponential(1.0, shape) - 1.0


def common(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    return np.sqrt(0.8) * rng.standard_normal((*shape[:2], 1)) + np.sqrt(0.2) * rng.standard_normal(shape)


def days_and_runs(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    """Means of one to five runs of one day each week; days differ as much as runs."""
    runs = rng.integers(1, 6, (*shape[:2], 1))
    return rng.standard_normal(shape) + rng.standard_normal(shape) / np.sqrt(runs)


def rounded(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
    return np.round(rng.standard_normal(shape))


def season(size: float) -> Noise:
    def noise(rng: np.random.Generator, shape: tuple[int, int, int]) -> np.ndarray:
        phase = rng.uniform(0.0, 2.0 * np.pi, shape[1:])
        wave = np.cos(2.0 * np.pi * np.arange(shape[0])[:, None, None] / 52.18 + phase)
        return size * wave + rng.standard_normal(shape)

    return noise


def missing(noise: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A third of the weeks of a machine were not measured; every fourth machine is measured once a month."""
    weeks, machines, _ = noise.shape
    lost = rng.random((weeks, machines)) < 1.0 / 3.0
    monthly = np.arange(machines) % 4 == 0
    lost |= monthly & (np.arange(weeks)[:, np.newaxis] % 4 != 0)
    noise[lost] = np.nan
    return noise


@dataclass
class Fleet:
    """Values (weeks, m, p); where they step: ``at`` (m, p) the week (beyond the end: never), ``size``; what drifts."""

    values: np.ndarray
    at: np.ndarray
    size: np.ndarray
    drifts: np.ndarray | bool = False


def fleet(noise: Noise, machines: int, share: float, rng: np.random.Generator, weeks: int = WEEKS) -> Fleet:
    values = noise(rng, (weeks, machines, PARAMETERS))
    steps = rng.random((machines, PARAMETERS)) < share
    at = np.where(
        steps, rng.integers(26, weeks - 26, (machines, PARAMETERS)) if weeks > 60 else 13, weeks + 1
    )
    size = rng.choice(SIZES, (machines, PARAMETERS)) * rng.choice([-1.0, 1.0], (machines, PARAMETERS))
    for week in range(weeks):
        values[week] += np.where(week >= at, size, 0.0)
    return Fleet(values, at, size)


@dataclass
class Result:
    """Notices of parameters and of vectors, the false ones among them, and delays (m, p) in weeks (inf: never)."""

    parameters: int = 0
    false_parameters: int = 0
    vectors: int = 0
    false_vectors: int = 0
    spent: float = 0.0
    delay: np.ndarray | None = None


def followed(fleet: Fleet) -> Result:
    weeks, machines, p = fleet.values.shape
    looks = WeeklyLooks(np.ones((machines, p), dtype=bool))
    result = Result(delay=np.full((machines, p), np.inf))
    began, vector_began = np.full((machines, p), -1), np.full(machines, -1)
    for week in range(weeks):
        look = looks.look(fleet.values[week])
        stepped = (fleet.at <= week) & (fleet.at > began) | fleet.drifts
        of_vector = ((fleet.at <= week) & (fleet.at > vector_began[:, None]) | fleet.drifts).any(axis=1)
        true = look.parameters & stepped
        result.parameters += int(look.parameters.sum())
        result.false_parameters += int((look.parameters & ~stepped).sum())
        result.vectors += int(look.vectors.sum())
        result.false_vectors += int((look.vectors & ~of_vector).sum())
        first = true & np.isinf(result.delay)
        result.delay[first] = (week - fleet.at + 1)[first]
        began[look.parameters], vector_began[look.vectors] = week, week
    result.spent = looks.spent
    return result


def cusum_limit(size: float, false: float, rng: np.random.Generator, trials: int = 40_000) -> float:
    """Limit that a two-sided CUSUM for ``size`` passes within five years in a share ``false`` where nothing steps."""
    highest, up, down = (np.zeros(trials) for _ in range(3))
    for _ in range(WEEKS):
        score = rng.standard_normal(trials)
        up = np.maximum(up + size * score - 0.5 * size**2, 0.0)
        down = np.maximum(down - size * score - 0.5 * size**2, 0.0)
        highest = np.maximum(highest, np.maximum(up, down))
    return float(np.quantile(highest, 1.0 - false))


def cusum_delay(fleet: Fleet, size: float, limit: float) -> np.ndarray:
    """Delays of the CUSUM of the parameters that step by ``size``, each looked at alone."""
    rows = np.argwhere((np.abs(fleet.size) == size) & (fleet.at < len(fleet.values)))
    delays = []
    for machine, parameter in rows:
        at, chart = fleet.at[machine, parameter], np.zeros(2)
        delay = np.inf
        for week in range(len(fleet.values)):
            score = fleet.values[week, machine, parameter]
            chart = np.maximum(chart + size * np.array([score, -score]) - 0.5 * size**2, 0.0)
            if chart.max() > limit:
                if week >= at:
                    delay = week - at + 1
                    break
                chart[:] = 0.0
        delays.append(delay)
    return np.array(delays)


def upper(false: int, notices: int) -> float:
    """Upper end of the exact one-sided 95 % interval of a share."""
    return float(beta.ppf(0.95, false + 1, notices - false)) if notices > false else 1.0


def row(name: str, result: Result, fleet: Fleet) -> str:
    notices = result.parameters + result.vectors
    false = result.false_parameters + result.false_vectors
    steps = fleet.at < len(fleet.values)
    medians = [
        np.median(result.delay[steps & (np.abs(fleet.size) == size)]) if steps.any() else np.nan
        for size in SIZES
    ]
    medians.append(np.median(result.delay[steps]) if steps.any() else np.nan)
    share = false / notices if notices else 0.0
    in_words = " / ".join("never" if np.isinf(m) else "-" if np.isnan(m) else f"{m:g}" for m in medians)
    return (
        f"| {name} | {result.parameters} ({result.false_parameters}) | {result.vectors} ({result.false_vectors}) | "
        f"{100 * share:.1f} | {100 * upper(false, notices):.1f} | {in_words} |"
    )


def vector_power(rng: np.random.Generator, machines: int = 200, weeks: int = 104, at: int = 78) -> list[str]:
    """Machines with common noise of which a quarter steps in all parameters, in a random direction of their covariance.

    ``length`` is that of the step in standard deviations of the vector; noticed within half a year.
    """
    lines = []
    for correlation, length in ((0.8, 2.5), (0.8, 3.0), (0.8, 3.5), (0.8, 4.0), (0.0, 2.5), (0.0, 3.0)):
        covariance = correlation + (1.0 - correlation) * np.eye(PARAMETERS)
        root = np.linalg.cholesky(covariance)
        noise = rng.standard_normal((weeks, machines, PARAMETERS)) @ root.T
        direction = rng.standard_normal((machines, PARAMETERS))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        stepped = np.arange(machines) % 4 == 0
        noise[at:, stepped] += length * (direction @ root.T)[stepped]
        looks = WeeklyLooks(np.ones((machines, PARAMETERS), dtype=bool))
        single, vector, false = (np.zeros(machines, dtype=bool) for _ in range(3))
        for week in range(weeks):
            look = looks.look(noise[week])
            false |= (look.parameters.any(axis=1) | look.vectors) & (~stepped | (week < at))
            if week >= at:
                single |= look.parameters.any(axis=1)
                vector |= look.vectors
        shares = (100 * noticed[stepped].mean() for noticed in (single, vector, single | vector))
        in_words = " | ".join(f"{share:.0f}" for share in shares)
        lines.append(f"| {correlation:g} | {length:g} | {in_words} | {false.sum()} |")
    return lines


CASES: tuple[tuple[str, Noise], ...] = (
    ("normal", normal),
    ("parameters that share noise (correlation 0.8)", common),
    ("Student, 5 degrees of freedom", student(5.0)),
    ("Student, 3", student(3.0)),
    ("half of the machines Student, 3", half_student),
    ("exponential", skewed),
    ("weeks correlated by 0.3", ar(0.3)),
    ("weeks correlated by 0.6", ar(0.6)),
    ("weeks correlated by 0 to 0.8, each its own", mixed_ar),
    ("one to five runs of a day that differs", days_and_runs),
    ("rounded to one standard deviation", rounded),
    ("a third of the weeks missing, a quarter monthly", lambda rng, shape: missing(normal(rng, shape), rng)),
    ("the same, correlated by 0.6", lambda rng, shape: missing(ar(0.6)(rng, shape), rng)),
    ("a year's wave of 0.5 standard deviations", season(0.5)),
    ("a year's wave of 1", season(1.0)),
)


def main() -> None:
    machines = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 20261122)
    print(
        "| noise | parameters noticed (false) | machines (false) | false, % | at most | weeks to 1, 2, 3, 4, all |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for number, (name, noise) in enumerate(CASES):
        of_fleet = fleet(noise, machines if number == 0 else max(machines // 5, 20), 0.1, rng)
        result = followed(of_fleet)
        print(row(name, result, of_fleet), flush=True)
        if number == 0:
            # In 5 % a false alarm; and as few as a twentieth of all alarms, as the looks have them.
            for false in (0.05, 0.05 / 0.95 * 0.1):
                limits = [cusum_limit(size, false, rng) for size in SIZES]
                rivals = [
                    cusum_delay(of_fleet, size, limit) for size, limit in zip(SIZES, limits, strict=True)
                ]
                medians = [float(np.median(delays)) for delays in (*rivals, np.concatenate(rivals))]
                print(f"CUSUM that knows where to look, false in {100 * false:.2g} %: {medians}", flush=True)
    for share in (0.02, 0.05, 0.2):
        of_fleet = fleet(normal, max(machines // 5, 20), share, rng)
        print(
            row(f"normal, {100 * share:g} % of the parameters step", followed(of_fleet), of_fleet), flush=True
        )
    for weeks in (13, 26):
        of_fleet = fleet(normal, max(machines // 5, 20), 0.0, rng, weeks)
        print(row(f"nothing steps, the first {weeks} weeks", followed(of_fleet), of_fleet), flush=True)
    for name, noise in (("normal", normal), ("Student, 3", student(3.0)), ("correlated by 0.6", ar(0.6))):
        fleets = [followed(fleet(noise, 20, 0.0, rng)) for _ in range(max(machines // 25, 4))]
        wrong = sum(result.parameters + result.vectors > 0 for result in fleets)
        print(
            f"nothing steps, 20 machines, five years, {name}: a notice in {wrong} of {len(fleets)} fleets",
            flush=True,
        )
    drift = fleet(normal, max(machines // 5, 20), 0.0, rng)
    drift.values[:] += 0.02 * np.arange(WEEKS)[:, None, None] * (np.arange(PARAMETERS) == 0)
    drift.drifts = np.zeros((drift.values.shape[1], PARAMETERS), dtype=bool)
    drift.drifts[:, 0] = True
    print(
        row("one parameter of each machine drifts by one standard deviation a year", followed(drift), drift)
    )
    print(
        "| correlation | length | noticed by parameters, % | as a vector | either | machines with a false notice |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    print("\n".join(vector_power(rng)))


if __name__ == "__main__":
    main()
