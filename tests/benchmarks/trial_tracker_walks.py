"""What is told of a robot whose tracker walks while it measures, and of one that something happens to beside it.

``python tests/benchmarks/trial_tracker_walks.py --seeds 20``: robots of the tests' simulator, which shares no code with
the package; 240 poses of three reflectors in random order and two reflectors beside the robot every tenth pose (768
rows of 5 s) in as many runs as ``--runs`` says, 16 um of noise on every coordinate. A walk adds a step to each
coordinate from row to row, 0.3 to 2 um of standard deviation, another one of every robot. ``--poses``: more poses;
``--first``: the first seed; ``--only``: a part of a case's name.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import explain
from monitor.methods.tracker.method import METHOD
from monitor.readers import read_campaign
from tests.simulator import robot_campaign as robots

POSES, NOISE_MM, ROW_S = 240, 0.016, 5.0
# The tracker warms up over half an hour.
WARM_UP_S = 600.0
ROBOT = robots.Hidden(compliance={"J2": 2e-4}, harmonic={"J3": (2, 1.5e-4, 0.7)})

#: By case: whether the tracker walks, what happens to it, what the robot hides, and the names that are right.
CASES = {
    "walks": (True, "", None, ()),
    "white": (False, "", None, ()),
    "warms up": (False, "warm-up", None, ("tracker:shift@",)),
    "walks and warms up": (True, "warm-up", None, ("tracker:shift@",)),
    "moves by 50 um": (False, "move", None, ("tracker:moved",)),
    "walks and moves by 50 um": (True, "move", None, ("tracker:moved",)),
    "hides two": (False, "", ROBOT, ("EBJ2:compliance@gravity", "EBJ3:harmonic2")),
    "walks and hides two": (True, "", ROBOT, ("EBJ2:compliance@gravity", "EBJ3:harmonic2")),
}


def happens(rng: np.random.Generator, what: str, first: np.ndarray) -> np.ndarray:
    """How far (n, 3) mm the tracker is off at every row; ``first`` (n,) is the first row of its run."""
    rows = np.arange(len(first))
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    part = np.zeros(len(first))
    if what == "warm-up":
        part = 0.1 * (1.0 - np.exp(-ROW_S * rows / WARM_UP_S))
    elif what == "move":
        begins = np.unique(first)
        run = int(rng.choice(begins))
        length = len(first) // len(begins)
        after = run + int(length * rng.uniform(0.2, 0.8))
        part = 0.05 * ((first == run) & (rows >= after))
    return np.outer(part, direction)


def write(folder: Path, track: robots.Tracked, first: np.ndarray) -> Path:
    """The campaign folder, cut into runs that follow each other at once."""
    written = robots.write_tracked(folder, track, noise_um=1e3 * NOISE_MM)
    lines = (written / "probings.csv").read_text().splitlines()
    rows = [line.split(",", 3)[3] for line in lines[1:]]
    begins = np.unique(first)
    run = np.searchsorted(begins, first, side="right")
    cut = [f"{run[row]},{row + 1},{ROW_S * (row - first[row]):.1f},{text}" for row, text in enumerate(rows)]
    (written / "probings.csv").write_text("\n".join([lines[0], *cut]) + "\n")
    moments = np.datetime64("2026-03-02T06:30:00") + (ROW_S * begins).astype("timedelta64[s]")
    runs = [f"{number},{moment}+00:00,1,false,21.3" for number, moment in enumerate(moments, 1)]
    (written / "runs.csv").write_text("run,started_at,day,warm_up,ambient_degC\n" + "\n".join(runs) + "\n")
    return written


def told(seed: int, case: str, runs: int, poses: int = POSES) -> tuple[list[tuple[str, ...]], float]:
    """The effects that are named, each with its rivals; the processor time in s."""
    walks, what, hidden, _ = CASES[case]
    rng = np.random.default_rng([seed, 29])
    track = robots.track(rng, hidden, poses=poses, fixed_every=10, noise_um=0.0)
    count = len(track.points)
    first = np.repeat(np.arange(runs) * (count // runs), count // runs)
    first = np.append(first, np.full(count - len(first), first[-1]))
    off = NOISE_MM * rng.normal(size=(count, 3)) + happens(rng, what, first)
    step = 1e-3 * rng.uniform(0.3, 2.0)
    if walks:
        off += np.cumsum(step * rng.normal(size=(count, 3)), axis=0)
    with tempfile.TemporaryDirectory() as folder:
        made = replace(track, points=np.round(track.points + off, 5))
        campaign = read_campaign(write(Path(folder) / "robot", made, first))
    begun = time.process_time()
    answer = explain(campaign, METHOD.problem_of(campaign), "tracker", rng=np.random.default_rng(1))
    names = [(each.effect, *(rival.effect for rival in each.rivals)) for each in answer.missing]
    return names, time.process_time() - begun


def share(count: int, of: int) -> str:
    """A count with its exact 95 % interval."""
    interval = scipy.stats.binomtest(count, of).proportion_ci(method="exact")
    return f"{count} of {of} ({100 * interval.low:.1f} to {100 * interval.high:.1f} %)"


def table(case: str, runs: int, seeds: Sequence[int], poses: int) -> str:
    """The rates of a case."""
    wanted = CASES[case][3]
    found = false = 0
    said: Counter[str] = Counter()
    seconds = []
    for seed in seeds:
        names, lasted = told(seed, case, runs, poses)
        seconds.append(lasted)
        found += all(any(each[0].startswith(name) for each in names) for name in wanted)
        others = [each for each in names if not any(one.startswith(name) for one in each for name in wanted)]
        false += bool(others)
        said[", ".join(each[0] for each in names) or "nothing"] += 1
        print(f"{case}, {runs} runs, seed {seed}: {names}; {lasted:.1f} s", file=sys.stderr, flush=True)
    return (
        f"{case}, {runs} runs: right first in {share(found, len(seeds))}, something else in "
        f"{share(false, len(seeds))}; {np.median(seconds):.1f} s, at most {max(seconds):.1f} s; {dict(said)}"
    )


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--runs", type=int, nargs="+", default=[2])
    parser.add_argument("--poses", type=int, default=POSES)
    parser.add_argument("--only", nargs="+", default=list(CASES))
    options = parser.parse_args()
    for runs in options.runs:
        for case in options.only:
            seeds = range(options.first, options.first + options.seeds)
            print(table(case, runs, seeds, options.poses), flush=True)


if __name__ == "__main__":
    main()
