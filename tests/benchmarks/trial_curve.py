"""How often the search over curves is wrong, and how often it finds what is there: simulated curves over many seeds.

    python tests/benchmarks/trial_curve.py --nulls 200 --seeds 40 > docs/trials-curve.md

Takes some fifteen minutes on one core. The noise is made here, the product has no part in it; every scene has seeds of
its own.
"""

from __future__ import annotations

import argparse
import datetime
import sys
import time
import zlib
from collections.abc import Callable

import numpy as np

from monitor.discovery.curve.explain import explain_curve
from monitor.methods.curve.problem import problem_of
from monitor.records import CurveCampaign, Instrument

Rows = np.ndarray


def curve(
    base: str, columns: dict[str, Rows], groups: dict[str, Rows] | None = None, time_: str | None = None
) -> CurveCampaign:
    n = len(columns["y"])
    return CurveCampaign(
        "trial", "curve", Instrument("trial"), "y", base, columns, groups or {}, dict.fromkeys(columns, ""), time_,
        np.arange(2, n + 2),
    )  # fmt: skip


def correlated(rng: np.random.Generator, n: int, phi: float, independent: float = 0.0) -> Rows:
    """Unit variance: a first-order process, and a share of independent noise."""
    slow = np.empty(n)
    slow[0] = rng.normal()
    for row in range(1, n):
        slow[row] = phi * slow[row - 1] + np.sqrt(1.0 - phi**2) * rng.normal()
    return np.sqrt(1.0 - independent) * slow + np.sqrt(independent) * rng.normal(size=n)


def series(
    n: int, noise: Callable[[np.random.Generator, int], Rows]
) -> Callable[[np.random.Generator], CurveCampaign]:
    return lambda rng: curve("y ~ 1", {"y": noise(rng, n)})


def calibration(
    n: int, noise: Callable[[np.random.Generator, int], Rows]
) -> Callable[[np.random.Generator], CurveCampaign]:
    """A line over eleven loads in random order, with a temperature and three operators that do nothing."""

    def made(rng: np.random.Generator) -> CurveCampaign:
        load = rng.permutation(np.resize(np.linspace(0.0, 10.0, 11), n))
        return curve(
            "y ~ 1 + load",
            {
                "y": 2.0 + 3.0 * load + noise(rng, n),
                "load": load,
                "temperature_degC": 20.0 + rng.normal(size=n),
            },
            {"operator": np.array(["a", "b", "c"])[rng.integers(0, 3, n)]},
        )

    return made


def white(rng: np.random.Generator, n: int) -> Rows:
    return rng.normal(size=n)


NULLS: dict[str, Callable[[np.random.Generator], CurveCampaign]] = {
    "series of 50, independent": series(50, white),
    "series of 200, independent": series(200, white),
    "series of 400, independent": series(400, white),
    "series of 200, uniform": series(200, lambda rng, n: rng.uniform(size=n)),
    "series of 200, rounded to 1 sigma": series(200, lambda rng, n: np.round(rng.normal(size=n))),
    "calibration of 22 rows": calibration(22, white),
    "calibration of 66 rows": calibration(66, white),
    "series of 50, correlation 0.6": series(50, lambda rng, n: correlated(rng, n, 0.6)),
    "series of 200, correlation 0.3": series(200, lambda rng, n: correlated(rng, n, 0.3)),
    "series of 200, correlation 0.6": series(200, lambda rng, n: correlated(rng, n, 0.6)),
    "series of 200, correlation 0.9": series(200, lambda rng, n: correlated(rng, n, 0.9)),
    "series of 200, slow 0.95 and 60 % independent": series(200, lambda rng, n: correlated(rng, n, 0.95, 0.6)),
    "calibration of 66 rows, correlation 0.6": calibration(66, lambda rng, n: correlated(rng, n, 0.6)),
}  # fmt: skip


def hidden(
    shape: Callable[[Rows], Rows], size: float, n: int, phi: float
) -> Callable[[np.random.Generator], CurveCampaign]:
    """A series with an effect of so many standard deviations of the noise."""

    def made(rng: np.random.Generator) -> CurveCampaign:
        t = np.arange(n) / (n - 1.0)
        return curve("y ~ 1", {"y": size * shape(t) + correlated(rng, n, phi)})

    return made


SHAPES: dict[str, tuple[Callable[[Rows], Rows], tuple[str, ...]]] = {
    "drift": (lambda t: 2.0 * t - 1.0, ("drift",)),
    "poly2": (lambda t: (2.0 * t - 1.0) ** 2 * 1.5 - 0.5, ("poly2",)),
    "sin, 7.3 periods": (lambda t: np.sin(2.0 * np.pi * 7.3 * t), ("sin",)),
    "exp, a tenth of the range": (lambda t: 2.0 * np.exp(-10.0 * t), ("exp",)),
    "step at 40 %": (lambda t: np.where(t > 0.4, 1.0, -1.0), ("step",)),
}


def rate(count: int, of: int) -> str:
    return f"{count} of {of}"


def generator(scene: str, seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, zlib.crc32(scene.encode())])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--nulls", type=int, default=200, help="curves a scene with nothing hidden")
    parser.add_argument("--seeds", type=int, default=40, help="curves for each hidden effect, size and noise")
    options = parser.parse_args()
    begun = time.perf_counter()
    print("# Trial: curves with and without a missing effect\n")
    print(
        f"Made by `tests/benchmarks/trial_curve.py --nulls {options.nulls} --seeds {options.seeds}` on "
        f"{datetime.date.today()}; every number is a count of simulated curves.\n"
    )
    print(
        "## Nothing hidden\n\nAn effect that is told here is a false alarm; so is an outlier. *likely* counts the "
        "curves of which the answer says that an effect is likely, not certain, and how often noise alone would do.\n"
    )
    print("| noise | found | likely | an outlier was told |\n| --- | --- | --- | --- |")
    totals: dict[bool, list[int]] = {False: [0, 0, 0], True: [0, 0, 0]}
    for name, make in NULLS.items():
        found = likely = readings = 0
        for seed in range(options.nulls):
            told = explain_curve(problem_of(make(generator(name, seed))))
            found += any(one.certain for one in told.missing)
            likely += bool(told.missing) and not any(one.certain for one in told.missing)
            readings += bool(told.suspect)
        total = totals["correlation" in name or "slow" in name]
        for place, count in enumerate((options.nulls, found, likely)):
            total[place] += count
        cells = (rate(count, options.nulls) for count in (found, likely, readings))
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    for slow, (curves, found, likely) in totals.items():
        print(
            f"\nOver {'correlated' if slow else 'independent'} noise: found {found} of {curves} "
            f"({found / curves:.1%}), likely {likely} ({likely / curves:.1%})."
        )
    print(
        "\n## One effect hidden\n\nSeries of 120 rows; the size is the amplitude over the standard deviation of the "
        "noise. *right* says that the first effect told has the right shape, *told* that any was.\n"
    )
    print(
        "| effect | size | independent: right (told) | correlation 0.5: right (told) |\n| --- | --- | --- | --- |"
    )
    for name, (shape, right) in SHAPES.items():
        for size in (0.5, 1.0, 2.0):
            cells = []
            for phi in (0.0, 0.5):
                good = told = 0
                for seed in range(options.seeds):
                    rng = generator(f"{name} {size} {phi}", seed)
                    missing = explain_curve(problem_of(hidden(shape, size, 120, phi)(rng))).missing
                    told += bool(missing)
                    good += bool(missing) and missing[0].fitted.shape in right
                cells.append(f"{good} ({told}) of {options.seeds}")
            print(f"| {name} | {size} | {' | '.join(cells)} |", flush=True)
    print(f"\n{time.perf_counter() - begun:.0f} s.", file=sys.stderr)


if __name__ == "__main__":
    main()
