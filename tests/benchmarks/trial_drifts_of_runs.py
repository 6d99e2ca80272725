"""Trial of drifts of one run: a tilt that grows in run 3 of several, and in no other.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_drifts_of_runs.py --seeds 40

A campaign without noise is made and fitted once for every hidden drift, and white noise of 1 µm is laid on its residual
(as ``trial_empty.py`` does it). Named is an answer of the search of the catalogue that leads with a drift of that run
or has one among the rivals that the data do not rule out; beside it stands how often its error is the hidden one, and
how often anything else is found besides. Balls and points are not asked: `tests/discovery/test_drifts_of_runs.py`
has these.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load, simulator as simulator_of

from monitor.discovery.machine.evidence.acceptance import ChainAcceptance
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.shapes.drifts_of_runs import drifts_of_runs
from monitor.discovery.search.rivals import least_likelihood
from monitor.discovery.search.scan import Finding, scan

ROOT = Path(__file__).resolve().parents[2]
simulator = simulator_of()
empty = load("trial_empty", ROOT / "tests" / "benchmarks" / "trial_empty.py")
unknown = load("trial_unknown", ROOT / "tests" / "benchmarks" / "trial_unknown.py")
RUN = 3

#: Tilts by name: what is hidden, its shape over its axis, and the names of it that move the tip alike.
TILTS: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray], tuple[str, ...]]] = {
    "Z tilts in the plane of X": ("EXZ:curve", lambda q: q / 100.0, ("EB0Z", "EXZ:poly1")),
    "Z tilts in the plane of Y": ("EYZ:curve", lambda q: q / 100.0, ("EYZ:poly1",)),
    "the carriage of Z tilts about X": (
        "EAZ:curve",
        np.ones_like,
        ("EA0Y", "EA0Z", "EZY:poly1", "EYY:poly1"),
    ),
    "the carriage of Z turns about Z": ("ECZ:curve", np.ones_like, ("EC0Y", "EXY:poly1")),
}


def answers(plan: Any, seeds: range) -> list[list[list[str]]]:
    """For every seed the findings: the names of each, its own first, then those of the rivals not ruled out."""
    whole = scene_of(plan.fit, plan.variants)
    told = []
    for seed in seeds:
        noisy = plan.noisy(1e-3 * np.random.default_rng(seed).standard_normal((len(plan.run), 3)))
        noisy.__dict__["nuisance"] = whole.fit.nuisance
        noisy.__dict__["by_error"] = plan.fit.by_error
        scene = ChainScene(noisy, whole.shared, whole.candidates, whole.refused)
        found = scan(scene, ChainAcceptance(scene, plan.drivers, 0.01))
        drifts = drifts_of_runs(scene, found.candidates, 0.01)
        if drifts:
            scene = replace(scene, candidates=(*scene.candidates, *scene_of(noisy, drifts).candidates))
            found = scan(scene, ChainAcceptance(scene, plan.drivers, 0.01), begin=found.candidates)
        told.append([_names(finding) for finding in found.findings])
    return told


def _names(finding: Finding[Any]) -> list[str]:
    least = least_likelihood(finding.evidence)
    rivals = [rival.candidate.family for rival in finding.rivals if rival.likelihood >= least]
    return list(dict.fromkeys([finding.candidate.family, *rivals]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40, help="campaigns of every tilt and size")
    parser.add_argument("--first", type=int, default=64000, help="the first seed")
    parser.add_argument("--runs", type=int, default=4, choices=[4, 7, 8, 20])
    parser.add_argument("--peaks", type=float, nargs="+", default=[3.0, 8.0, 20.0], help="peaks in µm")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    print("| hidden in one run | peak | named with its run | by its error | leads | something else besides |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, (error, shape, right) in TILTS.items():
        for peak in options.peaks:

            def curve(q: np.ndarray, travel: np.ndarray, now: Any, of: Any = shape) -> np.ndarray:
                return np.asarray(of(q) * now.run_fraction * (now.run == RUN))

            hidden = [simulator.Effect(error, peak_um=peak, curve=curve)]
            told = answers(empty.Plan(*unknown.PLANS[options.runs], hidden), seeds)
            of_run = [[names for names in each if any(_is_of_run(text) for text in names)] for each in told]
            drifts = {f"{text}@run_time({RUN})" for text in right}
            by_error = sum(any(drifts & set(names) for names in each) for each in of_run)
            leads = sum(any(names[0] in drifts for names in each) for each in of_run)
            named = sum(map(bool, of_run))
            more = sum(
                len(each) > 1 or len(each) > len(mine) for each, mine in zip(told, of_run, strict=True)
            )
            print(
                f"| {name} | {peak:g} µm | {unknown.interval(named, len(told))} | {by_error} | {leads} | {more} |",
                flush=True,
            )


def _is_of_run(text: str) -> bool:
    return text.endswith(f"@run_time({RUN})")


if __name__ == "__main__":
    main()
