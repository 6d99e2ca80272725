"""Trial of `explain` of a model that an unknown shape was added to.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_grown.py --first 400 --seeds 6

An error outside the catalogue is hidden, what `explain` names of it is added, and `explain` is asked again: ``alone``
with nothing else in the campaign, ``beside`` with a further effect of the catalogue, another one for every seed, that
the campaign has from the second time on. What is named of other errors is false. No free shape follows the sharp steps.
Everything hidden stems from tests/simulator, which shares no code with the package.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load, simulator as simulator_of

from monitor.discovery import Explanation, explain
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of

ROOT = Path(__file__).resolve().parents[2]
simulator = simulator_of()
virtual_campaigns = load("virtual_campaigns", ROOT / "tests" / "discovery" / "virtual.py")
unknown = load("trial_unknown", ROOT / "tests" / "benchmarks" / "trial_unknown.py")
interval = load("trial_discovery", ROOT / "tests" / "benchmarks" / "trial_discovery.py").interval

#: Sharp steps, and families of trial_unknown.
SHAPES = {
    "step within 0.2 mm": ("EXX:curve", lambda q, t, now: np.tanh((q - 12.0) / 0.2)),
    "step of Y within 0.2 mm": ("EXY:curve", lambda q, t, now: np.tanh((q - np.median(q) - 7.0) / 0.2)),
    **{
        name: unknown.FAMILIES[name][1:]
        for name in ("step in a scale", "wear bump", "play over 40 mm", "sawtooth of a gear")
    },
}
#: Further effects of other errors than those of the shapes.
FURTHER = ("EYY:reversal", "EZX:poly2", "EYB:harmonic2", "EBC:harmonic1", "EZC1:const@warmup", "EXZ:poly3")


def named(campaign: object, added: tuple[str, ...] = ()) -> Explanation:
    model = Model("grown", added=added) if added else None
    problem = problem_of(campaign, model) if model else problem_of(campaign)
    return explain(campaign, problem, "grown", rng=np.random.default_rng(1))


def answered(seed: int, shape: str, peak: float, further: float) -> dict[str, str]:
    """What is named after the shape was added, alone and beside a further effect of so many µm: ``nothing``, ``right``
    or the names; "(says so)" where the shape that was added is said not to follow."""
    effect, curve = SHAPES[shape]
    hidden = [simulator.Effect(effect, peak_um=peak, curve=curve)]
    alone, _ = virtual_campaigns.virtual(seed, hidden, days=2, runs_per_day=4)
    added = tuple(finding.effect for finding in named(alone).missing)
    if not added:
        return {}
    more = FURTHER[seed % len(FURTHER)]
    hidden.append(simulator.Effect(more, peak_um=further))
    beside, _ = virtual_campaigns.virtual(seed, hidden, days=2, runs_per_day=4)
    answers = {"added": " + ".join(added)}
    for case, campaign, right in (("alone", alone, ()), ("beside", beside, (more,))):
        answer = named(campaign, added)
        names = [
            finding.effect
            for finding in answer.missing
            if finding.effect.partition(":")[0] != effect.partition(":")[0]
            and not {finding.effect, *(rival.effect for rival in finding.rivals)}.intersection(right)
        ]
        found = "right" if right and len(names) < len(answer.missing) else "nothing"
        answers[case] = f"{found}{' + '.join(['', *names])}"
        if getattr(answer, "not_followed", ()):
            answers[case] += " (says so)"
    return answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=400)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--peak", type=float, default=8.0, help="µm of the shape")
    parser.add_argument("--further", type=float, default=4.0, help="µm of the further effect")
    parser.add_argument("--only", nargs="*", default=list(SHAPES))
    options = parser.parse_args()
    counts: dict[tuple[str, str], Counter[str]] = {}
    for shape in options.only:
        for seed in range(options.first, options.first + options.seeds):
            for case, answer in answered(seed, shape, options.peak, options.further).items():
                print(f"{shape}, {seed}, {case}: {answer}", flush=True)
                if case == "added":
                    continue
                count = counts.setdefault((shape, case), Counter())
                count["of"] += 1
                count["right"] += answer.startswith("right")
                count["false"] += " + " in answer
                count["says so"] += answer.endswith("(says so)")
    print("\n| shape | case | the further one named | something else named | said not to follow |")
    print("| --- | --- | --- | --- | --- |")
    for (shape, case), count in counts.items():
        cells = [interval(count[key], count["of"]) for key in ("right", "false", "says so")]
        print(f"| {shape} | {case} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
