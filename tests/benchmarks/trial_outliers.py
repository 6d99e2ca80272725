"""One wrong reading at every position of three plans, 0.01 to 50 mm; the results are in ``docs/trials-outliers.md``.

    python tests/benchmarks/trial_outliers.py

At every row of run 2 one reading is put off, the axis and the sign in turn, by each size. Named: the first fit marks it
and no other. Found: ``explain`` reports it among the bad points (asked at every sixth row for sizes that are not
marked, else the mark is what it reports). False: other rows than that one. A touch along a normal is put off along the
reading that it notices most.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "discovery")]

import gross_readings as wrong  # noqa: E402
import virtual  # noqa: E402

from monitor.discovery import explain, robust_fit  # noqa: E402
from monitor.exceptions import MonitorError  # noqa: E402
from monitor.methods import campaign_method  # noqa: E402
from monitor.readers import read_campaign  # noqa: E402

SIZES_MM = (0.01, 0.05, 0.5, 5.0, 50.0)
EVERY = 6


def campaign_of(plan: str):
    """A simulated campaign of that machine, else the example of that name."""
    if plan in virtual.OTHER_MACHINES:
        return virtual.on_machine(plan, 5)[0]
    return read_campaign(TESTS.parent / "examples" / plan)


def main() -> None:
    """Try every position of the plans and print a line for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plans", nargs="*", default=["trunnion", "five-days", "tilting-table"])
    parser.add_argument("--every", type=int, default=1, help="only every so many positions")
    wanted = parser.parse_args()
    for plan in wanted.plans:
        campaign = campaign_of(plan)
        method = campaign_method(campaign)
        whole = method.problem_of(campaign, method.own_model)
        linear = [axis for axis in campaign.probings.readings if campaign.machine.is_linear(axis)]
        rows = np.flatnonzero(campaign.probings.run == 2)[:: wanted.every]
        clean = len(robust_fit(whole).gross)
        print(f"{plan}: {len(rows)} positions; marked without a wrong reading: {clean}", flush=True)
        for size in SIZES_MM:
            tally = dict.fromkeys(("named", "asked", "found", "false", "stopped"), 0)
            begun = time.process_time()
            for place, row in enumerate(rows.tolist()):
                one_number = len(whole.components) == 1
                axis = wrong.along_normal(campaign, whole, row) if one_number else linear[place % len(linear)]
                off = size if (place // len(linear)) % 2 else -size
                problem = method.problem_of(
                    wrong.with_wrong_reading(campaign, row, axis, off), method.own_model
                )
                try:
                    robust = robust_fit(problem)
                    marked = {reading.row for reading in robust.gross}
                    tally["named"] += row in marked
                    tally["false"] += len(marked - {row})
                    if row not in marked and place % EVERY:
                        continue
                    if row not in marked or not place % EVERY:
                        tally["asked"] += 1
                        answer = explain(
                            campaign, robust.fit.problem, "own", rng=np.random.default_rng(1), first=robust.fit,
                            gross=robust.points,
                        )  # fmt: skip
                        suspect = {point.row for point in answer.suspect}
                        tally["found"] += row in suspect
                        tally["false"] += len(suspect - {row} - marked)
                except MonitorError as error:
                    tally["stopped"] += 1
                    print(f"  {size} mm at {row} ({axis}): {error}")
            seconds = time.process_time() - begun
            print(f"  {size:g} mm: " + ", ".join(f"{name} {count}" for name, count in tally.items()), end="")
            print(f" ({seconds:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
