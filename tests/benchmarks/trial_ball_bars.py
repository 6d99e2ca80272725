"""Trial of `explain` on ball bars in three planes of one run, whole circles and arcs of 220 degrees by turns.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_ball_bars.py [seeds] [first]

Prints of every hidden error how often all that it is, and nothing else, is named. The bars are simulated by the
distance of two points (tests/discovery/ball_bars.py), without a line of the package.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from by_path import load

from tests.discovery.ball_bars import Error, ball_bars, named

interval = load("trial_discovery", Path(__file__).with_name("trial_discovery.py")).interval

#: Hidden errors in um by what is to be named, which is all of it.
HIDDEN: dict[str, tuple[set[str], Error]] = {
    "nothing": (set(), lambda at, move, way: (0.0, 0.0, 0.0)),
    "squareness of 20 urad": (set(), lambda at, move, way: (0.0, 0.0, 0.02 * (at[0] - 200.0))),
    "play of X": ({"EXX:reversal"}, lambda at, move, way: (-2.0 * way[0], 0.0, 0.0)),
    "play of Y": ({"EYY:reversal"}, lambda at, move, way: (0.0, -2.0 * way[1], 0.0)),
    "lag of Y": ({"EYY:lag"}, lambda at, move, way: (0.0, -0.5 * move[1], 0.0)),
    "play and lag of Y": (
        {"EYY:lag", "EYY:reversal"},
        lambda at, move, way: (0.0, -2.0 * way[1] - 0.5 * move[1], 0.0),
    ),
    "bend of Z": ({"EYZ:poly2"}, lambda at, move, way: (0.0, 4.0 * ((at[2] - 300.0) / 100.0) ** 2, 0.0)),
    "S of X": (
        {"EZX:poly2", "EZX:poly3"},
        lambda at, move, way: (0.0, 0.0, 4.0 * ((at[0] - 200.0) / 100.0) ** 3),
    ),
}


def main(seeds: int = 10, first: int = 100) -> None:
    """Print the table."""
    print("| hidden | all of it, nothing else | otherwise |")
    print("| --- | --- | --- |")
    for row, (name, (right, error)) in enumerate(HIDDEN.items()):
        others: Counter[str] = Counter()
        # Empty ones are many: what is false is rare.
        count = seeds * (8 if not right else 1)
        for number in range(first, first + count):
            degrees = (-20.0, 201.0) if number % 2 else (0.0, 360.0)
            with tempfile.TemporaryDirectory() as folder:
                # Noise of its own for each.
                seed = 1000 * row + number
                told = named(ball_bars(Path(folder), error, degrees, seed, planes=("xy", "yz", "zx")))
            if told.keys() != right:
                others[" + ".join(told) or "nothing"] += 1
        wrong = ", ".join(f"{text} ({number})" for text, number in others.most_common(4))
        print(f"| {name} | {interval(count - others.total(), count)} | {wrong} |", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
