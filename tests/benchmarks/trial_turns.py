"""A laser there and back that turns beyond its ends, or waits there: is a play told as a play?

``python tests/benchmarks/trial_turns.py [SEEDS [FIRST]]`` prints the table of docs/trials-discovery.md. A play operator
of this file follows the whole way of the axis, beyond the ends too; what is read is at the targets alone. Every second
seed has heavy tails (Student, 3 degrees of freedom).
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from monitor.discovery import explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser

TARGETS = np.linspace(0.0, 750.0, 31)
#: Ways in mm beyond an end before the second reading there, and before the first target.
TURNS = {"beyond both ends": (5.0, 5.0), "beyond the far end": (5.0, 0.0), "waits": (0.0, 0.0)}
#: Widths in mm over which a play of 3 to 8 um turns over.
PLAYS = {"at once": 0.0, "over 2 mm": 2.0, "over 60 mm": 60.0, "none": None}


def way(beyond: float, first: float, passes: int) -> Iterator[tuple[float, bool]]:
    """Where an axis turns or stops in mm, and whether it is read there: both ends twice."""
    if first:
        yield -first, False
    for number in range(passes):
        there = TARGETS if number % 2 == 0 else TARGETS[::-1]
        if number and beyond:
            yield float(there[0]) + (beyond if number % 2 else -beyond), False
        for target in there:
            yield float(target), True


def deviations(
    rng: np.random.Generator, width: float | None, turn: tuple[float, float], *, heavy: bool
) -> list[list[tuple[float, float]]]:
    """Positions in mm and deviations in um of every run: a play, 10 um/m of gain and 0.5 um of noise."""
    size = 0.0 if width is None else float(rng.uniform(3.0, 8.0))
    passes, runs = (2, 4) if rng.random() < 0.6 else (4, 2)
    rows = []
    for _ in range(runs):
        side, before = float(rng.choice([-1.0, 1.0])), 0.0
        of_run = []
        for at, is_read in way(*turn, passes):
            if width is not None and at != before:
                side = float(
                    np.sign(at - before) if not width else np.clip(side + 2.0 * (at - before) / width, -1, 1)
                )
            before = at
            if is_read:
                noise = rng.standard_t(3) / np.sqrt(3.0) if heavy else rng.normal()
                of_run.append((at, 0.01 * at - side * size / 2.0 + 0.5 * float(noise)))
        rows.append(of_run)
    return rows


def told(runs: list[list[tuple[float, float]]], folder: Path) -> str:
    """The effects that are told of a laser along X."""
    chain = SimulatedChain(tuple(SimulatedAxis(name, "linear", along) for name, along in WAYS.items()))
    rows = [
        {"run": run, "setup": "laser", "X": x, "Y": 0.0, "Z": 0.0, "reading_um": round(1e3 * x + off, 2)}
        for run, of_run in enumerate(runs, 1)
        for x, off in of_run
    ]
    days = [f"2026-03-{day:02d}T20:00:00+00:00" for day in range(2, 2 + len(runs))]
    campaign = read_campaign(chain.write(folder / "laser", laser(), rows, started=days))
    problem = campaign_method(campaign).problem_of(campaign)
    missing = explain(campaign, problem, "instruments", rng=np.random.default_rng(1)).missing
    return " + ".join(each.effect for each in missing) or "nothing"


def main(seeds: int = 12, first: int = 0) -> None:
    """Print how each play is told after each turn."""
    for (turn, beyond), (play, width) in ((a, b) for a in TURNS.items() for b in PLAYS.items()):
        answers: Counter[str] = Counter()
        for seed in range(first, first + seeds):
            rng = np.random.default_rng([seed, list(TURNS).index(turn), list(PLAYS).index(play)])
            with tempfile.TemporaryDirectory() as folder:
                answers[told(deviations(rng, width, beyond, heavy=bool(seed % 2)), Path(folder))] += 1
        print(f"| {turn} | {play} | {dict(answers.most_common())} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
