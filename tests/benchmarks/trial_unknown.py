"""Trial of `explain` beyond its catalogue: shapes that it does not have, and noise that is not white.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_unknown.py --seeds 3 --empties 300

Prints two tables with exact intervals. ``shapes``: an error of one of twenty families outside the catalogue is hidden;
right is an answer that names its error alone (a product of two axes: the error of either); beside it stands in how many
of these campaigns tests that know more find it (their power), each at 1 % of empty campaigns: of the true curve on all
error motions, on the right one, and of a curve with one more unknown (its phase, place or time constant) on all.
``empty``: nothing is hidden in noise that depends on its neighbours, walks, is offset by days, has heavy tails or is
rounded; right is no effect.
Everything hidden stems from tests/simulator, which shares no code with the package.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load, simulator as simulator_of

from monitor.discovery import explain
from monitor.discovery.machine.fit import fit
from monitor.machine import MOTION, parse_term
from monitor.methods.chain.least_squares import project_out
from monitor.methods.samba.method import problem_of

ROOT = Path(__file__).resolve().parents[2]
simulator = simulator_of()
virtual_campaigns = load("virtual_campaigns", ROOT / "tests" / "discovery" / "virtual.py")
interval = load("trial_discovery", ROOT / "tests" / "benchmarks" / "trial_discovery.py").interval
Curve = Callable[[np.ndarray, np.ndarray, Any], np.ndarray]


def since_reversal(q: np.ndarray, travel: np.ndarray, now: Any) -> np.ndarray:
    """The way (N,) since the last reversal, from zero at the begin of a run."""
    way = np.zeros(len(q))
    for row in range(len(q)):
        first = row == 0 or now.run[row] != now.run[row - 1]
        step = abs(q[row] - (0.0 if first else q[row - 1]))
        way[row] = step if first or travel[row] != travel[row - 1] else way[row - 1] + step
    return way


def play(length: float) -> Curve:
    """A backlash that builds up over a length."""
    return lambda q, t, now: t * (1 - 2 * np.exp(-since_reversal(q, t, now) / length))


def late(tau_s: float) -> Curve:
    """A gain that follows a temperature with one time constant, in steps of 5 s; settled at the begin of a day."""

    def curve(q: np.ndarray, travel: np.ndarray, now: Any) -> np.ndarray:
        temperature, time_s = now.channels["x_axis_degC"] - 20.0, now.since_first_run_s
        follows = temperature.copy()
        for row in range(1, len(q)):
            if time_s[row] < time_s[row - 1]:
                continue
            steps = max(int((time_s[row] - time_s[row - 1]) / 5.0), 1)
            value, step = follows[row - 1], (time_s[row] - time_s[row - 1]) / steps
            change = temperature[row] - temperature[row - 1]
            for index in range(steps):
                value += step / tau_s * (temperature[row - 1] + change * (index + 0.5) / steps - value)
            follows[row] = value
        return q / 100.0 * follows

    return curve


#: Families by name: the errors that are right, the effect that is hidden, its curve.
FAMILIES: dict[str, tuple[tuple[str, ...], str, Curve]] = {
    "play over 10 mm": (("EXX",), "EXX:curve", play(10.0)),
    "play over 40 mm": (("EXX",), "EXX:curve", play(40.0)),
    "play of Y over 25 mm": (("EYY",), "EYY:curve", play(25.0)),
    "dead zone": (("EZZ",), "EZZ:curve", lambda q, t, now: t * (since_reversal(q, t, now) > 15.0)),
    "stick-slip": (("EYY",), "EYY:curve", lambda q, t, now: t * np.exp(-since_reversal(q, t, now) / 20.0)),
    "hysteresis that grows with the way": (("EXX",), "EXX:curve", lambda q, t, now: t * np.abs(q) / 100.0),
    "hysteresis across": (("EYX",), "EYX:curve", lambda q, t, now: t * q / 100.0),
    "wear bump": (("EYX",), "EYX:curve", lambda q, t, now: np.exp(-(((q - 30.0) / 25.0) ** 2))),
    "wear of a scale": (("EZZ",), "EZZ:curve", lambda q, t, now: np.exp(-(((q - q.mean()) / 30.0) ** 2))),
    "step in a scale": (("EXX",), "EXX:curve", lambda q, t, now: np.tanh((q - 12.0) / 4.0)),
    "kink of a guideway": (("EYX",), "EYX:curve", lambda q, t, now: np.maximum(q, 0.0) / 100.0),
    "joint of two rails": (("EAZ",), "EAZ:curve", lambda q, t, now: np.tanh((q - np.median(q)) / 10.0)),
    "fifth harmonic of C": (("ECC",), "ECC:curve", lambda q, t, now: np.cos(5 * q + 0.7)),
    "sixth harmonic of C, radial": (("EXC",), "EXC:curve", lambda q, t, now: np.cos(6 * q + 0.3)),
    "seventh harmonic of B": (("EBB",), "EBB:curve", lambda q, t, now: np.cos(7 * q + 1.0)),
    "eighth harmonic of C": (("ECC",), "ECC:curve", lambda q, t, now: np.cos(8 * q + 0.4)),
    "sawtooth of a gear": (("ECC",), "ECC:curve", lambda q, t, now: (5 * q / (2 * np.pi)) % 1.0 - 0.5),
    "X times B": (("EXX", "EXB"), "EXX:curve", lambda q, t, now: q * now.angles["B"] / 100.0),
    "two time constants": (
        ("EZC1",),
        "EZC1:curve",
        lambda q, t, now: (
            2.0 - np.exp(-now.since_first_run_s / 900.0) - np.exp(-now.since_first_run_s / 9000.0)
        ),
    ),
    "lag behind a temperature": (("EXX",), "EXX:curve", late(1500.0)),
}


# More seeds than anyone asks for of one family.
SEEDS_APART = 1000


def autoregressive(rho: float) -> Callable[[np.random.Generator, np.ndarray], np.ndarray]:
    """Noise whose neighbours in a run have the correlation rho."""

    def noise(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
        fresh = rng.standard_normal((len(run), 3))
        values = fresh.copy()
        for row in range(1, len(run)):
            if run[row] == run[row - 1]:
                values[row] = rho * values[row - 1] + np.sqrt(1 - rho**2) * fresh[row]
        return values

    return noise


def walk(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
    """A random walk of 0.25 a reading in every run, and independent noise of 0.7."""
    steps = 0.25 * rng.standard_normal((len(run), 3))
    values = np.zeros((len(run), 3))
    for number in np.unique(run):
        values[run == number] = np.cumsum(steps[run == number], axis=0)
    return values + 0.7 * rng.standard_normal((len(run), 3))


def of_days(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
    """Independent noise, and an offset of every axis that four runs have in common."""
    day = (run - 1) // 4
    return 0.7 * rng.standard_normal((len(run), 3)) + rng.standard_normal((day.max() + 1, 3))[day]


def heavy(rng: np.random.Generator, run: np.ndarray) -> np.ndarray:
    """Student's t with three degrees of freedom, of unit variance."""
    return rng.standard_t(3, (len(run), 3)) / np.sqrt(3.0)


NOISES: dict[str, dict[str, Any]] = {
    "white": {},
    "rho 0.3": {"noise": autoregressive(0.3)},
    "rho 0.6": {"noise": autoregressive(0.6)},
    "rho 0.9": {"noise": autoregressive(0.9)},
    "random walk": {"noise": walk},
    "day offsets": {"noise": of_days},
    "heavy tails": {"noise": heavy},
    "rounded to 1 µm": {"decimals": 3},
}
# An oracle knows the curve and tries it on every error motion of the machine, of which there are so many.
ERRORS = 36
# All tests may be wrong in one of so many empty campaigns.
RATE = 0.01
# What an oracle has to see of a curve, two-sided.
ORACLE = float(scipy.stats.norm.isf(RATE / ERRORS / 2.0))
PLANS = {4: (2, 2), 8: (2, 4), 20: (5, 4), 60: (15, 4), 1: (1, 1), 2: (1, 2), 7: (7, 1)}


@dataclass(frozen=True)
class Seen:
    """How many standard deviations of the noise an oracle sees of a hidden shape: ``size`` in this campaign,
    ``expected`` over all that differ by their noise alone."""

    size: float
    expected: float

    def power(self, tests: int, unknowns: int) -> float:
        """The share of such campaigns in which the likelihood-ratio test of a curve with so many unknowns, its size
        among them, finds the true one, where so many such tests are wrong in one of a hundred empty campaigns."""
        limit = scipy.stats.chi2.isf(RATE / tests, unknowns)
        return float(scipy.stats.ncx2.sf(limit, unknowns, self.expected**2))

    @property
    def powers(self) -> np.ndarray:
        """Those (3,) of the true curve on all errors, on the right one, and of one with one more unknown on all."""
        return np.array([self.power(ERRORS, 1), self.power(1, 1), self.power(ERRORS, 2)])


def visible(seed: int, name: str, peak: float, runs: int) -> tuple[Any, Seen]:
    """A campaign with a hidden shape, and what an oracle sees of it: the likelihood ratio of the true curve, of which
    only the size is unknown, in the residual of the plain model."""
    _, effect, curve = FAMILIES[name]
    last: list[np.ndarray] = []

    def kept(q: np.ndarray, travel: np.ndarray, now: Any) -> np.ndarray:
        last[:] = [curve(q, travel, now)]
        return last[0]

    days, each = PLANS[runs]
    hidden = [simulator.Effect(effect, peak_um=peak, curve=kept)]
    campaign, _ = virtual_campaigns.virtual(seed, hidden, days=days, runs_per_day=each)
    fitted = fit(problem_of(campaign).for_search())
    problem, term = fitted.problem, parse_term(effect.partition(":")[0], fitted.problem.context.chain)
    moved = fitted.by_error[:, :, term.joint, MOTION, term.component] * last[0][:, None] / problem.sigma
    lengths = np.linalg.norm(moved * problem.sigma, axis=1)
    rows = problem.padded(moved).reshape(len(problem.runs), -1)
    column = np.zeros_like(fitted.white)
    column[:, : rows.shape[1]] = rows
    column = project_out(fitted.nuisance.basis, column[..., None])[..., 0]
    onto = float(np.sum(column * fitted.white)) / float(np.linalg.norm(column))
    rest = float(np.sum(fitted.white**2)) - onto**2
    size = abs(onto) / float(np.sqrt(rest / (fitted.degrees_of_freedom - 1)))
    return campaign, Seen(size, 1e-3 * peak / float(lengths.max()) * float(np.linalg.norm(column)))


@dataclass(frozen=True)
class Told:
    """What an explanation named, with the rivals of the first, and the seconds of processor time that it took."""

    effects: tuple[str, ...]
    rivals: tuple[str, ...]
    seconds: float


def told(campaign: Any, seed: int) -> Told:
    """Explain a campaign."""
    begin = time.process_time()
    answer = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(seed))
    rivals = tuple(rival.effect for effect in answer.missing[:1] for rival in effect.rivals)
    return Told(tuple(effect.effect for effect in answer.missing), rivals, time.process_time() - begin)


def shapes(seeds: range, peaks: tuple[float, ...], runs: int, only: str) -> Iterator[str]:
    """The rows of the table of shapes; none without seeds."""
    if not seeds:
        return
    yield (
        "| hidden | peak | right error alone | led by it | alone, or a rival of what is | an oracle sees, s "
        "| finds | finds, knowing the error | finds, one more unknown | seconds | else |"
    )
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for strength, peak in enumerate(peaks):
        all_alone, all_rival, all_able, count, powers = 0, 0, 0, 0, np.zeros(3)
        for family, (name, (right, _, _)) in enumerate(FAMILIES.items()):
            if only not in name:
                continue
            # Noise of its own for each: the same one under all families would make their intervals too short.
            own = [seed + SEEDS_APART * (strength * len(FAMILIES) + family) for seed in seeds]
            campaigns = [visible(seed, name, peak, runs) for seed in own]
            answers = [told(campaign, seed) for (campaign, _), seed in zip(campaigns, own, strict=True)]
            errors = [[text.partition(":")[0] for text in answer.effects] for answer in answers]
            alone = [bool(named) and set(named) <= set(right) for named in errors]
            led = sum(bool(named) and named[0] in right for named in errors)
            rival = [
                is_right
                or (
                    len(answer.effects) == 1
                    and bool({text.partition(":")[0] for text in answer.rivals} & set(right))
                )
                for answer, is_right in zip(answers, alone, strict=True)
            ]
            seen = [oracle.size for _, oracle in campaigns]
            able = [size > ORACLE for size in seen]
            power = np.sum([oracle.powers for _, oracle in campaigns], axis=0)
            powers += power
            wrong = {
                f"{' + '.join(answer.effects) or 'nothing'} ({size:.1f})"
                for answer, size, is_right in zip(answers, seen, alone, strict=True)
                if not is_right
            }
            all_alone += sum(alone)
            all_rival += sum(rival)
            all_able += sum(is_right or not is_able for is_right, is_able in zip(alone, able, strict=True))
            count += len(answers)
            seconds = float(np.median([answer.seconds for answer in answers]))
            shares = (
                f"{sum(alone)} of {len(answers)} | {led} | {sum(rival)} | {min(seen):.1f} to {max(seen):.1f} "
                f"| {' | '.join(f'{each:.2f}' for each in power)} | {seconds:.1f}"
            )
            yield f"| {name} | {peak:g} µm | {shares} | {'; '.join(sorted(wrong))} |"
        found_by = "| " + " | ".join(f"{each:.1f}" for each in powers)
        yield f"| all | {peak:g} µm | {interval(all_alone, count)} | | {interval(all_rival, count)} | {found_by} | | |"
        yield f"| all, right or missed by the oracle too | {peak:g} µm | {interval(all_able, count)} | | | | | | | | |"


def empties(seeds: range, runs: list[int], only: str) -> Iterator[str]:
    """The rows of the table of empty campaigns; none without seeds."""
    if not seeds:
        return
    yield "| noise | runs | false effects | seconds | named |"
    yield "| --- | --- | --- | --- | --- |"
    for plan, count in enumerate(runs):
        days, each = PLANS[count]
        for kind, (name, options) in enumerate(NOISES.items()):
            if only not in name:
                continue
            own = [20000 + seed + SEEDS_APART * (plan * len(NOISES) + kind) for seed in seeds]
            answers = [
                told(virtual_campaigns.virtual(seed, days=days, runs_per_day=each, **options)[0], seed)
                for seed in own
            ]
            false = [answer for answer in answers if answer.effects]
            named = sorted({answer.effects[0] for answer in false})[:4]
            seconds = float(np.median([answer.seconds for answer in answers]))
            yield f"| {name} | {count} | {interval(len(false), len(answers))} | {seconds:.1f} | {', '.join(named)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=3, help="campaigns of every shape and peak")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--empties", type=int, default=60, help="empty campaigns of every noise and plan")
    parser.add_argument("--peaks", type=float, nargs="+", default=[8.0, 3.0], help="peaks in µm")
    parser.add_argument("--shape-runs", type=int, default=20, choices=list(PLANS), help="runs with a shape")
    parser.add_argument("--runs", type=int, nargs="+", default=[4, 8, 20, 60, 1, 2, 7], choices=list(PLANS))
    parser.add_argument("--only", default="", help="shapes or noises whose name contains this")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    for row in shapes(seeds, tuple(options.peaks), options.shape_runs, options.only):
        print(row, flush=True)
    print(flush=True)
    for row in empties(range(options.first, options.first + options.empties), options.runs, options.only):
        print(row, flush=True)


if __name__ == "__main__":
    main()
