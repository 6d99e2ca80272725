"""How often a tracker that was moved once within a run is named as that, and how often one that was not.

``python tests/benchmarks/trial_station_moves.py --seeds 20``: robots of the tests' simulator, which shares no code with
the package; 120 poses of three reflectors, 20 um of noise. What moves, moves by a shift and, at 3 m, a turn of the
stated size, at a moment between a fifth and four fifths of the run. With two reflectors beside the robot, seen every
tenth pose, and without. ``--first``: the first seed; ``--only``: a part of a case's name.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import explain
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from tests.simulator import robot_campaign as robots

POSES, NOISE_UM, DISTANCE_MM = 120, 20.0, 3000.0

#: What happens to n points as seen: their changes (n, 3) mm, of all or of those that the robot carries; and the first
#: reading that shows a move.
Change = tuple[np.ndarray, bool, int | None]


def vector(rng: np.random.Generator, size: float) -> np.ndarray:
    """A vector in any direction."""
    direction = rng.normal(size=3)
    return np.asarray(direction * size / np.linalg.norm(direction))


def moved(size_um: float, of_all: bool = True) -> Callable[[np.random.Generator, np.ndarray], Change]:
    """A shift and a turn from a moment on."""

    def change(rng: np.random.Generator, points: np.ndarray) -> Change:
        at = int(len(points) * rng.uniform(0.2, 0.8))
        shift, turn = vector(rng, 1e-3 * size_um), vector(rng, 1e-3 * size_um / DISTANCE_MM)
        after = np.arange(len(points)) >= at
        return after[:, None] * (shift + np.cross(turn, points)), of_all, at

    return change


def drifting(
    size_um: float, tau: float | None, of_all: bool
) -> Callable[[np.random.Generator, np.ndarray], Change]:
    """A shift that grows evenly over the run, or settles with a time constant in parts of it."""

    def change(rng: np.random.Generator, points: np.ndarray) -> Change:
        part = np.linspace(0.0, 1.0, len(points))
        grown = part if tau is None else 1.0 - np.exp(-part / tau)
        return np.outer(grown, vector(rng, 1e-3 * size_um)), of_all, None

    return change


def walking(size_um: float) -> Callable[[np.random.Generator, np.ndarray], Change]:
    """A tracker that walks so far in a run."""

    def change(rng: np.random.Generator, points: np.ndarray) -> Change:
        steps = rng.normal(0.0, 1e-3 * size_um / np.sqrt(len(points)), points.shape)
        return np.cumsum(steps, axis=0), True, None

    return change


CASES: dict[str, Callable[[np.random.Generator, np.ndarray], Change]] = {
    "the tracker moves by 50 um": moved(50.0),
    "the tracker moves by 100 um": moved(100.0),
    "the tracker moves by 200 um": moved(200.0),
    "the robot moves by 100 um": moved(100.0, of_all=False),
    "white": drifting(0.0, None, True),
    "the tracker drifts by 100 um": drifting(100.0, None, True),
    "the tracker warms up by 100 um": drifting(100.0, 0.2, True),
    "the robot warms up by 100 um": drifting(100.0, 0.2, False),
    "the robot warms up at once by 100 um": drifting(100.0, 0.05, False),
    "the tracker walks by 50 um": walking(50.0),
}


def told(seed: int, case: str, fixed_every: int) -> tuple[list[str], int | None]:
    """The effects that are named, the first reading that shows a move in truth."""
    rng = np.random.default_rng([seed, 77, list(CASES).index(case)])
    track = robots.track(rng, poses=POSES, fixed_every=fixed_every, noise_um=NOISE_UM)
    change, of_all, at = CASES[case](rng, track.points)
    carried = ~np.isin(track.target, list(robots.FIXED))
    points = track.points + change * (of_all | carried)[:, None]
    with tempfile.TemporaryDirectory() as folder:
        written = robots.write_tracked(Path(folder) / "robot", replace(track, points=np.round(points, 5)))
        campaign = read_campaign(written)
    answer = explain(campaign, METHOD.problem_of(campaign), "tracker", rng=np.random.default_rng(1))
    return [finding.effect for finding in answer.missing], at


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    for fixed_every in (10, 0):
        for case in CASES:
            if options.only not in case:
                continue
            named: Counter[str] = Counter()
            late, moves, alone = [], 0, 0
            for seed in range(options.first, options.first + options.seeds):
                effects, at = told(seed, case, fixed_every)
                kinds = [effect.partition("(")[0] for effect in effects]
                named[", ".join(kinds)] += 1
                moves += any(kind.endswith(":moved") for kind in kinds)
                alone += len(kinds) == 1 and kinds[0].endswith(":moved")
                if at is not None and kinds and kinds[0].endswith(":moved"):
                    late.append(int(effects[0].rpartition(" ")[2].rstrip(")")) - 1 - at)
            low, high = scipy.stats.binomtest(moves, options.seeds).proportion_ci(method="exact")
            print(
                f"{'with' if fixed_every else 'without'} resting reflectors, {case}: a move in {moves} "
                f"({100 * low:.1f} to {100 * high:.1f} %), alone in {alone}, of {options.seeds}; readings late "
                f"{min(late, default=0)} to {max(late, default=0)}; {dict(named)}",
                flush=True,
            )


if __name__ == "__main__":
    main()
