"""Whom `explain` says to be in a wrong unit, sign or column, where all setups of an instrument are, one, and nobody.

``python tests/benchmarks/trial_mistaken_instruments.py --seeds 10``: every seed is a machine of its own, measured by
six instruments in one run (``tests/simulator/instrument_errors.py``, no code shared with the package), read otherwise.
``--right``: campaigns without a mistake: right ones, real errors of the machine (8 to 30 µm of squareness, a pitch, a
reversal, growth while the R-test or the bar measured) and of an instrument, in turn. ``--only``: a part of a name;
``--answers``: what the whole of `explain` answers, not the door alone.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.discovery import find_setup_mistakes
from monitor.exceptions import MonitorError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.store import Database
from monitor.workflow.explain.explain import explanation_of, first_fit
from monitor.workflow.models import resolve
from tests.benchmarks.trial_instruments import truth_of
from tests.simulator.instrument_errors import ERRORS, week

Fault = Callable[[Campaign], Campaign]
NEST = ("dx_um", "dy_um", "dz_um")
#: Decimals of a reading that was exported in a unit so much larger.
DECIMALS = {1e-3: 5, 1.0 / 25400.0: 6}


def readings(who: str, factor: float, names: Sequence[str] = ("reading_um",)) -> Fault:
    """Columns of all setups whose ids begin with a word, times a factor."""

    def spoil(campaign: Campaign) -> Campaign:
        probings = campaign.probings
        rows = np.char.startswith(probings.target.astype(str), who)
        channels = {name: np.array(values) for name, values in probings.channels.items()}
        for name in names:
            read = channels[name][rows] * factor
            channels[name][rows] = np.round(read, DECIMALS[factor]) if factor in DECIMALS else read
        return replace(campaign, probings=replace(probings, channels=channels))

    return spoil


def axes(who: str, first: str, second: str) -> Fault:
    """The positions of two axes exchanged in one setup."""

    def spoil(campaign: Campaign) -> Campaign:
        probings = campaign.probings
        rows = probings.target == who
        columns = {name: np.array(values) for name, values in probings.readings.items()}
        columns[first][rows], columns[second][rows] = columns[second][rows], columns[first][rows].copy()
        return replace(campaign, probings=replace(probings, readings=columns))

    return spoil


#: What is done, and how it is named.
FAULTS: dict[str, tuple[Fault, str]] = {
    "bar in mm": (readings("bar", 1e-3), "reading_um was in mm in all setups of ball bar"),
    "bar in inches": (readings("bar", 1.0 / 25400.0), "reading_um was in inches in all setups of ball bar"),
    "bar, other sign": (readings("bar", -1.0), "the sign of reading_um were the other way round in all setups of"),
    "laser, other sign": (readings("laser", -1.0), "its travel with the other sign"),
    "laser in mm": (readings("laser", 1e-3), "its travel in mm"),
    "R-test in inches": (readings("r-test", 1.0 / 25400.0, NEST), "were in inches in setup r-test"),
    "R-test in mm": (readings("r-test", 1e-3, NEST), "were in mm in setup r-test"),
    "R-test, other signs": (readings("r-test", -1.0, NEST), "other way round in setup r-test"),
    "level in mrad": (readings("level", 1e-3, ("reading_urad",)), "reading_urad was in mrad in setup level"),
    "dial, other sign": (readings("square", -1.0), "other way round in setup square"),
    "dial in mm": (readings("square", 1e-3), "reading_um was in mm in setup square"),
    "bar-xy, X and Y": (axes("bar-xy", "X", "Y"), "were exchanged in setup bar-xy"),
    "bar-yz, Y and Z": (axes("bar-yz", "Y", "Z"), "were exchanged in setup bar-yz"),
    "R-test, X and Y": (axes("r-test", "X", "Y"), "were exchanged in setup r-test"),
    "laser-Y, Y and Z": (axes("laser-Y", "Y", "Z"), "were exchanged in setup laser-Y"),
    "laser-X, X and Y": (axes("laser-X", "X", "Y"), "were exchanged in setup laser-X"),
}  # fmt: skip

#: Errors that are real, with their sizes: of the machine by what it does to its errors, of instruments by their names.
SQUARE = (8e-6, 30e-6)


def of_machine(what: str, rng: np.random.Generator) -> dict[str, float]:
    """The errors of a machine, a squareness besides among them."""
    truth = truth_of(rng)
    if what == "squareness":
        # 8 to 30 µm on a metre of Z or Y.
        for name in ("EC0Y", "EA0Z", "EB0Z"):
            truth[name] += rng.choice([-1.0, 1.0]) * rng.uniform(*SQUARE)
    return truth


def moved(what: str, rng: np.random.Generator) -> Fault:
    """Errors of a machine that its readings of small errors show to first order: a reversal of X, growth of a part."""
    size = rng.choice([-1.0, 1.0]) * rng.uniform(8.0, 30.0)

    def spoil(campaign: Campaign) -> Campaign:
        probings = campaign.probings
        channels = {name: np.array(values) for name, values in probings.channels.items()}
        x = probings.readings["X"]
        if what == "reversal":
            sense = np.sign(np.diff(x, prepend=x[0]))
            for row in np.flatnonzero(sense == 0.0):
                sense[row] = sense[row - 1] if row else 1.0
            _shift(campaign, channels, 0.5 * size * sense)
        else:
            # The machine grows in X while the second half of the rows is measured, by so much at its end.
            growth = np.clip(2.0 * np.arange(len(x)) / len(x) - 1.0, 0.0, 1.0)
            _shift(campaign, channels, size * growth)
        return replace(campaign, probings=replace(probings, channels=channels))

    return spoil


def _shift(campaign: Campaign, channels: dict[str, np.ndarray], shift: np.ndarray) -> None:
    """Move the tool point along X by so many µm in every row, as each instrument sees it."""
    target = campaign.probings.target
    angle = -campaign.probings.readings["C"]
    for name in ("laser-X", "square", "probe"):
        channels["reading_um"][target == name] += shift[target == name]
    nest = target == "r-test"
    channels["dx_um"][nest] += (np.cos(angle) * shift)[nest]
    channels["dy_um"][nest] += (np.sin(angle) * shift)[nest]
    x = campaign.probings.readings["X"]
    for name in ("bar-xy", "bar-zx"):
        bar = target == name
        channels["reading_um"][bar] += ((x - x[bar].mean()) / 100.0 * shift)[bar]


REAL = ("right", "squareness", "pitch", "reversal", "growth", *ERRORS)
SIZES = dict(zip(ERRORS, (12.0, 25.0, 3.0, 1.5, 2.5, 2.5, 50.0, 100.0, 2.5), strict=True))


def measured(folder: Path, seed: int, what: str = "right") -> Campaign:
    """A week of one machine, right or with a real error."""
    rng = np.random.default_rng(seed)
    truth = of_machine(what, rng)
    times = rng.uniform(1.0, 4.0)
    error = (what, times * SIZES[what]) if what in ERRORS else ("", 0.0)
    pitch = rng.choice([-1.0, 1.0]) * rng.uniform(10e-9, 80e-9) if what == "pitch" else 0.0
    campaign = read_campaign(week(folder / "week", rng, truth, *error, pitch=pitch))
    assert isinstance(campaign, Campaign)
    return moved(what, rng)(campaign) if what in ("reversal", "growth") else campaign


def told(campaign: Campaign, *, answers: bool) -> tuple[list[str], int]:
    """The mistakes that are named, and the number of effects and bad points."""
    with Database(":memory:") as db:
        model = resolve(db, None, campaign.method)
    try:
        if answers:
            explanation = explanation_of(campaign, model, first_fit(campaign, model))
            found = explanation.mistakes, len(explanation.missing) + len(explanation.suspect)
        else:
            found = find_setup_mistakes(campaign, _problem_of, first_fit(campaign, model).fit), 0
    except MonitorError as refusal:
        return [str(refusal)], 0
    return [mistake.what for mistake in found[0]], found[1]


def _problem_of(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--right", type=int, default=0, help="so many campaigns of each that is no mistake")
    parser.add_argument("--only", default="")
    parser.add_argument("--answers", action="store_true")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    for name, (fault, word) in FAULTS.items():
        if options.only not in name:
            continue
        counts: Counter[str] = Counter()
        for seed in seeds:
            with tempfile.TemporaryDirectory() as folder:
                mistakes, others = told(fault(measured(Path(folder), seed)), answers=options.answers)
            named = any(word in mistake for mistake in mistakes)
            counts["named"] += named
            counts["alone"] += named and len(mistakes) == 1
            counts["with effects or bad points"] += others > 0
            if not named:
                print(f"  seed {seed}, {name}: {mistakes}, {others} effects or bad points", flush=True)
        print(f"{name}: {dict(counts)} of {len(seeds)}", flush=True)
    accused, of = 0, 0
    for what in REAL if options.right else ():
        for seed in range(options.first, options.first + options.right):
            with tempfile.TemporaryDirectory() as folder:
                mistakes, _ = told(measured(Path(folder), seed, what), answers=False)
            accused, of = accused + bool(mistakes), of + 1
            if mistakes:
                print(f"  falsely, seed {seed}, {what}: {mistakes}", flush=True)
        print(f"{what}: accused {accused} of {of} so far", flush=True)
    if of:
        low, high = scipy.stats.binomtest(accused, of).proportion_ci(method="exact")
        print(f"accused falsely {accused} of {of} ({100 * low:.1f} to {100 * high:.1f} %)")


if __name__ == "__main__":
    main()
