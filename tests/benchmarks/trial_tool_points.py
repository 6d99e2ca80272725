"""How often the joint region holds the truth where the stated tool point of an instrument is off.

``python tests/benchmarks/trial_tool_points.py --seeds 200``: every seed is a horizontal centre of its own, measured in
one run by laser, ball bar and R-test (``tests/simulator/horizontal_centre.py``, no code shared with the package). The
tool point of the R-test is stated off by what each case says, with that uncertainty of each coordinate. The region is
the ellipsoid of the stated covariance of all parameters at 95 % (chi-square, JCGM 102, 6.5.2). ``--first``: the first
seed; ``--only``: a part of a name.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from tests.simulator import horizontal_centre as shop

#: By case: what the tool point is off, mm (a standard deviation of each coordinate, or itself), and its stated u.
CASES: dict[str, tuple[float | tuple[float, float, float], float | None]] = {
    "right and known": (0.0, None),
    "0.3, -0.2 and 1.0 mm off, u = 1 mm": ((0.3, -0.2, 1.0), 1.0),
    "drawn, u = 1 mm": (1.0, 1.0),
    "drawn, u = 10 um": (0.01, 0.01),
}


def outside(seed: int, off: float | tuple[float, float, float], u: float | None) -> tuple[bool, float]:
    """Whether the truth lies outside the joint region of all parameters, and the largest error in u."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    moved = np.random.default_rng([seed, 2]).normal(0.0, off, 3) if isinstance(off, float) else np.array(off)
    with tempfile.TemporaryDirectory() as folder:
        path = shop.campaign(Path(folder) / "shop", rng, truth)
        point = f"tool_point_mm = {shop.TOOL.tolist()}\n"
        stated = f"tool_point_mm = {(shop.TOOL - moved).tolist()}\n"
        if u is not None:
            stated += f"tool_point_standard_uncertainty_mm = {u}\n"
        file = path / "campaign.toml"
        setups = file.read_text(encoding="utf-8").split("[[setups]]")
        changed = [text.replace(point, stated) if 'id = "r-test' in text else text for text in setups]
        file.write_text("[[setups]]".join(changed), encoding="utf-8")
        campaign = read_campaign(path)
    problem = campaign_method(campaign).problem_of(campaign)
    solution = solve_problem(problem)
    expected = {**truth, "EZ0B": truth["EZ0B"] - truth["EZ0A"]}
    at = [number for number in range(len(problem.base_names)) if solution.local_free[0, number]]
    off_by = np.array([solution.local[0, number] - expected[problem.base_names[number]] for number in at])
    covariance = solution.local_covariance[0][np.ix_(at, at)]
    square = float(off_by @ np.linalg.solve(covariance, off_by))
    return square > scipy.stats.chi2.ppf(0.95, len(at)), float(
        np.max(np.abs(off_by) / np.sqrt(np.diag(covariance)))
    )


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    begin = time.process_time()
    for name, (off, u) in CASES.items():
        if options.only not in name:
            continue
        answers, refused = [], 0
        for seed in range(options.first, options.first + options.seeds):
            try:
                answers.append(outside(seed, off, u))
            except MonitorError:
                refused += 1
        inside, count = sum(not out for out, _ in answers), len(answers)
        low, high = scipy.stats.binomtest(inside, count).proportion_ci(method="exact")
        print(
            f"{name}: truth in the region in {inside} of {count}, {100 * inside / count:.1f} % "
            f"({100 * low:.1f} to {100 * high:.1f}); refused {refused}; largest error in u "
            f"{max(largest for _, largest in answers):.1f}; {time.process_time() - begin:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
