"""What `trend` says of machines that several instruments measured; results in ``docs/trials-statistics.md``.

    OMP_NUM_THREADS=1 python tests/benchmarks/trial_several_instruments.py --histories 60

The histories are drawn here, with no code of the package: campaigns by a laser, a ball bar and an R-test, each off by
the error of its calibration (one number a certificate), of days and runs that scatter; the answer is that of `trend`.
Two gains rest on the calibrations, two squarenesses do not. Counted are histories in which something is told of the
parameter ``EXX`` or ``EC0X``: what is not there where ``true`` is nothing, what is there where it is not.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from monitor.cli.dependence_output import STATED_Q
from monitor.sources import CommonQuantity
from monitor.store import Database, MachineEvent, MachineHistory
from monitor.store.past.instruments import Calibrations
from monitor.workflow.history.past import machine_past, splitting_events
from monitor.workflow.trend.answer import TrendAnswer
from monitor.workflow.trend.request import TrendRequest
from monitor.workflow.trend.trends import _answer
from tests.benchmarks.trial_calibrations import exact

START = datetime(2025, 1, 6, tzinfo=UTC)
NAMES, UNITS = ("EXX", "EYY", "EC0X", "EA0Z"), ("µm/m", "µm/m", "µrad", "µrad")
ASKED = ("EXX", "EC0X")
#: Standard deviations of the mean of a day and of a run.
DAY, RUN = 0.3, 0.3
#: Of each instrument its name and how well its scale or length is known, um/m; of an R-test nobody states it.
INSTRUMENTS = {
    "L": (("laser", "scale", 0.5),),
    "B": (("ball bar", "length", 2.0),),
    "R": (("R-test", "", 2.0),),
    "A": (("laser", "scale", 0.5), ("ball bar", "length", 2.0)),
}


@dataclass(frozen=True)
class Law:
    """What happens to the machine: a ``step`` at the event, or at ``step_at`` of the campaigns where there is none, in
    um/m and urad; ``drift`` a year; ``slope`` a kelvin; ``wave`` over the day; ``campaign`` what each is off by, by how
    it was set up."""

    step: float = 0.0
    drift: float = 0.0
    slope: float = 0.0
    wave: float = 0.0
    campaign: float = 0.0


@dataclass(frozen=True)
class Plan:
    """Campaigns by letters of ``INSTRUMENTS``, ``spacing`` days apart, of so many ``days`` and ``runs``.

    ``event`` is the campaign before which one is recorded. ``own_hours``: each instrument has its hour and its
    temperature, else these are drawn for each campaign. Lower case letters have the other certificate.
    """

    campaigns: str
    spacing: float
    days: int = 2
    runs: int = 1
    event: int | None = None
    own_hours: bool = False
    moved_at: int | None = None


PLANS = {
    "few groups": Plan("LARBARLaBRaaR", 58.0, event=5, moved_at=5),
    "few groups, own hours": Plan("LARBARLaBRaaR", 58.0, event=5, own_hours=True, moved_at=5),
    "laser, then bar": Plan("LLLLLLLLBBBBBBBB", 30.0, runs=2, moved_at=12),
    "one by laser, then bar": Plan("LBBBBBBBBBBB", 30.0, runs=2, moved_at=6),
    "in turns": Plan("LB" * 16, 11.0, days=1, runs=2, moved_at=16),
    "in turns, event": Plan("LB" * 12, 15.0, days=1, runs=2, event=12, moved_at=12),
    "in turns, own hours": Plan("LB" * 16, 11.0, days=1, runs=2, own_hours=True, moved_at=16),
    "one instrument": Plan("L" * 24, 15.0, days=1, runs=2, event=12, moved_at=12),
}
LAWS = {
    "nothing": Law(),
    "campaigns differ by 0.6": Law(campaign=0.6),
    "step of 5": Law(step=5.0),
    "drift of 6 a year": Law(drift=6.0),
    "1 a kelvin": Law(slope=1.0),
    "wave of 2": Law(wave=2.0),
}


def history(plan: Plan, law: Law, rng: np.random.Generator) -> tuple[MachineHistory, list[MachineEvent]]:
    """Return a drawn history of all parameters alike, and its event."""
    errors = {letter: float(rng.normal()) for letter in "LBRlb"}
    rows: list[tuple[float, ...]] = []
    values, campaign, measured, at, parts = [], [], [], [], []
    keys = [("laser", "L-1"), ("laser", "L-2"), ("ball bar", "B-1"), ("ball bar", "B-2")]
    certificates: dict[str, dict[str, str]] = {}
    for number, letter in enumerate(plan.campaigns):
        name = f"c{number:02d}"
        hour = (
            {"L": 8.0, "B": 14.0, "R": 20.0, "A": 11.0}[letter.upper()]
            if plan.own_hours
            else rng.uniform(0.0, 24.0)
        )
        warm = (
            {"L": -1.5, "B": 1.5, "R": 3.0, "A": 0.0}[letter.upper()]
            if plan.own_hours
            else rng.normal(0.0, 1.5)
        )
        instruments = INSTRUMENTS[letter.upper()]
        is_other = letter.islower()
        certificates[name] = {
            of: "" if of == "R-test" else f"{of[0].upper()}-{2 if is_other else 1}"
            for of, _, _ in instruments
        }
        of_campaign = rng.normal(0.0, law.campaign, len(NAMES))
        for day in range(plan.days):
            of_day = rng.normal(0.0, DAY, len(NAMES))
            degrees = 20.0 + warm + rng.normal(0.0, 0.2)
            for run in range(plan.runs):
                when = START + timedelta(days=plan.spacing * number + day, hours=hour + run)
                years = plan.spacing * number / 365.25
                stepped = law.step * (plan.moved_at is not None and number >= plan.moved_at)
                wave = law.wave * np.cos(2.0 * np.pi * (hour + run) / 24.0)
                truth = stepped + law.drift * years + law.slope * (degrees - 20.0) + wave
                part = np.zeros((4, len(NAMES)))
                off = np.zeros(len(NAMES))
                # Of two calibrated instruments the surer one makes most of a gain.
                of, _, u = instruments[0]
                key = {"laser": "L", "ball bar": "B", "R-test": "R"}[of]
                error = errors[key.lower() if is_other and key != "R" else key]
                off[:2] = u * error
                if of != "R-test":
                    part[keys.index((of, certificates[name][of])), :2] = u
                values.append(truth + off + of_campaign + of_day + rng.normal(0.0, RUN, len(NAMES)))
                u_run = np.hypot(np.linalg.norm(part, axis=0), 0.4)
                # What an R-test says of a gain it knows next to nothing of.
                u_run[:2] = 45.0 if of == "R-test" else u_run[:2]
                rows.append((day + 1.0, degrees, *u_run))
                campaign.append(name)
                measured.append(f"instruments ({', '.join(sorted(each for each, _, _ in instruments))})")
                at.append(when)
                parts.append(part)
    table, stacked = np.array(rows), np.array(parts)
    sizes = {"laser": ("scale", 0.5e-6), "ball bar": ("length", 2e-6)}
    machine = MachineHistory(
        machine="M", campaigns=dict(enumerate(dict.fromkeys(campaign))), campaign=np.array(campaign),
        method=np.full(len(at), "instruments"), measured_by=np.array(measured), run=np.arange(len(at)),
        started_at=tuple(at), day=table[:, 0].astype(np.int64), warm_up=np.zeros(len(at), dtype=np.bool_),
        parameters=NAMES, units=UNITS, values=np.array(values), u=table[:, 2:],
        conditions={"ambient_degC": table[:, 1]}, tolerances={}, unidentified=(),
        common_parts={
            CommonQuantity(of, certificate, *sizes[of]): stacked[:, index]
            for index, (of, certificate) in enumerate(keys)
            if stacked[:, index].any()
        },
        calibrations=Calibrations(certificates),
    )  # fmt: skip
    if plan.event is None:
        return machine, []
    between = START + timedelta(days=plan.spacing * (plan.event - 0.5))
    return machine, [MachineEvent(between, "repair", "spindle")]


def answers(
    db: Database, machine: MachineHistory, events: list[MachineEvent]
) -> Iterator[tuple[str, TrendAnswer]]:
    """The answer of `trend` about each of the asked parameters."""
    past = machine_past(machine, splitting_events(events))
    for name in ASKED:
        yield name, _answer(db, TrendRequest("M", parameter=name), machine, events, past, {})


def told(answer: TrendAnswer, name: str) -> Iterator[str]:
    """What is told of a parameter, in the words of the columns of the table."""
    of = answer.parameters[name]
    if any(_is_stated(effect) and effect.channel == "ambient_degC" for effect in of.conditions):
        yield "temperature"
    if any(_is_stated(wave) and wave.cycle == "day" for wave in of.cycles):
        yield "wave of the day"
    for effect in (*of.conditions, *of.cycles):
        if getattr(effect, "not_decided", None) is not None:
            yield "cause not decided"
    for change in of.changes:
        others = change.between_instruments
        yield (
            f"{change.kind}, the machine's"
            if others is None or not others.may_be_all
            else "step, maybe theirs"
        )
    for change in of.drifts:
        yield change.kind
    if of.drift.verdict is not None:
        yield "line drifts"
    for step in of.event_steps:
        yield "event step" if step.decided else "event step not decided"
    for pair in answer.agreement:
        if pair.event is not None and name in pair.disagree:
            yield "pair differs"
        if pair.event is not None and pair.parameters[name].agree is None:
            yield "pair not decided"
    if of.control.why is None:
        yield "chart alarm" if of.control.alarms else "chart in control"


def _is_stated(effect: object) -> bool:
    q = getattr(effect, "q_value", None)
    return q is not None and q < STATED_Q and getattr(effect, "not_decided", None) is None


def rates(
    db: Database, plan: Plan, law: Law, histories: int, seed: tuple[int, ...]
) -> Mapping[str, Counter[str]]:
    """Return of each asked parameter in how many histories something is told."""
    counts: dict[str, Counter[str]] = {name: Counter() for name in ASKED}
    for number in range(histories):
        machine, events = history(plan, law, np.random.default_rng([*seed, number]))
        for name, answer in answers(db, machine, events):
            counts[name].update(set(told(answer, name)))
    return counts


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--histories", type=int, default=60)
    parser.add_argument("--seed", type=int, default=20261127)
    parser.add_argument("--plans", nargs="*", default=list(PLANS))
    parser.add_argument("--laws", nargs="*", default=list(LAWS))
    options = parser.parse_args()
    with TemporaryDirectory() as folder, Database(Path(folder) / "m.duckdb", threads=1) as db:
        for plan_number, (plan_name, plan) in enumerate(PLANS.items()):
            for law_number, (law_name, law) in enumerate(LAWS.items()):
                if plan_name not in options.plans or law_name not in options.laws:
                    continue
                seed = (options.seed, plan_number, law_number)
                for name, count in rates(db, plan, law, options.histories, seed).items():
                    print(f"{plan_name} | {law_name} | {name}")
                    for what, times in sorted(count.items()):
                        print(f"    {what}: {exact(times, options.histories)}", flush=True)


if __name__ == "__main__":
    main()
