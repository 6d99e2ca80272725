"""Do signed numbers hold the truth, on machines that break what they assume? Results: ``docs/trials-signed.md``.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_signed.py --campaigns 200

The machine, its campaigns and their noise are those of ``own_machine``, which shares nothing with the package. Of each
campaign the last run is evaluated: whether its certificate is refused, and on which grounds; whether the intervals
(k_q) and the ellipsoid (k_p) of the certificate hold all true values, and which part of the parameters ``identify``
holds within 2 u. The true values are those written into the matrices. An hour and no test.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parent))

from own_machine import BAR_MM, BAR_PER_K, BAR_U_MM, TRUE, OwnMachine, plan, recorded

from monitor.discovery import fit, robust_fit
from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.records import Campaign
from monitor.sources import Quantity, Sharing, Source
from monitor.store.models import StoredModel
from monitor.workflow.identify.machine import identified, machine_answer
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.grounds import grounds_of
from monitor.workflow.uncertainty.lack_in_budget import lack_in_budget
from monitor.workflow.uncertainty.request import UncertaintyRequest
from monitor.workflow.uncertainty.stating import statement

PLAN = plan()
#: µm; half of the reversal value of X where the machine has one.
AMPLITUDE = 2.0
TRUTH = {**TRUE, "EXX:reversal": AMPLITUDE}

Draw = Callable[[np.random.Generator, int], np.ndarray]


def _backlash(amplitude: float) -> dict[str, Callable[..., np.ndarray]]:
    """The motions of a machine whose X has a play of this amplitude in µm."""

    def motion(reading, side, warm):
        moved = np.zeros((len(reading), 6))
        moved[:, 0] = 1e-3 * amplitude * side
        return moved

    return {"X": motion}


def white(rng: np.random.Generator, runs: int) -> np.ndarray:
    """Independent normal noise (R, n, 3) of 1 µm."""
    return rng.standard_normal((runs, len(PLAN), 3))


def heavy(rng: np.random.Generator, runs: int) -> np.ndarray:
    """Student's t with 3 degrees of freedom, of standard deviation 1 µm."""
    return rng.standard_t(3, (runs, len(PLAN), 3)) / np.sqrt(3.0)


def following(rng: np.random.Generator, runs: int, memory: float = 0.8) -> np.ndarray:
    """Noise of 1 µm that follows the probing before."""
    noise = white(rng, runs)
    for row in range(1, len(PLAN)):
        noise[:, row] = memory * noise[:, row - 1] + np.sqrt(1.0 - memory**2) * noise[:, row]
    return noise


def outlier(rng: np.random.Generator, runs: int) -> np.ndarray:
    """One touch in the last run 20 µm off in one axis."""
    noise = white(rng, runs)
    noise[-1, rng.integers(len(PLAN)), rng.integers(3)] += 20.0
    return noise


@dataclass(frozen=True)
class Case:
    """A machine and what is said of it: ``noise`` in µm, what the probe ``stated_um``, the ``resolution_um`` of the
    scales, ``days`` of ``runs`` each; ``lag_K`` by how much the bar is warmer than the air, one draw a run; by how many
    µm the amplitude of the play differs ``by_day_um`` and ``by_run_um``, drawn about the true one."""

    noise: Draw = white
    times: float = 1.0
    stated_um: float = 1.0
    resolution_um: float = 0.0
    days: int = 5
    runs: int = 4
    lag_K: float = 0.0
    by_day_um: float = 0.0
    by_run_um: float = 0.0
    holds_for: str | None = None
    effects: tuple[str, ...] = ()
    sources: tuple[Source, ...] = ()


WITH = ("EXX:reversal",)
#: The last two have no true size; of 20 runs no ellipsoid holds them all.
THREE = ("EXX:reversal", "EBB:harmonic1", "EYX:poly2")
WARM = Source(name="bar", quantity=Quantity.STANDARD_TEMPERATURE, size=1.0, shared_by=Sharing.RUN)
CASES = {
    "effects: 20 runs": Case(effects=WITH),
    "effects: 6 runs": Case(days=2, runs=3, effects=WITH),
    "effects: 2 runs": Case(days=1, runs=2, effects=WITH),
    "effects: 1 run": Case(days=1, runs=1, effects=WITH),
    "three effects: 20 runs": Case(effects=THREE),
    "three effects: 1 run": Case(days=1, runs=1, effects=THREE),
    "white, 20": Case(),
    "white, 3": Case(days=1, runs=3),
    "white, 1": Case(days=1, runs=1),
    "heavy tails, 20": Case(noise=heavy),
    "heavy tails, 1": Case(noise=heavy, days=1, runs=1),
    "follows by 0.8, 20": Case(noise=following),
    "follows by 0.8, 3": Case(noise=following, days=1, runs=3),
    "follows by 0.8, 1": Case(noise=following, days=1, runs=1),
    "stated a third, 20": Case(times=3.0),
    "stated a third, 3": Case(times=3.0, days=1, runs=3),
    "stated a third, 1": Case(times=3.0, days=1, runs=1),
    "stated three times, 20": Case(stated_um=3.0),
    "stated three times, 1": Case(stated_um=3.0, days=1, runs=1),
    "one touch 20 µm off, 20": Case(noise=outlier),
    "one touch 20 µm off, 3": Case(noise=outlier, days=1, runs=3),
    "one touch 20 µm off, 1": Case(noise=outlier, days=1, runs=1),
    "read to 1 µm, noise 0.2, 20": Case(times=0.2, resolution_um=1.0),
    "read to 1 µm, noise 0.2, 1": Case(times=0.2, resolution_um=1.0, days=1, runs=1),
    "read to 1 µm, noise 0.2, stated 0.2, 20": Case(times=0.2, stated_um=0.2, resolution_um=1.0),
    "bar lags by 1 K, 20": Case(lag_K=1.0),
    "bar lags by 1 K, 1": Case(lag_K=1.0, days=1, runs=1),
    "bar lags by 1 K, stated, 20": Case(lag_K=1.0, sources=(WARM,)),
    "bar lags by 1 K, stated, 1": Case(lag_K=1.0, sources=(WARM,), days=1, runs=1),
    "effects and a stated bar that lags: 20 runs": Case(effects=WITH, lag_K=1.0, sources=(WARM,)),
    "effects and a stated bar that lags: 6 runs": Case(
        days=2, runs=3, effects=WITH, lag_K=1.0, sources=(WARM,)
    ),
    "effects and a stated bar that lags: 1 run": Case(
        days=1, runs=1, effects=WITH, lag_K=1.0, sources=(WARM,)
    ),
    "effect differs by day, 0.3: 20 runs": Case(effects=WITH, by_day_um=0.3),
    "effect differs by day, 1: 20 runs": Case(effects=WITH, by_day_um=1.0),
    "effect differs by day, 0.3: 20 runs, over the campaign": Case(
        effects=WITH, by_day_um=0.3, holds_for="campaign"
    ),
    "effect differs by day, 1: 20 runs, over the campaign": Case(
        effects=WITH, by_day_um=1.0, holds_for="campaign"
    ),
    "effect differs by day, 0.3: three days of three": Case(days=3, runs=3, effects=WITH, by_day_um=0.3),
    "effect differs by day, 1: three days of three": Case(days=3, runs=3, effects=WITH, by_day_um=1.0),
    "effect differs by day, 0.3: two days of three": Case(days=2, runs=3, effects=WITH, by_day_um=0.3),
    "effect differs by day, 1: two days of three": Case(days=2, runs=3, effects=WITH, by_day_um=1.0),
    "effect differs by run, 1: six runs": Case(days=1, runs=6, effects=WITH, by_run_um=1.0),
    "effect differs by run, 1: two runs": Case(days=1, runs=2, effects=WITH, by_run_um=1.0),
}


@cache
def of_length(machine: OwnMachine) -> tuple[np.ndarray, np.ndarray]:
    """Readings without noise (n, 3), and what a millimetre of the bar's length adds to them."""
    warm, step = np.zeros(len(PLAN)), 0.1
    at_20 = machine.touched(PLAN, warm)
    return at_20, (machine.touched(PLAN, warm, BAR_MM + step) - at_20) / step


@cache
def of_play() -> np.ndarray:
    """What a micrometre more of the play's amplitude adds to the readings (n, 3)."""
    none, step = np.zeros(len(PLAN)), 1.0
    more, less = (
        OwnMachine(motions=_backlash(AMPLITUDE + half)).touched(PLAN, none) for half in (step / 2, -step / 2)
    )
    return (more - less) / step


def measured(case: Case, machine: OwnMachine, rng: np.random.Generator):
    """A campaign of a case, its bar certified with an error of its stated u, and the amplitude of the play that the
    machine had in the mean of its runs, µm."""
    runs = case.days * case.runs
    ambient = 20.0 + 4.0 * rng.random(runs)
    lag = case.lag_K * rng.standard_normal(runs)
    at_20, per_mm = of_length(machine)
    clean = at_20 + per_mm * (BAR_MM * BAR_PER_K * (ambient + lag - 20.0))[:, None, None]
    more = np.zeros(runs)
    if case.by_day_um or case.by_run_um:
        more = np.repeat(case.by_day_um * rng.standard_normal(case.days), case.runs)
        more = more + case.by_run_um * rng.standard_normal(runs)
        clean = clean + more[:, None, None] * of_play()
    readings = clean + 1e-3 * case.times * case.noise(rng, runs)
    if case.resolution_um:
        readings = np.round(readings / (1e-3 * case.resolution_um)) * 1e-3 * case.resolution_um
    campaign = recorded(
        PLAN, readings, np.repeat(np.arange(case.days), case.runs), stated_um=case.stated_um,
        bar_mm=BAR_MM + BAR_U_MM * rng.standard_normal(), ambient=ambient,
    )  # fmt: skip
    return replace(campaign, sources=case.sources), AMPLITUDE + float(np.mean(more))


@dataclass(frozen=True)
class Outcome:
    """What one campaign came to: ``grounds`` against its certificate, or that it has none; what held the truth. Of an
    effect that differs that is the mean of all days, and for ``rectangle_of_runs`` that of the measured runs."""

    grounds: tuple[str, ...]
    rectangle: bool
    ellipsoid: bool
    within_2_u: float
    identify_within_2_u: float
    effect: bool | None
    rectangle_of_runs: bool
    said: bool


def outcome(case: Case, machine: OwnMachine, rng: np.random.Generator, *, identifies: bool = True) -> Outcome:
    """Measure a campaign, evaluate its last run, and compare with the truth; ``identify`` where it is asked, too."""
    campaign, of_runs = measured(case, machine, rng)
    model = StoredModel("own", 1, ("samba", 1), case.effects, case.effects, (), "", None)
    problem = campaign_method(campaign).problem_of(campaign, as_model(model))
    request = UncertaintyRequest(campaign.name, method="guf", holds_for=case.holds_for)
    result = evaluate_fit(campaign, model, fit(problem), request)
    answer = statement(result)
    against = (*grounds_of(campaign, robust_fit(problem), result.run), *lack_in_budget(answer))
    names = answer.parameters
    truth = np.array([TRUTH.get(name, 0.0) for name in names])
    estimate = np.array([answer.guf.estimate[name] for name in names])
    u = np.array([answer.guf.u[name] for name in names])
    error = estimate - truth
    truth_of_runs = np.where(np.array(names) == WITH[0], of_runs, truth)
    k_q = answer.guf.k_q_with_degrees_of_freedom or np.inf
    k_p = answer.guf.k_p_with_degrees_of_freedom or np.inf
    inside, said = _identified(campaign, model) if identifies else (math.nan, False)
    return Outcome(
        tuple(sorted({str(ground.kind) for ground in against} - {"scale"})),  # the simulated scales are exact
        bool(np.all(np.abs(error) <= k_q * u)),
        bool(error @ np.linalg.solve(answer.covariance, error) <= k_p**2),
        float(np.mean(np.abs(error) <= 2.0 * u)),
        inside,
        bool(abs(error[-1]) <= 2.0 * u[-1]) if len(names) > len(TRUE) else None,
        bool(np.all(np.abs(estimate - truth_of_runs) <= k_q * u)),
        said,
    )


def _identified(campaign: Campaign, model: StoredModel) -> tuple[float, bool]:
    """The share of parameters of the last run that `identify` holds within 2 u, and whether it has a note."""
    last = machine_answer(campaign, identified(campaign, model)[0]).runs[-1]
    inside = [abs(each.value - TRUE[name]) <= 2.0 * each.u for name, each in last.parameters.items()]
    return float(np.mean(inside)), bool(last.note)


def exact(count: int, of: int) -> str:
    """A rate with its exact 95 % interval (Clopper and Pearson)."""
    if not of:
        return "-"
    low = 0.0 if count == 0 else stats.beta.ppf(0.025, count, of - count + 1)
    high = 1.0 if count == of else stats.beta.ppf(0.975, count + 1, of - count)
    return f"{100 * count / of:.1f} ({100 * low:.1f} to {100 * high:.1f})"


def row(name: str, outcomes: list[Outcome], failed: int) -> str:
    """A line of the table: all campaigns, and those whose certificate nothing speaks against."""
    issued = [each for each in outcomes if not each.grounds]
    kinds = Counter(kind for each in outcomes for kind in each.grounds)
    columns = [
        name,
        f"{len(outcomes) - len(issued) + failed} of {len(outcomes) + failed}"
        + (f" ({', '.join(f'{kind} {count}' for kind, count in kinds.most_common())})" if kinds else ""),
        exact(sum(each.rectangle for each in issued), len(issued)),
        exact(sum(each.ellipsoid for each in issued), len(issued)),
        exact(sum(each.rectangle for each in outcomes), len(outcomes)),
        f"{100 * np.mean([each.within_2_u for each in outcomes]):.1f}",
        f"{100 * np.mean([each.identify_within_2_u for each in outcomes]):.1f}",
        f"{sum(each.said for each in outcomes)}",
    ]
    if outcomes and outcomes[0].effect is not None:
        columns.append(exact(sum(bool(each.effect) for each in outcomes), len(outcomes)))
        columns.append(exact(sum(each.rectangle_of_runs for each in outcomes), len(outcomes)))
    return "| " + " | ".join(columns) + " |"


def main() -> None:
    """Print the table, case by case."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--campaigns", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1411)
    parser.add_argument("--only", default="", help="part of a name")
    parser.add_argument("--without-identify", action="store_true")
    parser.add_argument("--exactly", choices=tuple(CASES))
    arguments = parser.parse_args()
    for number, (name, case) in enumerate(CASES.items()):
        if arguments.only not in name or arguments.exactly not in (None, name):
            continue
        machine = OwnMachine(motions=_backlash(AMPLITUDE) if case.effects else {})
        outcomes, failed = [], 0
        for campaign in range(arguments.campaigns):
            rng = np.random.default_rng((arguments.seed, number, campaign))
            try:
                outcomes.append(outcome(case, machine, rng, identifies=not arguments.without_identify))
            except DataError as refusal:
                failed += 1
                print("refused:", str(refusal)[:120], flush=True)
        print(row(name, outcomes, failed), flush=True)


if __name__ == "__main__":
    main()
