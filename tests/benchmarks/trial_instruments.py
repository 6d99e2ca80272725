"""How often the joint region of laser, ball bar and R-test holds the truth; how long 3 000 rows take.

``python tests/benchmarks/trial_instruments.py --seeds 300``: every seed has a machine of its own (errors of some 20 µm,
40 µrad, 10 µm/m), readings of ``tests/simulator/four_instruments.py``, which shares no code with the package. A region
is the ellipsoid of the stated covariance at 95 % (chi-square, JCGM 102, 6.5.2). ``--heavy``: noise of Student's t with
three degrees of freedom and the same standard deviation; ``--drift``: the machine grows by 2 µm in X in the R-test's
hour, ``--stated``: and the R-test states that it drifts by so much; ``--pitch``: the effect of the example, which the
model lacks; ``--bar``: the ball bar alone, in three planes.
``--told``: how often `explain` finds something, `compare` says that something is missing or that instruments disagree,
and `contributions` has an E_n above 1; ``--first``: the first seed.
``--certified``: what a certificate states (intervals by k_q, ellipsoid by k_p) in place of what `identify` does, with
noise that follows the reading before, of the same instrument, by ``--follows``.
``--session``: three runs of a day with one bar, the first with a laser too; ``--days``: the same on three days;
``--apart``: the same with a length for every run. The mean of the runs with the bar alone is looked at as well, with
the uncertainty by which `trend` compares campaigns.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.records import Verdict
from monitor.statistics.normalised_error import result_of_runs
from monitor.store import Database, import_campaign
from monitor.store.models import StoredModel
from monitor.workflow.explain.compare import compare
from monitor.workflow.explain.explain import explain
from monitor.workflow.explain.explain_answer import MachineExplanation
from monitor.workflow.explain.request import CompareRequest, ExplainRequest
from monitor.workflow.instruments.instruments import instruments
from monitor.workflow.instruments.request import InstrumentsRequest
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.evaluation import evaluate_fit
from monitor.workflow.uncertainty.request import UncertaintyRequest
from tests.simulator import four_instruments as shop

#: The parameters that these three instruments separate, from the errors that were put in.
PARAMETERS = ("EX0C", "EY0C", "EA0C", "EB0C", "EC0X", "EA0Z", "EB0Z", "EXX", "EYY", "EZZ")


class Heavy(np.random.Generator):
    """Student's t with three degrees of freedom in place of normal numbers, of the same standard deviation."""

    def normal(self, loc: float = 0.0, scale: float = 1.0, size: object = None) -> object:  # type: ignore[override]
        """Draw."""
        return loc + scale * self.standard_t(3.0, size) / np.sqrt(3.0)  # type: ignore[call-overload]


class Following(np.random.Generator):
    """Normal numbers of which each follows the one of its size and scale before by ``memory``: each instrument's."""

    memory = 0.0

    def normal(self, loc: float = 0.0, scale: float = 1.0, size: object = None) -> object:  # type: ignore[override]
        """Draw."""
        before: dict[object, object] = self.__dict__.setdefault("before", {})
        value = self.standard_normal(size)  # type: ignore[call-overload]
        if (scale, size) in before:
            value = self.memory * before[scale, size] + np.sqrt(1.0 - self.memory**2) * value
        before[scale, size] = value
        return loc + scale * value


def truth_of(rng: np.random.Generator) -> dict[str, float]:
    """Errors of one machine in mm and rad."""
    size = {"X0": 0.02, "Y0": 0.02, "A0": 4e-5, "B0": 4e-5, "C0": 4e-5}
    return {name: float(rng.normal(0.0, size.get(name[1:3], 1e-5))) for name in shop.TRUTH}


def expected(truth: dict[str, float]) -> np.ndarray:
    """The parameters' true values: a turn of Y about Z shows as one of X the other way."""
    return np.array([-truth["EC0Y"] if name == "EC0X" else truth[name] for name in PARAMETERS])


def campaign_of(folder: Path, seed: int, options: argparse.Namespace, cycles: int, step: float) -> object:
    """A campaign of three instruments, and its truth."""
    rng = np.random.default_rng(seed)
    truth = truth_of(rng)
    chain = shop.machine(shop.PITCH if options.pitch else 0.0, truth)
    noise = Heavy(np.random.PCG64([seed, 1])) if options.heavy else rng
    if options.certified:
        noise = Following(np.random.PCG64([seed, 2]))
        noise.memory = options.follows
    bar = shop.ball_bar(chain, noise, step)
    parts = [bar] if options.bar else [shop.laser(chain, noise, cycles), bar, shop.r_test(chain, noise)]
    rows = [row for _, of in parts for row in of]
    if options.drift:
        hour = [row for row in rows if row["setup"] == "r-test"]
        for number, row in enumerate(hour):
            row["dx_um"] = float(row["dx_um"]) + 2.0 * number / len(hour)  # type: ignore[arg-type]
    text = "".join(text for text, _ in parts)
    if options.stated:
        stated = 'reading = "vector"\ndrift_standard_uncertainty_um = 2.0\n'
        text = text.replace('reading = "vector"\n', stated)
    chain.write(folder, text, rows)
    return read_campaign(folder), expected(truth)


def sessions(seeds: int, apart: bool, days: bool) -> None:
    """Print the rates of three runs with one bar: of each by itself, and of the mean of those with the bar alone."""
    names = PARAMETERS[4:]
    limit = scipy.stats.chi2.ppf(0.95, len(names))
    inside, distance, u = np.zeros(3, dtype=int), np.zeros(3), np.zeros((3, len(names)))
    of_mean = np.zeros((2, len(names)), dtype=int)
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        truths = [truth_of(rng) for _ in range(3)]
        with tempfile.TemporaryDirectory() as folder:
            campaign = read_campaign(shop.session(Path(folder) / "day", rng, truths, 10.0, days=days))
        problem = campaign_method(campaign).problem_of(campaign)
        solution = solve_problem(replace(problem, shares_bars=False) if apart else problem)
        columns = [problem.base_names.index(name) for name in names]
        assert solution.local_free[:, columns].all()
        errors = solution.local[:, columns] - np.array([expected(truth)[4:] for truth in truths])
        each = np.sqrt(solution.local_covariance[:, columns, columns])
        for number in range(len(names)):
            off_mean, u_mean = result_of_runs(errors[1:, number], each[1:, number])
            divided = np.sqrt(np.sum(each[1:, number] ** 2)) / 2.0
            of_mean[:, number] += [abs(off_mean) <= 1.96 * stated for stated in (u_mean, divided)]
        for run, truth in enumerate(truths):
            off = solution.local[run, columns] - expected(truth)[4:]
            covariance = solution.local_covariance[run][np.ix_(columns, columns)]
            square = float(off @ np.linalg.solve(covariance, off))
            inside[run] += square <= limit
            distance[run] += square / seeds
            u[run] += np.sqrt(np.diag(covariance)) / seeds
    for run in range(3):
        low, high = scipy.stats.binomtest(int(inside[run]), seeds).proportion_ci(method="exact")
        print(
            f"run {run + 1}: truth inside the joint region of {len(names)} parameters: {inside[run]} of {seeds}, "
            f"{100 * inside[run] / seeds:.1f} % (95 % interval {100 * low:.1f} to {100 * high:.1f} %), mean square "
            f"distance {distance[run]:.2f}; u in µrad, µm/m: "
            + ", ".join(f"{name} {1e6 * of:.2f}" for name, of in zip(names, u[run], strict=True))
        )
    for how, counts in zip(("as trend states it", "as if the runs were independent"), of_mean, strict=True):
        print(
            f"mean of runs 2 and 3 inside 1.96 u, u {how}: "
            + ", ".join(f"{name} {count} of {seeds}" for name, count in zip(names, counts, strict=True))
        )


def told(options: argparse.Namespace) -> None:
    """Print in how many campaigns `explain`, `compare` and `contributions` say that model or instrument is wrong."""
    counts = {
        "explain": 0,
        "compare": 0,
        "compare, instruments disagree": 0,
        "compare, a setup runs with the time": 0,
        "contributions, E_n above 1": 0,
    }
    for seed in range(options.first, options.first + options.seeds):
        with tempfile.TemporaryDirectory() as folder:
            campaign, _ = campaign_of(Path(folder) / "shop", seed, options, 1, 10.0)
            with Database(Path(folder) / "shop.duckdb") as db:
                import_campaign(db, campaign)
                comparison = compare(db, CompareRequest("shop"))
                shares = instruments(db, InstrumentsRequest("shop"))
                explanation = explain(db, ExplainRequest("shop")).explanation
        assert isinstance(explanation, MachineExplanation)
        largest = max((pair.e_n for each in shares.parameters for pair in each.agreement), default=0.0)
        counts["explain"] += bool(explanation.missing)
        counts["compare"] += comparison.comparison.verdict is Verdict.SOMETHING_IS_MISSING
        counts["compare, instruments disagree"] += comparison.instruments_disagree is not None
        counts["compare, a setup runs with the time"] += comparison.run_with_time is not None
        counts["contributions, E_n above 1"] += largest > 1.0
    for what, count in counts.items():
        low, high = scipy.stats.binomtest(int(count), options.seeds).proportion_ci(method="exact")
        print(f"{what}: {count} of {options.seeds} (95 % interval {100 * low:.1f} to {100 * high:.1f} %)")


def certified(options: argparse.Namespace) -> None:
    """Print how often both regions of a certificate hold the truth, and how often it says that readings resemble."""
    intervals, ellipsoids, noticed, distance = 0, 0, 0, 0.0
    for seed in range(options.first, options.first + options.seeds):
        with tempfile.TemporaryDirectory() as folder:
            campaign, true = campaign_of(Path(folder) / "shop", seed, options, 1, 10.0)
        model = StoredModel("own", 1, None, (), (), (), "", None)
        fitted = fit(campaign_method(campaign).problem_of(campaign, as_model(model)))
        result = evaluate_fit(campaign, model, fitted, UncertaintyRequest(campaign.name, method="guf"))
        stated, truth = result.framework, dict(zip(PARAMETERS, true, strict=True))
        off = stated.estimate - np.array([truth[name] for name in stated.names])
        square = float(off @ np.linalg.solve(stated.covariance, off))
        intervals += bool(np.all(np.abs(off) <= stated.expanded))
        ellipsoids += square <= stated.k_p**2
        distance += square / len(off) / options.seeds
        noticed += result.covariance_source.neighbours is not None
    for what, count in (
        ("intervals hold all", intervals), ("ellipsoid holds all", ellipsoids), ("neighbours told", noticed),
    ):  # fmt: skip
        low, high = scipy.stats.binomtest(count, options.seeds).proportion_ci(method="exact")
        share = 100 * count / options.seeds
        print(f"{what}: {count} of {options.seeds}, {share:.1f} % ({100 * low:.1f} to {100 * high:.1f} %)")
    print(f"mean square distance over its dimensions {distance:.2f}")


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    for name in (
        "--heavy",
        "--drift",
        "--stated",
        "--pitch",
        "--bar",
        "--session",
        "--days",
        "--apart",
        "--told",
        "--certified",
    ):
        parser.add_argument(name, action="store_true")
    parser.add_argument("--follows", type=float, default=0.0)
    options = parser.parse_args()
    if options.certified:
        certified(options)
        return
    if options.session:
        sessions(options.seeds, options.apart, options.days)
        return
    if options.told:
        told(options)
        return
    names = PARAMETERS[4:] if options.bar else PARAMETERS
    inside, singly, distance, iterations = 0, np.zeros(len(names)), [], []
    limit = scipy.stats.chi2.ppf(0.95, len(names))
    for seed in range(options.first, options.first + options.seeds):
        with tempfile.TemporaryDirectory() as folder:
            campaign, true = campaign_of(Path(folder) / "shop", seed, options, 1, 10.0)
        result = campaign_method(campaign).identify(campaign)
        run = result.runs[0]
        has_number = np.isfinite(run.estimate)
        assert tuple(np.array(result.parameters)[has_number]) == names, result.parameters
        off = (
            run.estimate
            - np.array(
                [dict(zip(PARAMETERS, true, strict=True)).get(name, np.nan) for name in result.parameters]
            )
        )[has_number]
        covariance = run.covariance[np.ix_(has_number, has_number)]
        square = float(off @ np.linalg.solve(covariance, off))
        inside += square <= limit
        distance.append(square)
        iterations.append(result.iterations)
        singly += np.abs(off) <= 1.96 * np.sqrt(np.diag(covariance))
    low, high = scipy.stats.binomtest(inside, options.seeds).proportion_ci(method="exact")
    print(
        f"truth inside the joint region of {len(names)} parameters: {inside} of {options.seeds}, "
        f"{100 * inside / options.seeds:.1f} % (95 % interval {100 * low:.1f} to {100 * high:.1f} %)"
    )
    print(
        f"mean square distance {np.mean(distance):.2f} (expected {len(names)}), at most {max(iterations)} steps"
    )
    print(
        "each by itself at 95 %: "
        + ", ".join(
            f"{name} {100 * count / options.seeds:.1f}" for name, count in zip(names, singly, strict=True)
        )
    )
    with tempfile.TemporaryDirectory() as folder:
        campaign, _ = campaign_of(Path(folder) / "shop", 1, options, 20, 1.29)
    begin = time.process_time()
    problem = campaign_method(campaign).problem_of(campaign)
    solve_problem(problem)
    print(
        f"{len(campaign.probings)} rows: {time.process_time() - begin:.2f} s of processor time to set up and solve"
    )


if __name__ == "__main__":
    main()
