"""A virtual SAMBA campaign: the plan of Los 2017, chapter 5, touched by a machine with errors that we choose.

For rehearsal and for the expected uncertainty of plans. Tests of the identification use another simulator,
which shares no code with this package.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from monitor.effects import Context, context_of, parse_effect
from monitor.exceptions import EffectError
from monitor.machine import evaluate, parse_term, touching_positions
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
BAR_AT = (0, 0, 0)
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


def _plan() -> list[tuple[str, tuple[int, int, int]]]:
    touches = []
    for indexation in INDEXATIONS:
        touches += [(ball, indexation) for ball in BALLS]
        if indexation == BAR_AT:
            touches += [("S1", indexation), ("S2", indexation)]
    return touches


def _blank(name: str, noise: float, rng: np.random.Generator) -> Campaign:
    """The campaign without linear readings."""
    half = BAR_LENGTH / 2
    balls = {**BALLS, "S1": (-150.0, half, 60.0), "S2": (-150.0, -half, 60.0)}
    plan = _plan()
    first = datetime(2026, 3, 2, 8, 30, tzinfo=UTC)
    runs = tuple(
        Run(
            run=day * RUNS_A_DAY + index + 1,
            started_at=first + timedelta(days=day) + index * BETWEEN_RUNS,
            day=day + 1,
            warm_up=False,
            conditions={"ambient_degC": round(21.5 + 0.3 * index + float(rng.normal(0.0, 0.2)), 2)},
        )
        for day in range(DAYS)
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
        machine=Machine(id="virtual", topology=TOPOLOGY),
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
            readings={"X": np.zeros(len(time)), "Y": np.zeros(len(time)), "Z": np.zeros(len(time)),
                      "B": angles[:, 0], "C": angles[:, 1], "C1": angles[:, 2]},
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
    campaign = _blank(name, noise if noise > 0 else 1e-3, rng)
    chain = chain_of(campaign.machine)
    places = {
        ball.id: np.array(ball.nominal) + rng.normal(0.0, SPREAD_MM, 3) for ball in campaign.artefact.balls
    }
    _fit_bar(places, BAR_LENGTH + rng.normal(0.0, BAR_UNCERTAINTY))
    tip = np.array([rng.normal(0.0, 0.1), rng.normal(0.0, 0.1), 0.0])
    true_target = np.array([places[str(target)] for target in campaign.probings.target])
    readings = dict(campaign.probings.readings)
    # Two passes: what an effect does depends on where the linear axes stand, which follows from what it does.
    for _ in range(2):
        campaign = replace(campaign, probings=replace(campaign.probings, readings=readings))
        context = context_of(campaign, chain)
        errors, target = _errors(context), true_target.copy()
        if effect is not None and any(np.any(readings[axis]) for axis in "XYZ"):
            _hide(effect, peak, context, errors, target, tip)
        positions = touching_positions(chain, context.positions, errors, target, tip)
        for index, joint in enumerate(chain.joints):
            if not joint.turns:
                readings[joint.name] = joint.sign * positions[:, index]
    # The controller prints six decimals of a linear reading; angles are set values.
    noisy = {
        axis: np.round(values + rng.normal(0.0, noise, len(values)), 6) if axis in "XYZ" else values
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
