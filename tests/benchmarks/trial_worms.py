"""A rotary table alone before an autocollimator: is the worm that turns it found, and nothing where there is none?

``python tests/benchmarks/trial_worms.py [SEEDS [FIRST]]`` prints the table of docs/trials-discovery.md: an error of
6 to 12 urad that repeats 5 to 17 times a turn, read every 5 to 15 degrees (more than twice a period) with 1 urad, there
and back twice; half of the tables have a play besides. An order is right to 0.1, and so is a play, a lag or a wind-up
for a play. The table is simulated here by numpy alone.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from monitor.discovery import explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, Z

TABLE = SimulatedChain((), (SimulatedAxis("C", "rotary", Z, sign=-1),))
AUTOCOLLIMATOR = """
[[setups]]
id = "autocollimator"
reading = "angle"
instrument = "autocollimator"
direction = [0.0, 0.0, 1.0]
standard_uncertainty_urad = 1.0
"""
NOISES = ("white", "heavy tails", "rho 0.6", "random walk")


def noise(rng: np.random.Generator, count: int, kind: str) -> np.ndarray:
    """Noise (count,) in urad of standard deviation 1; a walk has steps of 0.3."""
    white = rng.normal(size=count)
    if kind == "heavy tails":
        return np.asarray(rng.standard_t(3, count) / np.sqrt(3.0))
    if kind == "random walk":
        return np.asarray(0.3 * np.cumsum(rng.normal(size=count)) + white)
    if kind == "rho 0.6":
        for row in range(1, count):
            white[row] = 0.6 * white[row - 1] + 0.8 * white[row]
    return white


def told(rng: np.random.Generator, order: int | None, play: float, kind: str, folder: Path) -> list[str]:
    """The effects that are told of a table."""
    steps = [72, 48, 36, 30, 24]
    step = 360.0 / float(rng.choice([each for each in steps if order is None or each > 2 * order + 1]))
    size, phase = float(rng.uniform(6.0, 12.0)), float(rng.uniform(0.0, 2.0 * np.pi))
    there = np.arange(0.0, 360.0 + step / 2.0, step)
    rows: list[dict[str, object]] = []
    runs = int(rng.choice([1, 2, 4]))
    for run in range(1, runs + 1):
        at = np.concatenate([there, there[::-1], there, there[::-1]])
        side = np.repeat([1.0, -1.0, 1.0, -1.0], len(there))
        first_again = np.arange(1, 4) * len(there)
        side[first_again] = -side[first_again]  # the table waits at its ends
        error = play * side / 2.0
        if order is not None:
            error = error + size * np.cos(order * np.radians(at) + phase)
        read = error + float(rng.normal(0.0, 10.0)) + noise(rng, len(at), kind)
        rows += [
            {"run": run, "setup": "autocollimator", "time_s": 6.0 * row, "C": angle, "reading_urad": number}
            for row, (angle, number) in enumerate(zip(at, read, strict=True))
        ]
    days = [f"2026-03-{day:02d}T08:00:00+00:00" for day in range(2, 2 + runs)]
    campaign = read_campaign(TABLE.write(folder / "table", AUTOCOLLIMATOR, rows, started=days))
    problem = campaign_method(campaign).problem_of(campaign)
    missing = explain(campaign, problem, "instruments", rng=np.random.default_rng(1)).missing
    return [each.effect for each in missing]


def is_of_order(effect: str, order: int) -> bool:
    """Whether an effect is a wave of the table that repeats so often a turn."""
    kind, _, number = effect.partition(":harmonic")
    return kind == "ECC" and number.replace(".", "").isdigit() and abs(float(number) - order) < 0.1


def main(seeds: int = 24, first: int = 0) -> None:
    """Print how each table is told."""
    for row, (kind, has_worm) in enumerate((kind, worm) for worm in (True, False) for kind in NOISES):
        right, others, answers = 0, 0, Counter[str]()
        for seed in range(first, first + seeds):
            rng = np.random.default_rng([seed, row])
            order = int(rng.integers(5, 18)) if has_worm else None
            play = float(rng.uniform(4.0, 8.0)) if has_worm and seed % 2 else 0.0
            with tempfile.TemporaryDirectory() as folder:
                effects = told(rng, order, play, kind, Path(folder))
            worms = [each for each in effects if order is not None and is_of_order(each, order)]
            plays = [each for each in effects if each.startswith(("ECC:reversal", "ECC:lag", "ECC:windup"))]
            rest = [each for each in effects if each not in worms and not (play and each in plays)]
            right += len(worms) == (order is not None) and bool(plays) == bool(play) and not rest
            others += bool(rest)
            answers.update(rest)
        print(
            f"| {'worm' if has_worm else 'nothing'} | {kind} | {right} of {seeds} | {others} | "
            f"{dict(answers.most_common(4))} |",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
