"""How often right campaigns of the usual setups are refused or accused, and the joint region holds the truth, on
machines of several orders of axes and sizes.

``python tests/benchmarks/trial_topologies.py --seeds 20``: every seed is a machine of its own of every topology, or of
every size (``--sizes``), measured in one run by laser, ball bar, R-test and a dial on a square, or by some of them
(``tests/simulator/topologies.py``, no code shared with the package: it is told the names of the errors that the method
has, and draws their values). Counted is what refuses the campaign or its certificate, what ``compare`` says at 1 %, and
with ``--explain`` what the search finds. The region is the ellipsoid at 95 % (JCGM 102, 6.5.2). ``--first``: the first
seed; ``--only``: a part of a topology.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import robust_fit
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.instruments.base import instrument_base
from monitor.methods.model import chain_of
from monitor.readers import read_campaign
from monitor.workflow.instruments.against_others import against_others
from monitor.workflow.instruments.instruments import disagreement
from monitor.workflow.uncertainty.grounds import grounds_of
from tests.simulator.topologies import Shop, truth_of

TOPOLOGIES = (
    "w C A b X Y Z t", "w B Z b X Y A t", "w C Y b X Z t", "w b X Y Z C A t", "w Y X b Z t", "w C b X Y Z B t",
)  # fmt: skip
#: Strokes of 100 mm, 200 mm, 400 mm, 2 m and 10 m.
SIZES = (0.25, 0.5, 1.0, 5.0, 25.0)
INSTRUMENTS = (
    ("laser", "bar", "r_test", "square"), ("laser", "bar"), ("laser", "r_test"), ("bar", "r_test"), ("laser",),
    ("bar",), ("r_test",),
)  # fmt: skip


def asked(topology: str, size: float, instruments: tuple[str, ...], seed: int) -> dict:
    """What is said of one campaign."""
    rng = np.random.default_rng([seed, *map(ord, topology), int(100 * size)])
    with tempfile.TemporaryDirectory() as folder:
        first = read_campaign(Shop(topology, {}, size).write(Path(folder) / "first", rng, instruments))
        names = instrument_base(chain_of(first.machine), first.artefact.setups)
        truth = truth_of(rng, names)
        campaign = read_campaign(Shop(topology, truth, size).write(Path(folder) / "shop", rng, instruments))
    method = campaign_method(campaign)
    try:
        robust = robust_fit(method.problem_of(campaign))
    except MonitorError as error:
        return {"refused": f"identify: {error}"[:160], "inside": None, "accused": False, "largest": np.nan}
    problem, solution = robust.fit.problem, robust.fit.solution
    at = [number for number in range(len(problem.base_names)) if solution.local_free[0, number]]
    off_by = np.array([solution.local[0, number] - truth[problem.base_names[number]] for number in at])
    covariance = solution.local_covariance[0][np.ix_(at, at)]
    grounds = sorted({ground.kind.value for ground in grounds_of(campaign, robust, 1)})
    square = float(off_by @ np.linalg.solve(covariance, off_by)) if at else 0.0
    return {
        "refused": ", ".join(grounds),
        "inside": square <= scipy.stats.chi2.ppf(0.95, len(at)) if at else None,
        "accused": against_others(problem, solution, method.instruments, 1) is not None
        or disagreement(problem, solution, method.instruments, 1) is not None,
        "largest": float(np.max(np.abs(off_by) / np.sqrt(np.diag(covariance)))) if at else 0.0,
    }


def _rate(count: int, of: int) -> str:
    low, high = scipy.stats.binomtest(count, of).proportion_ci(method="exact")
    return f"{count} of {of} ({100 * low:.1f} to {100 * high:.1f} %)"


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--sizes", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    cases = (
        [("w C Y b X Z t", size, INSTRUMENTS[0]) for size in SIZES]
        if options.sizes
        else [(topology, 1.0, ()) for topology in TOPOLOGIES]
    )
    everything = []
    for topology, size, instruments in cases:
        if options.only not in f"{topology},":
            continue
        answers = []
        for seed in range(options.first, options.first + options.seeds):
            chosen = instruments or INSTRUMENTS[seed % len(INSTRUMENTS)]
            if chosen == ("r_test",) and not Shop(topology, {}).rotary:
                chosen = ("laser", "bar")
            answers.append(asked(topology, size, chosen, seed))
        everything += answers
        judged = [answer["inside"] for answer in answers if answer["inside"] is not None]
        print(
            f"{topology}, strokes of {400.0 * size:g} mm: refused "
            f"{_rate(sum(bool(answer['refused']) for answer in answers), len(answers))} "
            f"{dict(Counter(answer['refused'] for answer in answers if answer['refused']))}; accused at 1 % "
            f"{_rate(sum(answer['accused'] for answer in answers), len(answers))}; in the region "
            f"{_rate(sum(judged), len(judged))}; largest error {max(answer['largest'] for answer in answers):.1f} u",
            flush=True,
        )
    refused = sum(bool(answer["refused"]) for answer in everything)
    accused = sum(answer["accused"] for answer in everything)
    print(f"all: refused {_rate(refused, len(everything))}, accused at 1 % {_rate(accused, len(everything))}")


if __name__ == "__main__":
    main()
