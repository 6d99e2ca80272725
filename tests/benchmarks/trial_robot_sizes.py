"""How often u of an effect's size holds on a robot that has more than is modelled; results in docs/trials-robots.md.

    python tests/benchmarks/trial_robot_sizes.py --seeds 200

A joint gives way by a known coefficient. Beside it stands what no model has: joints that come to rest anew, and
lines of gears. The shares are those of robots whose true coefficient lies within 2 u, of ``explain`` and of
``identify`` with the effect in the model.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from monitor.discovery import fit
from monitor.discovery.machine.evidence.poses import poses_of_rows, widening
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.variants import variants_of
from monitor.discovery.search.amplitudes import amplitudes
from monitor.effects import parse_effect
from monitor.methods.chain.problem import solve_problem
from monitor.methods.chain.shared_effects import shared_parameters
from monitor.methods.model import Model
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator import robot_campaign as robots

EFFECT, TRUE = "EBJ2:compliance@gravity", 2e-4
LINES = {
    "J1": (47.0, 1.2e-4, 0.3),
    "J3": (31.0, 1.5e-4, 2.0),
    "J4": (1.0, 2e-4, 4.0),
    "J5": (61.0, 1e-4, 1.0),
}
KINDS = {
    "nothing": (0.0, {}),
    "joints come to rest within 40 µrad": (40.0, {}),
    "lines of four joints": (0.0, LINES),
    "both": (40.0, LINES),
}


def sizes(campaign: Campaign) -> tuple[float, float, float, float]:
    """Coefficient and u of ``explain`` and of ``identify``, rad/mm."""
    problem = METHOD.problem_of(campaign)
    fitted = fit(problem)
    scene = scene_of(fitted, variants_of(parse_effect(EFFECT, problem.context.chain)))
    both = amplitudes(scene, scene.candidates)
    poses = poses_of_rows(fitted)
    assert poses is not None
    u = float(np.sqrt(both.covariance[0, 0]) * widening(scene, scene.candidates, poses)[0])
    with_effect = METHOD.problem_of(campaign, Model("with", added=(EFFECT,)))
    shared = shared_parameters(with_effect, solve_problem(with_effect, fitted.solution.local))
    return (
        float(both.estimate[0]),
        u,
        float(shared.estimate[0]),
        float(np.sqrt(shared.covariance[0, 0])),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--poses", type=int, default=120)
    options = parser.parse_args()
    print("| beside it | robots | explain: within 2 u, % | u, µrad/m | identify: within 2 u, % | u, µrad/m |")
    print("| --- | --- | --- | --- | --- | --- |")
    for kind, (repeatability, lines) in KINDS.items():
        rows = []
        for seed in range(options.seeds):
            hidden = robots.Hidden(compliance={"J2": TRUE}, harmonic=lines)
            rng = np.random.default_rng([seed, 31])
            track = robots.track(rng, hidden, poses=options.poses, repeatability_urad=repeatability)
            with tempfile.TemporaryDirectory() as folder:
                rows.append(sizes(read_campaign(robots.write_tracked(Path(folder) / "robot", track))))
        told, u, fitted, u_fitted = np.array(rows).T
        cells = []
        for value, spread in ((told, u), (fitted, u_fitted)):
            inside = np.abs(1e-3 * TRUE - value) <= 2.0 * spread
            cells += [f"{100.0 * inside.mean():.1f}", f"{1e9 * np.median(spread):.1f}"]
        print(f"| {kind} | {len(rows)} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
