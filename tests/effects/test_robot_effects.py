"""Effects of robots and trackers, against the naive simulator; the contract that every entry of the catalogue keeps."""

from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import re
from types import ModuleType

import numpy as np
import pytest

from monitor.effects import Context, parse_effect, positions_of
from monitor.effects.artefact import parse_artefact
from monitor.effects.catalogue import catalogue, of_balls, of_tracker
from monitor.effects.words import describe
from monitor.exceptions import EffectError
from monitor.machine import Chain, chain_of_axes, parse_topology
from monitor.methods.chain.base_effects import base_effects
from monitor.records import ChainAxis

DRIVERS = ("warmup", "run_time", "ambient_degC")


@pytest.fixture(scope="module")
def robots(simulator: ModuleType) -> ModuleType:
    """The simulator of tracked robots."""
    return importlib.import_module(f"{simulator.__name__}.robot_campaign")


@pytest.fixture(scope="module")
def elbow(robots: ModuleType) -> Chain:
    """The simulator's robot as the product knows it."""
    return chain_of_axes(
        [
            ChainAxis(name, "rotary", "tool", axis, offset, sign)
            for name, axis, offset, sign, _ in robots.ELBOW
        ]
    )


def context(chain: Chain, readings: dict[str, np.ndarray], **columns: np.ndarray) -> Context:
    """Rows of one run, five seconds apart."""
    count = len(next(iter(readings.values())))
    return Context(
        chain=chain,
        positions=positions_of(chain, readings),
        run=np.ones(count, dtype=np.int64),
        sequence=np.arange(1, count + 1),
        time=5.0 * np.arange(count),
        day_time=5.0 * np.arange(count),
        run_time=np.linspace(0.0, 1.0, count),
        target=np.array(["R1"] * count),
        nominal=np.zeros((count, 3)),
        columns=columns,
    )


@pytest.fixture
def readings(robots: ModuleType) -> dict[str, np.ndarray]:
    """Thirty poses, rad."""
    rng = np.random.default_rng(1)
    return {
        name: np.deg2rad(rng.uniform(*limits, 30))  # the ranges of the robot
        for name, *_, limits in robots.ELBOW
    }


def test_compliance_follows_the_torque_of_a_load_at_the_flange(robots, elbow, readings):
    arms = robots.lever_arms(readings)
    now = context(elbow, readings)
    for joint in elbow.joints:
        effect = parse_effect(f"E{'ABC'[joint.main]}{joint.name}:compliance@gravity", elbow)
        assert effect.unit.name == "µrad/m"
        # A coefficient of 1 µrad/m gives that angle in rad for a metre of lever.
        angle = effect.basis(now).columns[:, 0] * effect.unit.to_internal(1.0)
        np.testing.assert_allclose(angle, 1e-6 * arms[joint.name], atol=1e-18)


def test_a_load_of_each_run_is_the_load_of_its_rows(elbow, readings):
    """Columns of zeros where another run was measured; the sum is the load that all runs share."""
    now = dataclasses.replace(context(elbow, readings), run=np.repeat([1, 2], 15))
    effect = parse_effect("EBJ2:compliance@load_each_run", elbow)
    assert effect.parameters(now) == tuple(f"EBJ2:compliance@load_each_run.run{run}" for run in (1, 2))
    columns = effect.basis(now).columns
    assert not columns[15:, 0].any()
    assert not columns[:15, 1].any()
    shared = parse_effect("EBJ2:compliance@gravity", elbow).basis(now).columns
    np.testing.assert_allclose(columns.sum(axis=1, keepdims=True), shared)
    assert effect.unit.name == "µrad/m"


def test_link_weights_hold_any_mass_anywhere(robots, elbow, readings):
    frames = importlib.import_module("simulator.robot").frames(robots.JOINTS, readings)
    rng = np.random.default_rng(2)
    axis = frames[1][:, :3, :3] @ [0.0, 1.0, 0.0]
    torque = np.zeros(30)
    for frame in frames[1:]:
        place = rng.uniform(-200.0, 200.0, 3)
        arm = frame[:, :3, :3] @ place + frame[:, :3, 3] - frames[1][:, :3, 3]
        torque += rng.uniform(1.0, 20.0) * np.sum(axis * np.cross(arm, (0.0, 0.0, -1.0)), axis=1)
    effect = parse_effect("EBJ2:compliance@link_weights", elbow)
    now = context(elbow, readings)
    columns = effect.basis(now).columns
    # Two of each link: a weight off a link along its own axis is one on the link before.
    assert columns.shape == (30, 10)
    assert np.linalg.matrix_rank(columns / np.linalg.norm(columns, axis=0)) == 10
    assert effect.parameters(now)[:2] == tuple(f"EBJ2:compliance@link_weights.J2{axis}" for axis in "xz")
    left = torque - columns @ np.linalg.lstsq(columns, torque, rcond=1e-10)[0]
    assert np.abs(left).max() < 1e-9 * np.abs(torque).max()


def test_gravity_of_the_machine_file_turns_the_torque(elbow, readings):
    hanging = dataclasses.replace(elbow, down=(0.0, 0.0, 1.0))
    one, other = (
        parse_effect("EBJ3:compliance@gravity", chain).basis(context(chain, readings)).columns
        for chain in (elbow, hanging)
    )
    np.testing.assert_allclose(one, -other)


def test_a_lag_is_in_proportion_to_the_move_into_the_pose(elbow):
    turns = {joint.name: np.zeros(6) for joint in elbow.joints}
    turns["J2"] = np.array([0.3, 0.3, 0.5, 0.5, 0.1, 0.1])
    turns["J1"] = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.2])
    effect = parse_effect("EBJ2:lag", elbow)
    assert effect.unit.name == "µrad/rad"
    # Rows at one pose share its move; a pose into which only J1 moved has none of J2.
    np.testing.assert_allclose(
        effect.basis(context(elbow, turns)).columns[:, 0], [0.0, 0.0, 0.2, 0.2, -0.4, 0.0], atol=1e-15
    )


def test_the_frame_of_a_tracker_shifts_and_turns_about_the_tracker(elbow, readings):
    rng = np.random.default_rng(3)
    rotation = importlib.import_module("scipy.spatial.transform").Rotation.random(random_state=rng)
    seen = rng.uniform(-1000.0, 1000.0, (30, 3)) + np.array([3000.0, 0.0, 0.0])
    names = ("tracker_x_mm", "tracker_y_mm", "tracker_z_mm")
    now = context(elbow, readings, **dict(zip(names, seen.T, strict=True)))
    now = dataclasses.replace(now, nominal=rotation.apply(seen) + np.array([100.0, -200.0, 300.0]))
    turn = parse_effect("tracker:turn@run_time", elbow)
    assert turn.unit.name == "µrad"
    shifts = turn.basis(now).shifts
    small = 1e-6
    for axis in range(3):
        about = type(rotation).from_rotvec(small * np.eye(3)[axis])
        moved = (about * rotation).apply(seen) - rotation.apply(seen)
        np.testing.assert_allclose(shifts[:, :, axis], moved / small * now.run_time[:, None], atol=1e-2)
    shift = parse_effect("tracker:shift@sequence", elbow)
    assert shift.parameters(now) == tuple(f"tracker:shift@sequence.{axis}" for axis in "xyz")
    np.testing.assert_allclose(shift.basis(now).shifts[-1], np.eye(3))


def test_nothing_was_tracked(elbow, readings):
    with pytest.raises(
        EffectError, match="nothing was tracked in this campaign: it has no columns tracker_x_mm"
    ):
        parse_effect("tracker:shift@run_time", elbow).basis(context(elbow, readings))


def test_a_gear_has_any_order(elbow, readings):
    now = context(elbow, readings)
    for order in (4, 121, 127.5):
        columns = parse_effect(f"EBJ2:harmonic{order}", elbow).basis(now).columns
        q = readings["J2"]
        np.testing.assert_allclose(columns, np.column_stack([np.cos(order * q), np.sin(order * q)]))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "EBJ2:compliance",
            "a compliance answers to weights: write @gravity (a load at the flange), @load_each_run",
        ),
        ("EBJ2:compliance@run_time", "a compliance answers to weights"),
        (
            "EXJ2:compliance@gravity",
            "is a rotation of a rotary axis under a torque; write for example EBJ2:compliance@",
        ),
        ("EB0J2:compliance@gravity", "is a rotation of a rotary axis under a torque"),
        ("EBJ2:const@link_weights", "there is no driver '@link_weights'"),
        ("tracker:jumped", "tracker:shift@run_time, tracker:turn@run_time, tracker:moved"),
    ],
)
def test_refusals_say_what_would_be_right(elbow, text, words):
    with pytest.raises(EffectError, match=re.escape(words)):
        parse_effect(text, elbow)


def _chains(elbow: Chain) -> list[Chain]:
    rail = ChainAxis("rail", "linear", "tool", (0.6, 0.8, 0.0))
    axes = [
        ChainAxis(one.name, "rotary", "tool", one.direction, one.offset, one.sign) for one in elbow.joints
    ]
    return [elbow, chain_of_axes([rail, *axes]), parse_topology("w C B X b Z Y (C1) t")]


@pytest.mark.parametrize("place", range(3))
def test_contract_every_entry_of_the_catalogue(elbow, place):
    """Each entry reads back as itself and says what it is, what causes it, what to do and where that is described."""
    chain = _chains(elbow)[place]
    ratios = {joint.name: 121.0 for joint in chain.of_kind("rotary")}
    more = (*of_balls(DRIVERS), *of_tracker(chain, DRIVERS, ratios))
    entries = catalogue(chain, base_effects(chain), DRIVERS, more=more)
    texts = [effect.text for effect in entries]
    assert len(texts) == len(set(texts)) > 250
    for effect in entries:
        assert parse_effect(effect.text, chain) == effect
        told = describe(effect)
        for sentence in (told.meaning, told.cause, told.remedy, told.described_in):
            assert sentence.strip() == sentence != ""
        assert effect.unit.name
        assert effect.unit.factor > 0.0


def test_the_catalogue_has_every_effect_of_the_method(elbow):
    """Issue 8, point 3: compliance, harmonics, gears, lag, reversal, drift of the tracker."""
    texts = {
        one.text for one in catalogue(elbow, (), DRIVERS, more=of_tracker(elbow, DRIVERS, {"J2": 121.0}))
    }
    for joint, own in zip(("J1", "J2", "J3", "J4", "J5", "J6"), "CBBABA", strict=True):
        assert {f"E{own}{joint}:{shape}" for shape in ("lag", "reversal", "harmonic1", "harmonic2")} <= texts
        assert {f"E{own}{joint}:compliance@gravity", f"E{own}{joint}:compliance@link_weights"} <= texts
    assert {"EBJ2:harmonic121", "EBJ2:harmonic242"} <= texts
    assert {"tracker:shift@run_time", "tracker:turn@run_time"} <= texts
    assert not any(text.startswith(("stem", "artefact", "ball")) for text in texts)


def test_robot_effects_name_their_cause(elbow):
    told = {
        text: describe(parse_effect(text, elbow))
        for text in ("EBJ2:compliance@gravity", "EBJ2:harmonic121", "ECJ1:lag", "tracker:turn@run_time")
    }
    assert "drive and gearbox of J2 give way under the weight" in told["EBJ2:compliance@gravity"].cause
    assert "gear of J2 with 121 errors a turn" in told["EBJ2:harmonic121"].cause
    assert "J1 was read before it had settled" in told["ECJ1:lag"].cause
    assert "the tracker's stand or the floor gives way" in told["tracker:turn@run_time"].cause
    assert parse_artefact("tracker:turn").text == "tracker:turn"
