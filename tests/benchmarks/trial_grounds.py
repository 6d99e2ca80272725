"""Trial of the ground `lack-of-fit` of certificates: how often a right model is refused, and a wrong one is not.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_grounds.py --seconds 600

Right models: campaigns that hide nothing, under noise of every kind of ``trial_empty.py`` (the probe states 1 µm, and
1 µm it is). Wrong ones: one effect of the catalogue, or of eight shapes that it does not have, of 0.5 to 30 µm at the
tip, in the same noise. The effect's pull on the parameters of the last run is known exactly (they are linear to parts
in a million at these sizes); U is k_q u of the run, with the line for lack of fit in it, as a certificate would state.
Counted are campaigns in which the pull exceeds U of some parameter, and how many of them are refused. An effect that
leaves nothing in the residuals is counted by itself: no test of the readings can see it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load

from monitor.discovery.machine.compare import compare
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.model_uncertainty import model_uncertainty
from monitor.discovery.machine.noise.beyond_noise import beyond_neighbours
from monitor.discovery.machine.scene import ChainCandidate, ChainVariant, scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.search.candidate import Variant
from monitor.effects import parse_effect
from monitor.effects.catalogue import catalogue
from monitor.methods.chain.least_squares import eliminate
from monitor.records import Verdict
from monitor.workflow.history.refuted import REFUTED_P
from monitor.workflow.uncertainty.lack_in_budget import MOST_OF_THE_REST

ROOT = Path(__file__).resolve().parents[2]
empty = load("trial_empty", ROOT / "tests" / "benchmarks" / "trial_empty.py")
unknown = empty.unknown
OUTSIDE = ("EYX:poly4", "EXZ:poly4", "EBB:harmonic4", "EYB:harmonic5", "EXC:harmonic4", "EZZ:poly6", "EYY:poly5",
           "EAC:harmonic5")  # fmt: skip
NOISES = (
    "white",
    "rho 0.3",
    "rho 0.6",
    "rho 0.9",
    "random walk",
    "day offsets",
    "heavy tails",
    "rounded to 1 µm",
)
PLANS = {"1 run": (1, 1), "2 runs": (1, 2), "8 runs, 2 days": (2, 4), "20 runs, 5 days": (5, 4)}
#: k_q of 13 parameters from 16 degrees of freedom and more.
K_Q = 3.3


@dataclass(frozen=True)
class Hidden:
    """An effect as it is hidden: what a unit of its coefficients does to residual and parameters, and its name."""

    name: str
    candidate: ChainCandidate
    pull: np.ndarray


class Ground:
    """A plan with the catalogue's effects and those that are hidden."""

    def __init__(self, plan: tuple[int, int]) -> None:
        self.plan = empty.Plan(*plan)
        problem = self.plan.fit.problem
        chain = problem.context.chain
        known = [effect.text for effect in problem.base]
        effects = [each for each in catalogue(chain, known, ("run_time",), {}) if problem.can_show(each)]
        self.variants = [variant for effect in effects for variant in variants_of(effect)]
        outside = [Variant(text, parse_effect(text, chain)) for text in OUTSIDE]
        self.outputs = len(problem.base_names)
        self.covariance = self.plan.fit.solution.local_covariance[-1][: self.outputs, : self.outputs]
        self.inside = self._hidden(self.variants)
        self.outside = self._hidden(outside)
        run = problem._run
        self.place = (run, problem._row)

    def _hidden(self, variants: list[ChainVariant]) -> list[Hidden]:
        scene, problem = scene_of(self.plan.fit, variants), self.plan.fit.problem
        space = eliminate(self.plan.fit.solution.last.local[[-1]])
        hidden = []
        for candidate in scene.candidates:
            rows = problem.padded(candidate.raw / problem.sigma[..., None])[-1]
            pull = space.inverse[0] @ (space.basis[0][: len(rows)].T @ rows)
            hidden.append(Hidden(candidate.family, candidate, pull[: self.outputs]))
        return hidden

    def noise(self, name: str, rng: np.random.Generator) -> np.ndarray:
        sizes = 1e-3 * empty.NOISES[name](rng, self.plan.run)
        if name.startswith("rounded"):
            sizes = np.round(self.plan.readings + sizes, 3) - self.plan.readings
        return sizes

    def with_residual(self, fit: Fit, more: np.ndarray) -> Fit:
        last = fit.solution.last
        residual = last.residual + more.reshape(last.residual.shape)
        fit = replace(fit, solution=replace(fit.solution, last=replace(last, residual=residual)))
        run, row = self.place
        most = int(row.max()) + 1
        vectors = residual[:, : 3 * most].reshape(len(residual), most, 3)[run, row]
        fit.__dict__["vectors"] = vectors * fit.problem.sigma
        fit.__dict__["by_error"] = self.plan.fit.by_error
        fit.__dict__["noise_design"] = self.plan.fit.noise_design
        return fit

    def refuses(self, noise: np.ndarray) -> tuple[bool, bool]:
        """Whether a campaign without a hidden effect is refuted at 0.1 %, and whether its certificate is refused.

        The test of the readings comes first: where it is passed, the size of the line no longer matters.
        """
        fit = self.with_residual(self.plan.noisy(noise), np.zeros(self.plan.fit.solution.last.residual.shape))
        p_value = beyond_neighbours(fit)
        missing = compare(fit, "", "").verdict is Verdict.SOMETHING_IS_MISSING
        if not (missing if p_value is None else p_value < REFUTED_P):
            return False, False
        line = model_uncertainty(fit, len(fit.problem.runs) - 1, self.variants)
        if line is None:
            return True, False
        ratio = np.diag(line.covariance)[: self.outputs] / np.diag(self.covariance)
        return True, bool(np.sqrt(ratio.max()) > MOST_OF_THE_REST)

    def stated(self, noise: np.ndarray, more: np.ndarray) -> tuple[bool, float, np.ndarray]:
        """Whether the certificate is refused, the largest lack of fit over the rest of the budget, and U (m,)."""
        fit = self.with_residual(self.plan.noisy(noise), more)
        # The covariance of the readings is estimated from the runs, or is what the probe states.
        rest = np.diag(self.covariance)
        line = model_uncertainty(fit, len(fit.problem.runs) - 1, self.variants)
        extra = np.zeros_like(rest) if line is None else np.diag(line.covariance)[: self.outputs]
        times, refused = float(np.sqrt(extra / rest).max()), False
        if times > MOST_OF_THE_REST:
            p_value = beyond_neighbours(fit)
            # Without repeated runs the verdict of `compare` stands in.
            missing = compare(fit, "", "").verdict is Verdict.SOMETHING_IS_MISSING
            refused = missing if p_value is None else p_value < REFUTED_P
        return refused, times, K_Q * np.sqrt(rest + extra)


def count_right(options: argparse.Namespace) -> None:
    """Print how often right models are refuted and refused, ``--empty`` campaigns of every plan and noise."""
    print("| plan | noise | refuted at 0.1 % | refused |\n| --- | --- | --- | --- |")
    for plan in options.plans:
        ground = Ground(PLANS[plan])
        for name in NOISES:
            refuted = refused = 0
            for seed in range(options.empty):
                rng = np.random.default_rng((options.first + seed, len(plan)))
                is_refuted, is_refused = ground.refuses(ground.noise(name, rng))
                refuted, refused = refuted + is_refuted, refused + is_refused
            rates = (unknown.interval(calls, options.empty) for calls in (refuted, refused))
            print(f"| {plan} | {name} | {' | '.join(rates)} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="processor time")
    parser.add_argument("--first", type=int, default=52000, help="the first seed")
    parser.add_argument(
        "--empty", type=int, default=300, help="right models of every plan and noise, at most"
    )
    parser.add_argument("--plans", nargs="+", choices=list(PLANS), default=list(PLANS), help="of these plans")
    parser.add_argument("--right", action="store_true", help="right models alone, refuted and refused")
    options = parser.parse_args()
    if options.right:
        count_right(options)
        return
    begin = time.process_time()
    print("| plan | noise | right models refused |\n| --- | --- | --- |")
    grounds = {name: Ground(PLANS[name]) for name in options.plans}
    share = 0.5 * options.seconds / (len(grounds) * len(NOISES))
    for plan, ground in grounds.items():
        nothing = np.zeros_like(ground.plan.fit.solution.last.residual)
        for name in NOISES:
            start, refused, tried, worst = time.process_time(), 0, 0, 0.0
            while tried < options.empty and time.process_time() - start < share:
                rng = np.random.default_rng((options.first + tried, len(plan)))
                is_refused, times, _ = ground.stated(ground.noise(name, rng), nothing)
                refused, tried, worst = refused + is_refused, tried + 1, max(worst, times)
            if tried:
                rate = unknown.interval(refused, tried)
                print(f"| {plan} | {name} | {rate}; largest {worst:.2f} |", flush=True)
    print("\n| plan | effect | pull > U | refused | pull > U without the line | refused | nothing to see |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    share = (options.seconds - (time.process_time() - begin)) / (2 * len(grounds))
    for plan, ground in grounds.items():
        for kind, hidden in (("catalogue", ground.inside), ("outside", ground.outside)):
            count: Counter[str] = Counter()
            missed: Counter[str] = Counter()
            start, seed = time.process_time(), 0
            while time.process_time() - start < share:
                rng = np.random.default_rng((options.first + seed, len(plan), 7))
                seed += 1
                each = hidden[rng.integers(len(hidden))]
                size = rng.standard_normal(each.pull.shape[1])
                peak = np.linalg.norm(each.candidate.raw @ size, axis=1).max()
                if not peak > 0.0:
                    continue
                size *= 1e-3 * np.exp(rng.uniform(np.log(0.5), np.log(30.0))) / peak
                pull = np.abs(each.pull @ size)
                plain = K_Q * np.sqrt(np.diag(ground.covariance))
                if not np.any(pull > plain):
                    continue
                more = each.candidate.columns @ size
                noise = ground.noise(NOISES[rng.integers(6)], rng)
                is_refused, _, expanded = ground.stated(noise, more)
                if float(more @ more) < 1.0:
                    count["blind"] += 1
                    continue
                count["plain"] += 1
                count["plain refused"] += is_refused
                if np.any(pull > expanded):
                    count["beyond"] += 1
                    count["refused"] += is_refused
                    if not is_refused:
                        missed[each.name] += 1
            rates = [
                unknown.interval(count[of], count[all_of]) if count[all_of] else "-"
                for of, all_of in (("refused", "beyond"), ("plain refused", "plain"))
            ]
            cells = (plan, kind, count["beyond"], rates[0], count["plain"], rates[1], count["blind"])
            print("| " + " | ".join(map(str, cells)) + " |", flush=True)
            if missed:
                print(f"missed: {dict(missed.most_common(8))}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
