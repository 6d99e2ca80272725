"""Whom `explain` says to be wrong of the runs of an R-test, where one is, where one really differs, and nobody.

``python tests/benchmarks/trial_mistaken_runs.py --seeds 20``: every seed is a week of its own
(``tests/discovery/test_run_mistakes.py``, simulated without a line of the package), of which two or four runs are kept
and whose owner states 0.3 to 20 times the standard uncertainty. Real differences: a wave of 30 to 40 µm twice a turn,
four times the noise, a hidden error of C of 8 µm in all runs. ``--first``: the first seed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.discovery.test_run_mistakes import DEVIATIONS, MISTAKES, Row, campaign, stated, told

RUNS = ((1, 2), (1, 2, 3, 4))
STATED = (0.3, 1.0, 5.0, 10.0, 20.0)
#: Of a run that leaves as much as the others once it is right whatever is stated; a unit of two runs is not.
SAID = ("sign", "columns")


def wave(size: float) -> Callable[[Row], Row]:
    """A wave of so many µm twice a turn of C."""

    def moved(row: Row) -> Row:
        angle = np.deg2rad(float(str(row["C"])))
        return {**row, "dx_um": float(str(row["dx_um"])) + size * np.cos(2.0 * angle)}

    return moved


def noise(rng: np.random.Generator) -> Callable[[Row], Row]:
    """Four times the noise."""
    return lambda row: {**row, **{name: float(str(row[name])) + rng.normal(0.0, 2.0) for name in DEVIATIONS}}


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    accused, right, named, wrong = 0, 0, 0, 0
    for seed in range(options.first, options.first + options.seeds):
        rng = np.random.default_rng(seed)
        times, runs = float(rng.choice(STATED)), RUNS[seed % 2]
        odd = int(rng.integers(1, len(runs) + 1))
        real: dict[str, Callable[[Row], Row] | None] = {
            "right": None, "wave": wave(rng.uniform(30.0, 40.0)), "noise": noise(rng), "hidden": None,
        }  # fmt: skip
        for what, change in real.items():
            with tempfile.TemporaryDirectory() as folder:
                hidden = 8e-3 if what == "hidden" else 0.0
                found = stated(campaign(Path(folder), seed, change, of=(odd,), hidden=hidden), times, runs)
                mistakes = told(found)
            accused, right = accused + bool(mistakes), right + 1
            if mistakes:
                print(
                    f"  falsely, seed {seed}, {what} in run {odd} of {runs}, stated {times}: {mistakes}",
                    flush=True,
                )
        for what in SAID:
            with tempfile.TemporaryDirectory() as folder:
                mistakes = told(
                    stated(campaign(Path(folder), seed, MISTAKES[what][0], of=(odd,)), times, runs)
                )
            said = f"{MISTAKES[what][1]} in run {odd}" in mistakes
            others = [mistake for mistake in mistakes if not mistake.endswith(f"in run {odd}")]
            named, wrong = named + (said and not others), wrong + 1
            if not said or others:
                print(f"  seed {seed}, {what} in run {odd} of {runs}, stated {times}: {mistakes}", flush=True)
    for what, count, of in (("accused falsely", accused, right), ("the wrong run named alone", named, wrong)):
        low, high = scipy.stats.binomtest(count, of).proportion_ci(method="exact")
        print(f"{what}: {count} of {of} ({100 * low:.1f} to {100 * high:.1f} %)")


if __name__ == "__main__":
    main()
