"""Ties that `explain` reports, and whether the next campaign, made as it says, breaks them rightly.

``python tests/benchmarks/trial_ties.py [SEEDS [FIRST]]`` prints the table of docs/trials-discovery.md. An effect is
hidden by the independent simulator; where `explain` names rivals, the campaign is measured again by a fresh seed, with
the poses that were offered added (all balls at each), or with the temperature no longer going with the warm-up, within
the runs where that is asked for. A tie is broken rightly where the hidden effect is then named and none of the rivals
that the action was for.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import beta

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load, simulator as simulator_of

from monitor.discovery import Explanation, explain
from monitor.methods.samba.method import problem_of
from monitor.workflow.explain.ties import TieBreak, ties_of

simulator = simulator_of()
virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery" / "virtual.py")

#: Hidden effects that one of the plans leaves tied.
HIDDEN = (
    ("cold-cold", "EXC:harmonic2"),
    ("cold-cold", "EYC:harmonic2"),
    ("cold-cold", "EXB:harmonic3"),
    ("cold-cold", "EYC:harmonic1"),
    ("five days", "EXC1:harmonic1"),
    ("five days", "EYC1:harmonic1"),
    ("one day", "EYY:poly2@x_axis_degC"),
    ("one day", "EYY:poly2@warmup"),
    ("one day", "EZC1:const@x_axis_degC"),
)
TAU_S = 3600.0


def following(schedule, run, fraction, rng):
    """A temperature that follows the warm-up curve from the first run on, by 6 K."""
    since = schedule.since_first_run_s()[run - 1] + 1200.0 * fraction
    return 20.0 + 6.0 * (1.0 - np.exp(-since / TAU_S)) + 0.05 * rng.standard_normal(len(run))


def independent(schedule, run, fraction, rng):
    """The same range, but as the hall has it: another temperature every run, whatever the time since the start."""
    level = rng.uniform(20.0, 26.0, schedule.runs)
    return level[run - 1] + 0.05 * rng.standard_normal(len(run))


def within_runs(schedule, run, fraction, rng):
    """The same range, gone through within the runs: each from one temperature to another, as the hall has them."""
    begins, ends = rng.uniform(20.0, 26.0, (2, schedule.runs))
    way = begins[run - 1] * (1.0 - fraction) + ends[run - 1] * fraction
    return way + 0.05 * rng.standard_normal(len(run))


def explained(plan_name: str, hidden: str, seed: int, poses=(), temperature=following) -> Explanation:
    rng = np.random.default_rng(seed)
    plan = simulator.cold_cold_plan() if plan_name == "cold-cold" else simulator.five_days_plan()
    more = [
        (ball, {name: float(np.degrees(angle)) for name, angle in pose.items()})
        for pose in poses
        for ball in "1234"
    ]
    plan = replace(plan, probings=(*plan.probings, *more))
    schedule = simulator.working_days(
        rng, days=1 if plan_name == "one day" else 4, runs_per_day=8 if plan_name == "one day" else 3
    )
    effect = simulator.Effect(hidden, peak_um=8.0, **({"tau_s": TAU_S} if "warmup" in hidden else {}))
    channels = {"x_axis_degC": temperature} if plan_name == "one day" else None
    machine = simulator.hu40(None, [effect])
    told = simulator.simulate(plan, machine, schedule, rng, noise_um=1.0, channels=channels)
    campaign = virtual.as_campaign(plan, machine, schedule, told, stated_um=1.0)
    return explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1))


def family(text: str) -> str:
    return text.partition("@")[0] + ("@warmup" if "@warmup" in text else "@" + text.partition("@")[2])


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    first_seed = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    totals: Counter[str] = Counter()
    print("| plan | hidden | campaigns | with a tie | acted on | broken rightly | no touch could |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row, (plan_name, hidden) in enumerate(HIDDEN):
        own = 100 * row + first_seed  # noise of its own for each row
        counts: Counter[str] = Counter()
        began = time.process_time()
        for seed in range(seeds):
            first = explained(plan_name, hidden, own + seed)
            # The finding whose group holds what was hidden; a wrong one is a matter of the trial of power.
            for found in first.missing[:1]:
                names = [found.effect, *(rival.effect for rival in found.rivals)]
                if len(names) < 2 or family(hidden) not in map(family, names):
                    continue
                counts["tied"] += 1
                ties = ties_of(found, names[1:], is_planned=True)
                told = {tie.broken_by for tie in ties}
                aimed = {
                    family(name)
                    for tie in ties
                    if tie.broken_by in (TieBreak.POSES, TieBreak.DRIVERS)
                    for name in tie.rivals
                }
                # The hidden effect may stand among the rivals: then the leader is what has to go.
                aimed = (aimed | {family(found.effect)}) - {family(hidden)}
                alike = {
                    family(name) for pair in found.separation.together if hidden in pair for name in pair
                }
                aimed -= alike
                if not told & {TieBreak.POSES, TieBreak.DRIVERS} or not aimed:
                    counts["nothing"] += 1
                    continue
                counts["acted"] += 1
                asked = within_runs if any(tie.within_runs for tie in ties) else independent
                after = explained(plan_name, hidden, 9000 + own + seed, found.separation.poses, asked)
                groups = [
                    {family(e.effect), *(family(r.effect) for r in e.rivals)} for e in after.missing[:1]
                ]
                right = bool(groups) and family(hidden) in groups[0] and not (aimed & groups[0])
                counts["right"] += right
                if not right:
                    print(
                        "   not broken:",
                        plan_name,
                        hidden,
                        seed,
                        sorted(aimed),
                        [sorted(g) for g in groups],
                        file=sys.stderr,
                    )
        totals += counts
        print(
            f"| {plan_name} | {hidden} | {seeds} | {counts['tied']} | {counts['acted']} | {counts['right']} | "
            f"{counts['nothing']} |",
            flush=True,
        )
        print(f"{hidden}: {time.process_time() - began:.0f} s of processor time", file=sys.stderr)
    n, k = totals["acted"], totals["right"]
    low = beta.ppf(0.05, k, n - k + 1) if k else 0.0
    print(f"broken rightly: {k} of {n} ({100 * k / max(n, 1):.1f} %, at least {100 * low:.1f} % with 95 %)")


if __name__ == "__main__":
    main()
