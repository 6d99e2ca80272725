"""Trial of false effects in campaigns that hide nothing, many of them in little time.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_empty.py --seeds 300 --seconds 600

A campaign without noise is made and fitted once for every number of runs; then noise of every kind is laid on its
residual, the base parameters are taken out again (they are linear to parts in a million at these sizes), and the scan
of the catalogue is asked as ``explain`` asks it, under the correlation of neighbours that the noise itself shows.
What is left out of ``explain`` can add no effect of the catalogue, only free shapes; those are counted by
``trial_unknown.py``. Drifts of one run are asked at once, not after the catalogue.
Campaigns whose noise shows the same correlation are weighed together; where no candidate passes
the first control of the false discovery rate the scan ends there, and is not asked (it cannot name anything).
Portions of seeds go round over all kinds until ``--seconds`` of processor time are used. Stopped early, it prints what
it has, with exact (Clopper-Pearson) intervals.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.explain import variants_of_campaign
from monitor.discovery.machine.fit import Fit, fit
from monitor.discovery.machine.noise.correlation import Correlation
from monitor.discovery.machine.scene import ChainCandidate, ChainScene, scene_of
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.machine.surroundings import surroundings_of
from monitor.discovery.search.evidence import Pool, best_of_families, weigh_beside
from monitor.discovery.search.scan import scan
from monitor.methods.chain.least_squares import eliminate, project_out
from monitor.methods.samba.method import problem_of
from monitor.statistics import control_false_discoveries

ROOT = Path(__file__).resolve().parents[2]
virtual_campaigns = load("virtual_campaigns", ROOT / "tests" / "discovery" / "virtual.py")
unknown = load("trial_unknown", ROOT / "tests" / "benchmarks" / "trial_unknown.py")
NOISES: dict[str, Callable[[np.random.Generator, np.ndarray], np.ndarray]] = {
    "white": lambda rng, run: rng.standard_normal((len(run), 3)),
    "rho 0.3": unknown.autoregressive(0.3),
    "rho 0.6": unknown.autoregressive(0.6),
    "rho 0.9": unknown.autoregressive(0.9),
    "random walk": unknown.walk,
    "day offsets": unknown.of_days,
    "heavy tails": unknown.heavy,
    "rounded to 1 µm": lambda rng, run: rng.standard_normal((len(run), 3)),
}

# Seeds that are weighed together.
PORTION = 50


@dataclass
class Plan:
    """A campaign without noise, fitted; with what is ``hidden`` in it."""

    days: int
    each: int
    hidden: Sequence[Any] = ()

    def __post_init__(self) -> None:
        campaign, _ = virtual_campaigns.virtual(
            1, self.hidden, days=self.days, runs_per_day=self.each, noise_um=0.0, stated_um=1.0
        )
        problem = problem_of(campaign).for_search()
        self.fit = fit(problem)
        self.drivers = surroundings_of(campaign, problem).drivers
        self.variants = variants_of_campaign(campaign, problem, self.drivers)
        last = self.fit.solution.last
        self.own = eliminate(np.concatenate([last.local, last.common], axis=2)).basis
        self.run = problem.context.run
        measured = list(problem.measured_joints)
        self.readings = problem.context.positions[:, measured]
        along = np.array([problem.context.chain.joints[index].direction for index in measured])
        moved = np.einsum("nrac,ac->nra", self.fit.by_error[:, :, measured, 0, :3], along)
        self.turned = problem.observe(moved)

    def noisy(self, noise: np.ndarray) -> Fit:
        """The fit as this noise (n, 3) in mm of the readings would leave it."""
        problem = self.fit.problem
        vectors = (self.turned @ noise[..., None])[..., 0] / problem.sigma
        residual = np.zeros_like(self.fit.solution.last.residual)
        rows = problem.padded(vectors).reshape(len(residual), -1)
        residual[:, : rows.shape[1]] = rows
        residual = project_out(self.own, residual[..., None])[..., 0]
        if self.hidden:
            residual = residual + self.fit.solution.last.residual
        last = replace(self.fit.solution.last, residual=residual)
        return replace(self.fit, solution=replace(self.fit.solution, last=last))

    def effects(self, noises: Sequence[np.ndarray], rate: float = 0.01) -> list[list[str]]:
        """The effects that the scan names in campaigns with each of the noises."""
        groups: dict[Correlation | None, list[int]] = {}
        fits = [self.noisy(noise) for noise in noises]
        for index, noisy in enumerate(fits):
            design = self.fit.noise_design
            groups.setdefault(design.correlation(noisy.solution.last.residual), []).append(index)
        named: list[list[str]] = [[] for _ in noises]
        for correlation, members in groups.items():
            scene = scene_of(self.fit.with_correlation(correlation), self.variants)
            pool = Pool(tuple(candidate for candidate in scene.candidates if candidate.visible))
            for index in members:
                whitened = replace(fits[index], whitening=scene.fit.whitening)
                whitened.__dict__["nuisance"] = scene.fit.nuisance
                whitened.__dict__["by_error"] = self.fit.by_error
                seen = ChainScene(whitened, scene.shared, scene.candidates, scene.refused)
                drifts = drifts_of_runs(seen, (), rate)
                if not drifts and not self.begins(seen, pool, rate):
                    continue
                seen = replace(seen, candidates=(*seen.candidates, *scene_of(whitened, drifts).candidates))
                result = scan(seen, ChainAcceptance(seen, self.drivers, rate), rate=rate)
                named[index] = [finding.candidate.family for finding in result.findings]
        return named

    @staticmethod
    def begins(scene: ChainScene, pool: Pool[ChainCandidate], rate: float) -> bool:
        """Whether some candidate passes the first control of a scan."""
        weighed = best_of_families(weigh_beside(scene, pool, []))
        p_values = [evidence.p_value for evidence in weighed]
        return bool(control_false_discoveries(p_values, rate=rate).q_value.min() <= rate)


def campaigns(options: argparse.Namespace) -> Iterator[tuple[int, str, list[str]]]:
    """Runs, noise and named effects of empty campaigns."""
    begin = time.process_time()
    plans = {count: Plan(*unknown.PLANS[count]) for count in options.runs}
    for first in range(0, options.seeds, PORTION):
        for count, plan in plans.items():
            if time.process_time() - begin > options.seconds:
                return
            names = [name for name in NOISES if options.only in name]
            kinds = [name for _ in range(first, min(first + PORTION, options.seeds)) for name in names]
            noises = []
            for index, name in enumerate(kinds):
                seed = options.first + first + index // len(names)
                # Draws of its own for each noise: the sum over all counts independent campaigns.
                rng = np.random.default_rng((seed, count, list(NOISES).index(name)))
                sizes = 1e-3 * NOISES[name](rng, plan.run)
                if name.startswith("rounded"):
                    sizes = np.round(plan.readings + sizes, 3) - plan.readings
                noises.append(sizes)
            for name, effects in zip(kinds, plan.effects(noises), strict=True):
                yield count, name, effects


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=300, help="campaigns of every noise and plan, at most")
    parser.add_argument("--first", type=int, default=30000, help="the first seed")
    parser.add_argument("--seconds", type=float, default=600.0, help="processor time")
    parser.add_argument("--runs", type=int, nargs="+", default=[1, 2, 4, 7, 20, 60])
    parser.add_argument("--only", default="", help="noises whose name contains this")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    tried: Counter[tuple[int, str]] = Counter()
    false: Counter[tuple[int, str]] = Counter()
    named: dict[tuple[int, str], list[str]] = {}
    with contextlib.suppress(KeyboardInterrupt):
        for count, name, effects in campaigns(options):
            tried[count, name] += 1
            if effects:
                print(f"{count} runs, {name}: {' + '.join(effects)}", file=sys.stderr, flush=True)
                false[count, name] += 1
                named.setdefault((count, name), []).append(effects[0])
    print("| noise | runs | false effects | named |")
    print("| --- | --- | --- | --- |")
    for count in options.runs:
        for name in NOISES:
            if number := tried[count, name]:
                first = ", ".join(dict.fromkeys(named.get((count, name), ())))
                print(f"| {name} | {count} | {unknown.interval(false[count, name], number)} | {first} |")
    print(f"| all | | {unknown.interval(sum(false.values()), sum(tried.values()))} | |")


if __name__ == "__main__":
    main()
