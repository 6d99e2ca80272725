"""How often `explain` names an error of an instrument, and how often one where there is none.

``python tests/benchmarks/trial_instrument_errors.py --seeds 20 --empty 100``: every seed is a machine of its own,
measured in one run by six instruments (``tests/simulator/instrument_errors.py``, no code shared with the package). An
error counts as named where it is the first finding, or among those that the readings do not rule out in its stead.
``--times``: errors of other sizes; ``--stated U``: the laser states the uncertainty of its scale, U um/m; ``--air``: it
reads so many um/m too much besides, as where the temperature of the air is wrong (0.95 um/m for 1 K).
``--without`` searches without the errors of instruments: the rate of false effects that there was before.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import explain
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.benchmarks.trial_instruments import truth_of
from tests.simulator.instrument_errors import ERRORS, week

#: The size of each, in its own unit: some five standard uncertainties of a reading over what it acts on.
SIZES = {
    "instrument:laser-X:cosine": 12.0,
    "instrument:laser interferometer:scale": 25.0,
    "instrument:laser interferometer:scale@air_degC": 3.0,
    "instrument:laser-Y:dead_path@air_degC": 1.5,
    "instrument:bar-xy:length": 2.5,
    "instrument:ball bar:length": 2.5,
    "instrument:r-test:drift@run_time": 50.0,
    "instrument:level:tilt@run_time": 100.0,
    "instrument:probe:lobing3": 2.5,
}


#: The error that wrong air is.
SCALE = "instrument:laser interferometer:scale"


def stating(campaign: Campaign, u: float) -> Campaign:
    """The campaign whose laser states the uncertainty of its scale, um/m."""
    setups = tuple(
        replace(setup, scale_uncertainty=1e-6 * u) if setup.reading == "displacement" else setup
        for setup in campaign.artefact.setups
    )
    return replace(campaign, artefact=replace(campaign.artefact, setups=setups))


def named(
    seed: int, error: str = "", times: float = 1.0, stated: float = 0.0, air: float = 0.0
) -> tuple[list[str], tuple[str, ...]]:
    """The findings, the most convincing first, and the rivals of the first."""
    rng = np.random.default_rng(seed)
    size, beside = times * SIZES.get(error, 0.0), {SCALE: air} if air else None
    with tempfile.TemporaryDirectory() as folder:
        campaign = read_campaign(week(Path(folder) / "week", rng, truth_of(rng), error, size, beside=beside))
    assert isinstance(campaign, Campaign)
    if stated:
        campaign = stating(campaign, stated)
    problem = campaign_method(campaign).problem_of(campaign)
    answer = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    rivals = tuple(rival.effect for rival in answer.missing[0].rivals) if answer.missing else ()
    return [effect.effect for effect in answer.missing], rivals


def _rate(count: int, of: int) -> str:
    low, high = scipy.stats.binomtest(count, of).proportion_ci(method="exact")
    return f"{count} of {of}, {100 * count / of:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--empty", type=int, default=0)
    parser.add_argument("--empty-first", type=int, default=10_000, help="the first seed without an error")
    parser.add_argument("--only", default="")
    parser.add_argument("--times", type=float, default=1.0, help="the sizes of the errors, in those of SIZES")
    parser.add_argument(
        "--stated", type=float, default=0.0, help="standard uncertainty of the laser's scale, um/m"
    )
    parser.add_argument("--air", type=float, default=0.0, help="what the laser reads too much besides, um/m")
    parser.add_argument("--without", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    begin = time.process_time()
    seeds = range(options.first, options.first + options.seeds)
    for error in (error for error in ERRORS if options.only in error and options.seeds):
        first = beside = other = silent = 0
        for seed in seeds:
            findings, rivals = named(seed, error, options.times, options.stated, options.air)
            first += findings[:1] == [error]
            beside += findings[:1] != [error] and error in rivals
            other += len(findings) > 1
            silent += not findings
            if options.verbose or not (findings[:1] == [error] or error in rivals):
                print(f"  seed {seed}: {findings} rivals {rivals[:6]}", flush=True)
        wrong = len(seeds) - first - beside - silent
        print(
            f"{error}, {options.times * SIZES[error]:g}: named {_rate(first + beside, len(seeds))}, of these first "
            f"{first}; nothing said in {silent}, something else alone in {wrong}, further findings in {other}; "
            f"{time.process_time() - begin:.0f} s",
            flush=True,
        )
    false = 0
    with (
        mock.patch("monitor.methods.instruments.problem.of_instruments", return_value=())
        if options.without
        else mock.MagicMock()
    ):
        for seed in range(options.empty_first, options.empty_first + options.empty):
            findings, _ = named(seed, stated=options.stated, air=options.air)
            false += bool(findings)
            if findings or options.verbose:
                print(f"  empty seed {seed}: {findings}", flush=True)
    if options.empty:
        print(f"false effects: {_rate(false, options.empty)}; {time.process_time() - begin:.0f} s")


if __name__ == "__main__":
    main()
