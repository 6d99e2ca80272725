"""How often the joint region holds the truth where the scale of a laser is off, and who is said to be wrong.

``python tests/benchmarks/trial_scales.py --seeds 40``: every seed is a horizontal centre of its own, measured in one
run by laser, ball bar and R-test, or by the laser with the R-test (``tests/simulator/horizontal_centre.py``, no code
shared with the package). The laser's program had another air than there was; its setups state the uncertainty of their
scale, or not. The region is the ellipsoid of the stated covariance of all parameters at 95 % (chi-square, JCGM 102,
6.5.2). ``--first``: the first seed; ``--only``: a regular expression of the names.
"""

from __future__ import annotations

import argparse
import itertools
import re
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.as_stated import as_stated
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.workflow.instruments.against_others import against_others
from monitor.workflow.instruments.instruments import disagreement
from tests.simulator import horizontal_centre as shop

#: What the laser reads too much in um/m (B. Edlen, Metrologia 2 (1966) 71): a number, or drawn with this deviation.
AIR = {
    "right": 0.0, "air 1 K": 0.95, "pressure 10 hPa": 2.7, "drawn 1 um/m": (1.0,), "drawn 3 um/m": (3.0,),
    "material 1 K": 11.5, "mmHg for hPa": 68.0,
}  # fmt: skip
#: What the setups of the laser state, um/m.
STATED = {"no key": None, "u = 1 um/m": 1.0, "u = 3 um/m": 3.0}
WITH = {"laser, bar, R-test": ("laser", "bar", "r-test"), "laser, R-test": ("laser", "r-test")}

#: At this level a certificate is refused (the ground ``instruments``).
REFUSED = 1e-3


def measured(seed: int) -> tuple[Campaign, dict[str, float]]:
    """A right campaign by all three, and what is true."""
    rng = np.random.default_rng(seed)
    truth = shop.truth_of(rng)
    with tempfile.TemporaryDirectory() as folder:
        campaign = read_campaign(shop.campaign(Path(folder) / "shop", rng, truth))
    return campaign, {**truth, "EZ0B": truth["EZ0B"] - truth["EZ0A"]}


def scaled(campaign: Campaign, off: float, stated: float | None, instruments: tuple[str, ...]) -> Campaign:
    """The campaign by some of its instruments, of which the laser reads ``off`` um/m too much and states u."""
    setups, probings = campaign.artefact.setups, campaign.probings
    laser = [setup.id.startswith("laser") for setup in setups]
    number = probings.channels["setup"].astype(int) - 1
    readings = probings.channels["reading_um"] * np.where(np.array(laser)[number], 1.0 + 1e-6 * off, 1.0)
    if stated is not None:
        setups = tuple(
            replace(setup, scale_uncertainty=1e-6 * stated) if is_laser else setup
            for setup, is_laser in zip(setups, laser, strict=True)
        )
    kept = [index for index, setup in enumerate(setups) if setup.id.startswith(instruments)]
    rows = np.flatnonzero(np.isin(number, kept))
    chosen = probings.rows(rows)
    channels = {**chosen.channels, "reading_um": readings[rows]}
    return replace(
        campaign,
        artefact=replace(campaign.artefact, setups=setups),
        probings=replace(chosen, channels=channels),
    )


def asked(campaign: Campaign, truth: dict[str, float]) -> dict:
    """What is said of one campaign."""
    method = campaign_method(campaign)
    problem = method.problem_of(campaign)
    solution = solve_problem(problem)
    at = [number for number in range(len(problem.base_names)) if solution.local_free[0, number]]
    off_by = np.array([solution.local[0, number] - truth[problem.base_names[number]] for number in at])
    covariance = solution.local_covariance[0][np.ix_(at, at)]
    square = float(off_by @ np.linalg.solve(covariance, off_by))
    beside = against_others(problem, solution, method.instruments, 1)
    u = np.sqrt(np.diag(solution.local_covariance[0]))
    return {
        "inside": square <= scipy.stats.chi2.ppf(0.95, len(at)),
        "largest": float(np.max(np.abs(off_by) / np.sqrt(np.diag(covariance)))),
        "refused": against_others(problem, solution, method.instruments, 1, REFUSED) is not None
        or disagreement(problem, solution, method.instruments, 1, REFUSED) is not None,
        "told": any("scale" in each.moved for each in as_stated(problem)),
        "who": () if beside is None else tuple(suspect.name for suspect in beside.suspects),
        "u": 1e6 * float(u[problem.base_names.index("EXX")]),
    }


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    answers: dict[str, list[dict]] = {}
    for seed in range(options.first, options.first + options.seeds):
        right, truth = measured(seed)
        for (with_name, instruments), (air, size), (key, stated) in itertools.product(
            WITH.items(), AIR.items(), STATED.items()
        ):
            name = f"{with_name}; {air}; {key}"
            if re.search(options.only, name):
                drawn = float(np.random.default_rng([seed, 3]).normal())
                off = size[0] * drawn if isinstance(size, tuple) else size
                answers.setdefault(name, []).append(asked(scaled(right, off, stated, instruments), truth))
        print(f"{seed + 1 - options.first} of {options.seeds}", file=sys.stderr, flush=True)
    for name, of_name in answers.items():
        inside, count = sum(answer["inside"] for answer in of_name), len(of_name)
        low, high = scipy.stats.binomtest(inside, count).proportion_ci(method="exact")
        print(
            f"{name}: in the region {inside} of {count} ({100 * low:.1f} to {100 * high:.1f} %); largest error, median "
            f"{np.median([answer['largest'] for answer in of_name]):.1f} u, most "
            f"{max(answer['largest'] for answer in of_name):.1f} u; u of EXX "
            f"{np.mean([answer['u'] for answer in of_name]):.2f}; told {sum(answer['told'] for answer in of_name)}; "
            f"refused by instruments {sum(answer['refused'] for answer in of_name)}; "
            f"named {dict(Counter(answer['who'] for answer in of_name))}",
            flush=True,
        )


if __name__ == "__main__":
    main()
