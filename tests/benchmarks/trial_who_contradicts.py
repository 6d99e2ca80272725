"""Who is said to be wrong of two, three and four setups, each read or stated otherwise in turn, and none.

``python tests/benchmarks/trial_who_contradicts.py --seeds 20``: every seed is a horizontal centre of its own, measured
in one run (``tests/simulator/horizontal_centre.py``, no code shared with the package), of which some setups are kept.
``--first``: the first seed; ``--only``: a part of a line's name; ``--level``: what is doubtful, 0.01 of `compare`,
0.001 of certificates.

By line: named alone (the wrong one, its instrument, or a part of it), among several, nobody alone, nothing said; and
accused falsely: alone or among several of which none is wrong.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.workflow.instruments.against_others import against_others
from tests.simulator import horizontal_centre as shop
from tests.simulator.four_instruments import Row

KEPT = (
    ("laser-X", "bar-xy"),
    ("bar-zx", "r-test-B"),
    ("laser-X", "laser-Y", "bar-xy"),
    ("laser-X", "bar-zx", "r-test-B"),
    ("laser-X", "laser-Y", "bar-xy", "bar-yz"),
    ("laser-X", "laser-Z", "bar-zx", "r-test-B"),
    ("bar-xy", "bar-zx", "r-test-B", "r-test-A"),
)
#: Readings of one setup times so much; a laser's, which hold the way travelled, are refused at once otherwise.
FACTORS = {"other sign": -1.0, "in mm": 1e-3}
SCALES = {"100 um/m too long": 1.0 + 1e-4}
#: mm that the tool point of one setup, and the length of the bar, are stated wrongly.
POINT, LENGTHS = np.array([0.0, -0.05, 0.08]), (5e-3, 50e-3)
OUTCOMES = ("alone", "among several", "nobody alone", "nothing said", "falsely accused", "refused")


def faults(kept: tuple[str, ...]) -> Iterator[tuple[str, frozenset[str]]]:
    """Every fault with the setups that are wrong; of a length all that share it."""
    yield "right", frozenset()
    for setup in kept:
        for name in SCALES if setup.startswith("laser") else (*FACTORS, "tool point"):
            yield f"{name}: {setup}", frozenset({setup})
    bars = frozenset(setup for setup in kept if setup.startswith("bar"))
    for more in LENGTHS:
        yield f"length {1e3 * more:g} um: bar", bars
    if len(bars) == 2:
        yield f"swapped: {', '.join(sorted(bars))}", bars


def written(folder: Path, seed: int, kept: tuple[str, ...], fault: str) -> Path:
    """A campaign of some setups with one fault."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    chain, text = shop.machine(truth), ""
    rows: list[Row] = []
    for measure in shop.INSTRUMENTS.values():
        setups, more = measure(chain, rng, rng)
        text, rows = text + setups, rows + more
    text, rows = shop.only_of(kept, text, rows)
    what, _, who = fault.partition(": ")
    if what in FACTORS | SCALES:
        shop.read_otherwise(rows, who, (FACTORS | SCALES)[what])
    elif what == "tool point":
        blocks = text.split("[[setups]]")
        wrong = f"tool_point_mm = {(shop.TOOL + POINT).tolist()}"
        right = f"tool_point_mm = {shop.TOOL.tolist()}"
        text = "[[setups]]".join(
            block.replace(right, wrong) if f'id = "{who}"' in block else block for block in blocks
        )
    elif what.startswith("length"):
        text = text.replace(
            f"length_mm = {shop.BAR}", f"length_mm = {shop.BAR + 1e-3 * float(what.split()[1])}"
        )
    elif what == "swapped":
        first, second = who.split(", ")
        other = {first: second, second: first}
        rows = [{**row, "setup": other.get(str(row["setup"]), row["setup"])} for row in rows]
    return chain.write(folder / "shop", text, rows)


def outcome(seed: int, kept: tuple[str, ...], fault: str, wrong: frozenset[str], level: float) -> str:
    """What is said of a campaign, as one of ``OUTCOMES``, with the names of who is accused falsely."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            campaign = read_campaign(written(Path(folder), seed, kept, fault))
        problem = campaign_method(campaign).problem_of(campaign)
        solution = solve_problem(problem)
    except MonitorError:
        return "refused"
    beside = against_others(problem, solution, campaign_method(campaign).instruments, 1, level)
    if beside is None:
        return "nothing said"
    if not beside.suspects:
        return "nobody alone"
    if not any(wrong & set(suspect.setups) for suspect in beside.suspects):
        return "falsely accused: " + " or ".join(suspect.name for suspect in beside.suspects)
    return "alone" if len(beside.suspects) == 1 else "among several"


def main() -> None:
    """Print the table and the totals."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--level", type=float, default=0.01)
    options = parser.parse_args()
    totals: dict[tuple[int, str], Counter[str]] = {}
    for kept in KEPT:
        for fault, wrong in faults(kept):
            name = f"{', '.join(kept)}; {fault}"
            if options.only not in name:
                continue
            seeds = range(options.first, options.first + options.seeds)
            said = Counter(outcome(seed, kept, fault, wrong, options.level) for seed in seeds)
            print(f"{name}: {dict(said)}", flush=True)
            total = totals.setdefault((len(kept), fault.split(":")[0].split()[0]), Counter())
            for what, count in said.items():
                total[what.partition(":")[0]] += count
    for (number, fault), total in sorted(totals.items()):
        false, of = total["falsely accused"], total.total()
        low, high = scipy.stats.binomtest(false, of).proportion_ci(method="exact")
        counts = ", ".join(f"{what} {total[what]}" for what in OUTCOMES)
        print(f"{number} setups, {fault}: {counts}; falsely {100 * low:.1f} to {100 * high:.1f} %")


if __name__ == "__main__":
    main()
