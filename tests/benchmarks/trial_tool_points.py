"""How often the joint region holds the truth where the stated tool point of an instrument is off.

``python tests/benchmarks/trial_tool_points.py --seeds 200``: every seed is a horizontal centre of its own, measured in
one run by laser, ball bar and R-test (``tests/simulator/horizontal_centre.py``, no code shared with the package). The
tool point of the R-test is stated off by what each case says, with that uncertainty of each coordinate. The region is
the ellipsoid of the stated covariance of all parameters at 95 % (chi-square, JCGM 102, 6.5.2). ``--first``: the first
seed; ``--only``: a part of a name. ``--sizes``: the tool point of each instrument, and of each R-test alone, stated off
along each axis by five sizes and known as stated: what refuses the campaign or its certificate, whether `identify`
says that the most wrong number counts from that point, and how far the others are off.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import robust_fit
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.as_stated import as_stated
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.uncertainty.grounds import grounds_of
from tests.simulator import horizontal_centre as shop

#: By case: what the tool point is off, mm (a standard deviation of each coordinate, or itself), and its stated u.
CASES: dict[str, tuple[float | tuple[float, float, float], float | None]] = {
    "right and known": (0.0, None),
    "0.3, -0.2 and 1.0 mm off, u = 1 mm": ((0.3, -0.2, 1.0), 1.0),
    "drawn, u = 1 mm": (1.0, 1.0),
    "drawn, u = 10 um": (0.01, 0.01),
}
#: Whose tool point is stated off, by the beginning of its setups, and by how much, mm.
SETUPS, SIZES = ("laser", "bar", "r-test", "r-test-B", "r-test-A"), (0.01, 0.1, 0.3, 1.0, 3.0)


def stated_off(
    rng: np.random.Generator, truth: dict[str, float], setups: str, off: np.ndarray, key: str = ""
) -> Campaign:
    """A campaign whose ``setups`` state a tool point that is ``off`` mm, with a ``key``."""
    with tempfile.TemporaryDirectory() as folder:
        path = shop.campaign(Path(folder) / "shop", rng, truth)
        point = f"tool_point_mm = {shop.TOOL.tolist()}\n"
        stated = f"tool_point_mm = {(shop.TOOL - off).tolist()}\n{key}"
        file = path / "campaign.toml"
        tables = file.read_text(encoding="utf-8").split("[[setups]]")
        changed = [
            text.replace(point, stated) if text.startswith(f'\nid = "{setups}') else text for text in tables
        ]
        file.write_text("[[setups]]".join(changed), encoding="utf-8")
        return read_campaign(path)


def said(seed: int, setups: str, off: np.ndarray) -> tuple[str, float, float]:
    """What is said of a campaign, the largest error of a number in u, and that of those that `identify` does not call
    counted from the tool points as stated."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    campaign = stated_off(rng, truth, setups, off)
    try:
        robust = robust_fit(campaign_method(campaign).problem_of(campaign))
    except MonitorError as error:
        named = "tool_point_mm" in str(error)
        return "identify refuses" + (" and names the point" if named else ""), np.nan, np.nan
    # These lasers state nothing of their scale, and it is exact.
    kinds = sorted({ground.kind.value for ground in grounds_of(campaign, robust, 1)} - {"scale"})
    solution, problem = robust.fit.solution, robust.fit.problem
    points = [each.moved for each in as_stated(problem) if "scale" not in each.moved]
    counted = {name for moved in points for names in moved.values() for name in names}
    expected = {**truth, "EZ0B": truth["EZ0B"] - truth["EZ0A"]}
    off_by = {
        name: abs(solution.local[0, number] - expected[name])
        / float(np.sqrt(solution.local_covariance[0, number, number]))
        for number, name in enumerate(problem.base_names)
        if solution.local_free[0, number]
    }
    others = max(size for name, size in off_by.items() if name not in counted)
    return ", ".join(kinds) or "issued", max(off_by.values()), others


def sizes(first: int, seeds: int, only: str) -> None:
    """Print what is said of each tool point that is stated off."""
    for setups in SETUPS:
        for axis, letter in enumerate("xyz"):
            for size in SIZES:
                name = f"{setups} {letter} {size:g} mm"
                if only not in f"{name},":
                    continue
                off = size * np.eye(3)[axis]
                answers = [said(seed, setups, off) for seed in range(first, first + seeds)]
                issued = [answer for answer in answers if answer[0] == "issued"]
                print(
                    f"{name}: {dict(Counter(answer[0] for answer in answers))}; issued: largest error in u "
                    f"{max((answer[1] for answer in issued), default=np.nan):.1f}, without what counts from the "
                    f"point {max((answer[2] for answer in issued), default=np.nan):.1f}",
                    flush=True,
                )


def outside(seed: int, off: float | tuple[float, float, float], u: float | None) -> tuple[bool, float]:
    """Whether the truth lies outside the joint region of all parameters, and the largest error in u."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    moved = np.random.default_rng([seed, 2]).normal(0.0, off, 3) if isinstance(off, float) else np.array(off)
    key = "" if u is None else f"tool_point_standard_uncertainty_mm = {u}\n"
    campaign = stated_off(rng, truth, "r-test", moved, key)
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
    parser.add_argument("--sizes", action="store_true")
    options = parser.parse_args()
    if options.sizes:
        sizes(options.first, options.seeds, options.only)
        return
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
