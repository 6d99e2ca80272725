"""A virtual SAMBA campaign: the plan of Los 2017, chapter 5, touched by a machine with errors that we choose.

``virtual_campaign`` is of that machine, with a hidden effect; ``chosen_campaign`` of any machine with a touch probe and
rotary axes, with the errors that are named.

For rehearsal and for the expected uncertainty of plans. Tests of the identification use another simulator,
which shares no code with this package.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from monitor.effects import ChainEffect, Context, context_of, parse_effect
from monitor.exceptions import DataError, EffectError, InputError
from monitor.machine import Chain, evaluate, parse_term, parse_topology, touching_positions
from monitor.methods.model import chain_of
from monitor.records import Array, Artefact, Ball, Campaign, Machine, Probe, Probings, Run, ScaleBar
from monitor.units import DEGREE

# Los 2017, chapter 5: twelve indexations of B and C, the spindle at three more angles, rods of four lengths and
# a scale bar; five days of four runs. The balls' places across the table are ours.
INDEXATIONS = (
    (-60, -235, 0), (0, -135, 0), (0, 0, 0), (0, 90, 0), (30, 175, 0), (90, 270, 0), (50, 170, 0), (0, 135, 0),
    (15, 0, 0), (0, -50, 0), (-45, -90, 0), (-90, -270, 0), (0, 0, 90), (0, 0, 180), (0, 0, 270),
)  # fmt: skip
BALLS = {
    "1": (118.0, 6.0, 178.8),
    "2": (-4.0, 121.0, 153.4),
    "3": (-117.0, -8.0, 102.6),
    "4": (9.0, -119.0, 77.2),
}
BAR_LENGTH = 304.98923
BAR_UNCERTAINTY = 0.0012
TOPOLOGY = "w C B X b Z Y (C1) t"
# Table 4.1 of the thesis, in its units, for the location errors and gains; offsets of the spindle from table 6.1.
ERRORS = {
    "EA0B": 0.9e-6, "EC0B": -1.5e-6, "EX0C": -102.2e-3, "EA0C": 3.9e-6, "EB0C": 19.9e-6, "EB0Z": -37.5e-6,
    "EA0Y": -8.8e-6, "EC0Y": 23.9e-6, "EX0C1": -97.1e-3, "EY0C1": 15.7e-3,
}  # fmt: skip
GAINS = {"X": -45.2e-6, "Y": 5.3e-6, "Z": -20.5e-6}
SECONDS_A_PROBING = 63.0
DAYS, RUNS_A_DAY = 5, 4
BETWEEN_RUNS = timedelta(minutes=75)
# Nobody knows the balls' places to a micrometre.
SPREAD_MM = 0.2


#: Where the ball of the probe is on a machine whose tool turns, mm: without a length a turn of the head moves nothing.
HEAD_TIP = (0.0, 0.0, -150.0)
MOST_DAYS = 366


#: The errors (n, J, 2, 6) of a machine, and a function that adds others to them and to targets (n, 3), given the tip.
_Start = Callable[[Context], Array]
_Add = Callable[[Context, Array, Array, Array], None]


def _plan(indexations: Sequence[tuple[int, ...]]) -> list[tuple[str, tuple[int, ...]]]:
    touches = []
    for indexation in indexations:
        touches += [(ball, indexation) for ball in BALLS]
        if not any(indexation):
            touches += [("S1", indexation), ("S2", indexation)]
    return touches


def _blank(
    name: str,
    noise: float,
    rng: np.random.Generator,
    machine: Machine,
    axes: tuple[str, ...] = ("B", "C", "C1"),
    indexations: Sequence[tuple[int, ...]] = INDEXATIONS,
    days: int = DAYS,
) -> Campaign:
    """The campaign without linear readings, the rotary ``axes`` at the angles of the ``indexations``."""
    half = BAR_LENGTH / 2
    linear = sorted(joint.name for joint in chain_of(machine).joints if not joint.turns)
    balls = {**BALLS, "S1": (-150.0, half, 60.0), "S2": (-150.0, -half, 60.0)}
    plan = _plan(indexations)
    first = datetime(2026, 3, 2, 8, 30, tzinfo=UTC)
    runs = tuple(
        Run(
            run=day * RUNS_A_DAY + index + 1,
            started_at=first + timedelta(days=day) + index * BETWEEN_RUNS,
            day=day + 1,
            warm_up=False,
            conditions={"ambient_degC": round(21.5 + 0.3 * index + float(rng.normal(0.0, 0.2)), 2)},
        )
        for day in range(days)
        for index in range(RUNS_A_DAY)
    )
    count = len(plan)
    sequence = np.tile(np.arange(1, count + 1), len(runs))
    time = np.tile(np.arange(count) * SECONDS_A_PROBING, len(runs))
    angles = DEGREE.to_internal(1.0) * np.tile(
        np.array([indexation for _, indexation in plan], dtype=float), (len(runs), 1)
    )
    day_hours = (
        np.repeat([(run.started_at.hour - 8) + run.started_at.minute / 60.0 for run in runs], count)
        + time / 3600.0
    )
    return Campaign(
        name=name,
        method="samba",
        machine=machine,
        probe=Probe("virtual probe", "virtual", noise),
        artefact=Artefact(
            "four balls and a scale bar",
            tuple(Ball(ball, nominal, 19.05) for ball, nominal in balls.items()),
            ScaleBar(("S1", "S2"), BAR_LENGTH, BAR_UNCERTAINTY, "virtual"),
        ),
        runs=runs,
        probings=Probings(
            run=np.repeat([run.run for run in runs], count).astype(np.int64),
            sequence=sequence.astype(np.int64),
            time=time,
            target=np.array([target for target, _ in plan] * len(runs)),
            readings={axis: np.zeros(len(time)) for axis in linear} | dict(zip(axes, angles.T, strict=True)),
            channels={"x_axis_degC": np.round(21.5 + 2.0 * (1.0 - np.exp(-day_hours / 2.0)), 3)},
        ),
    )  # fmt: skip


def virtual_campaign(
    name: str, rng: np.random.Generator, *, effect: str | None = None, peak: float = 0.0, noise: float = 1e-3
) -> Campaign:
    """A campaign of 20 runs. ``peak`` (mm) is the largest displacement that the hidden effect causes at any
    probing, ``noise`` (mm) the standard deviation of a linear reading, which the probe states.

    Raises EffectError for an effect that the machine does not have or that does nothing at this plan.
    """
    campaign = _blank(name, noise if noise > 0 else 1e-3, rng, Machine(id="virtual", topology=TOPOLOGY))
    tried = _Touches(campaign, rng, (0.0, 0.0, 0.0))

    def hide(context: Context, errors: Array, target: Array, tip: Array) -> None:
        if effect is not None and any(np.any(context.positions[:, joint]) for joint in tried.linear):
            _hide(effect, peak, context, errors, target, tip)

    return tried.touched(_errors, hide, noise, rng)


def chosen_campaign(
    name: str,
    rng: np.random.Generator,
    *,
    topology: str,
    errors: Mapping[str, tuple[float, ...]],
    days: int,
    noise: float = 1e-3,
) -> Campaign:
    """A campaign of four runs a day, of a machine of a ``topology`` that has these errors and no others.

    ``errors`` by effect in display units (µm, µrad, µm/m), as many numbers as it has coefficients; ``noise`` in mm. The
    plan is that of ``virtual_campaign``: the innermost rotary axis takes the angles of C, the others those of B and
    those after it in the list. Raises TopologyError, EffectError, InputError for a name that is no error of an axis,
    and DataError for a machine whose balls cannot be touched or that has no rotary axis.
    """
    if not 1 <= days <= MOST_DAYS:
        raise InputError(f"days = {days}: a campaign has 1 to {MOST_DAYS} days")
    chain = parse_topology(topology)
    axes, indexations, tip = _turns(chain)
    machine = Machine(id="virtual", topology=chain.topology)
    campaign = _blank(name, noise, rng, machine, axes, indexations, days)
    if any(tip):
        campaign = replace(campaign, probe=replace(campaign.probe, tip=tip))
    tried = _Touches(campaign, rng, tip)

    def none(context: Context) -> Array:
        return np.zeros((len(context), len(context.chain.joints), 2, 6))

    def chosen(context: Context, geometric: Array, target: Array, tip: Array) -> None:
        for text, sizes in errors.items():
            effect = parse_effect(text, context.chain)
            if not isinstance(effect, ChainEffect):
                raise InputError(f"'{text}' is no error of an axis; name errors such as EA0B or EXX:poly1")
            basis = effect.basis(context)
            if len(sizes) != basis.size:
                raise InputError(f"'{text}' has {basis.size} coefficients, not {len(sizes)}")
            basis.apply(np.array([effect.unit.to_internal(size) for size in sizes]), geometric, target)

    return tried.touched(none, chosen, noise, rng)


def _turns(chain: Chain) -> tuple[tuple[str, ...], list[tuple[int, ...]], tuple[float, float, float]]:
    """Rotary axes, their angles in degrees at each indexation, and where the tip is (mm). Raises DataError."""
    rotary = [joint for joint in chain.joints if joint.turns and joint.kind != "spindle"]
    if not rotary:
        raise DataError(f"'{chain.topology}' has no rotary axis; balls and a scale bar need one that turns")
    angles: dict[str, list[int]] = {}
    turning = [number for number, row in enumerate(INDEXATIONS) if any(row[:2])]
    for index, joint in enumerate(rotary):
        # The innermost turns all the way round; each of the others has the tilts, begun a row later than the last.
        column = [INDEXATIONS[number][1 if index == 0 else 0] for number in turning]
        rolled = dict(zip(turning, np.roll(column, max(index - 1, 0)).tolist(), strict=True))
        angles[joint.name] = [int(rolled.get(number, 0)) for number in range(len(INDEXATIONS))]
    for joint in chain.joints:
        if joint.kind == "spindle":
            angles[joint.name] = [row[2] for row in INDEXATIONS]
    # Without a spindle the indexations that turn it alone are one.
    indexations = list(dict.fromkeys(zip(*angles.values(), strict=True)))
    on_tool = any(joint.branch == "tool" for joint in rotary)
    return tuple(angles), indexations, HEAD_TIP if on_tool else (0.0, 0.0, 0.0)


class _Touches:
    """True places of the balls and of the tip (mm), drawn once, and the readings at which they touch."""

    def __init__(self, campaign: Campaign, rng: np.random.Generator, tip: Sequence[float]) -> None:
        self.campaign, self.chain = campaign, chain_of(campaign.machine)
        self.linear = [index for index, joint in enumerate(self.chain.joints) if not joint.turns]
        places = {
            ball.id: np.array(ball.nominal) + rng.normal(0.0, SPREAD_MM, 3)
            for ball in campaign.artefact.balls
        }
        _fit_bar(places, BAR_LENGTH + rng.normal(0.0, BAR_UNCERTAINTY))
        self.tip = np.array(tip, dtype=float)
        self.tip[:2] += rng.normal(0.0, 0.1), rng.normal(0.0, 0.1)
        self.target = np.array([places[str(target)] for target in campaign.probings.target])

    def touched(self, start: _Start, add: _Add, noise: float, rng: np.random.Generator) -> Campaign:
        """The campaign with its linear readings, under a ``noise`` in mm."""
        campaign, readings = self.campaign, dict(self.campaign.probings.readings)
        # Two passes: what an effect does depends on where the linear axes stand, which follows from what it does.
        for _ in range(2):
            campaign = replace(campaign, probings=replace(campaign.probings, readings=readings))
            context = context_of(campaign, self.chain)
            errors, target = start(context), self.target.copy()
            add(context, errors, target, self.tip)
            positions = touching_positions(self.chain, context.positions, errors, target, self.tip)
            for index in self.linear:
                joint = self.chain.joints[index]
                readings[joint.name] = joint.sign * positions[:, index]
        # The controller prints six decimals of a linear reading; angles are set values.
        moved = {self.chain.joints[index].name for index in self.linear}
        noisy = {
            axis: np.round(values + rng.normal(0.0, noise, len(values)), 6) if axis in moved else values
            for axis, values in readings.items()
        }
        return replace(campaign, probings=replace(campaign.probings, readings=noisy))


def _errors(context: Context) -> Array:
    """Errors (n, J, 2, 6) of the machine without the hidden effect."""
    chain = context.chain
    errors = np.zeros((len(context), len(chain.joints), 2, 6))
    for symbol, value in ERRORS.items():
        term = parse_term(symbol, chain)
        errors[:, term.joint, term.stage, term.component] += value
    for axis, gain in GAINS.items():
        term = parse_term(f"E{axis}{axis}", chain)
        errors[:, term.joint, term.stage, term.component] += gain * context.positions[:, term.joint]
    return errors


def _hide(effect: str, peak: float, context: Context, errors: Array, target: Array, tip: Array) -> None:
    """Add an effect with the largest displacement ``peak`` to the errors and the targets. Raises EffectError."""
    basis = parse_effect(effect, context.chain).basis(context)
    pose = evaluate(context.chain, context.positions, errors, target, tip, jacobian=True)
    assert pose.by_error is not None
    moved = basis.displacement(pose.by_error) @ np.ones(basis.size)
    largest = float(np.linalg.norm(moved, axis=1).max())
    if largest == 0.0:
        raise EffectError(f"{effect} does nothing at the probings of the virtual plan; choose another effect")
    basis.apply(np.full(basis.size, peak / largest), errors, target)


def _fit_bar(places: dict[str, Array], length: float) -> None:
    middle = (places["S1"] + places["S2"]) / 2.0
    along = places["S1"] - places["S2"]
    along = along / np.linalg.norm(along) * length / 2.0
    places["S1"], places["S2"] = middle + along, middle - along
