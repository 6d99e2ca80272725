"""What an effect is physically, what usually causes it, what to do about it, and where it is described.

Put together from parts: the direction and axis of the term, its shape and its driver.
"""

from __future__ import annotations

from dataclasses import dataclass

from monitor.effects.artefact import BallMoved, Expansion
from monitor.effects.drivers import Channel, EachRun, Gravity, RunTime, Sequence, WarmUp
from monitor.effects.effect import ArtefactEffect, ChainEffect
from monitor.effects.shapes import (
    Compliance,
    Const,
    Cyclic,
    FormulaShape,
    Harmonic,
    Lag,
    Nodes,
    Poly,
    Reversal,
    Table,
)
from monitor.effects.tracker import TrackerShift, TrackerTurn
from monitor.effects.weight import LinkWeights, Load
from monitor.machine import LOCATION

# The standards that define the terms and their tests.
MOTION_LINEAR = "ISO 230-1:2012 (error motions of linear axes)"
MOTION_ROTARY = "ISO 230-1:2012 and ISO 230-7:2015 (error motions of axes of rotation)"
LOCATION_ERRORS = "ISO 230-1:2012 and ISO 230-7:2015 (location errors)"
POSITIONING = "ISO 230-2:2014 (positioning of axes)"
THERMAL = "ISO 230-3:2020 (thermal effects)"
ROBOTS = "ISO 9283:1998 (performance of industrial robots); Mooring, Roth and Driels, Manipulator calibration, 1991"


@dataclass(frozen=True)
class Words:
    """An effect in plain sentences."""

    meaning: str
    cause: str
    remedy: str
    described_in: str


def _direction(effect: ChainEffect) -> str:
    axis = "XYZ"[effect.term.component % 3]
    name, joint = effect.joint.name, effect.joint
    along = joint.main == effect.term.component % 3
    if effect.term.is_rotation:
        if joint.turns:
            kind = "angular positioning error" if along else f"tilt about {axis}"
        elif along:
            kind = "roll"
        else:
            kind = f"tilt about {axis}"
    elif joint.turns:
        kind = "axial displacement" if along else f"radial displacement in {axis}"
    else:
        kind = "positioning error" if along else f"straightness deviation in {axis}"
    where = "spindle" if joint.kind == "spindle" else f"{name} axis"
    if effect.term.stage == LOCATION:
        what = f"turned about {axis}" if effect.term.is_rotation else f"shifted in {axis}"
        if effect.term.is_rotation and along:
            what = "off its zero angle"
        return f"{where} ({name}) {what}"
    return f"{kind} of the {where} ({name})"


def _shape(effect: ChainEffect) -> str:
    shape, name = effect.shape, effect.joint.name
    if isinstance(shape, Const):
        return ""
    if isinstance(shape, Poly):
        power = {1: "in proportion to", 2: "with the square of", 3: "with the cube of"}
        return f", growing {power.get(shape.order, f'with power {shape.order} of')} its position"
    if isinstance(shape, Harmonic):
        times: dict[float, str] = {1: "once", 2: "twice", 3: "three times"}
        return f", repeating {times.get(shape.order, f'{shape.order:g} times')} a turn"
    if isinstance(shape, Cyclic):
        return f", repeating every {shape.pitch:g} mm"
    if isinstance(shape, Reversal):
        return f", jumping when {name} reverses"
    if isinstance(shape, Lag):
        return f", in proportion to the last move of {name}"
    if isinstance(shape, Compliance):
        about = (
            "its axis" if effect.term.component - 3 == effect.joint.main else "XYZ"[effect.term.component - 3]
        )
        what = (
            "a load at the flange" if isinstance(effect.driver, Load) else "the weight of all that it carries"
        )
        return f", in proportion to the torque of {what} about {about}"
    if isinstance(shape, (Table, Nodes)):
        return ", of free form along its travel"
    if isinstance(shape, FormulaShape):
        return f", following {shape.text}"
    return f", of shape {effect.shape_text}"


def _driver(effect: ChainEffect | ArtefactEffect) -> str:
    driver = effect.driver
    if isinstance(driver, WarmUp):
        return ", settling exponentially after the day's first start"
    if isinstance(driver, RunTime):
        return ", drifting evenly within every run"
    if isinstance(driver, (Load, LinkWeights)):
        return ""
    if isinstance(driver, Sequence):
        return ", drifting evenly from reading to reading within every run"
    if isinstance(driver, Gravity):
        return ", following the direction of gravity as the axis turns"
    if isinstance(driver, EachRun):
        return ", of another size in every run"
    if isinstance(driver, Channel):
        return f", in proportion to {driver.name}"
    return "" if not effect.driver_text else f", driven by {effect.driver_text}"


def _cause_and_remedy(effect: ChainEffect) -> tuple[str, str, str]:
    shape, driver, joint, name = effect.shape, effect.driver, effect.joint, effect.joint.name
    along = joint.main == effect.term.component % 3
    linear = not joint.turns
    own = along and (effect.term.is_rotation == joint.turns)
    if isinstance(driver, EachRun):
        return (
            "something that differs between runs and was not recorded",
            "record more conditions (temperatures, coolant, load, operator) with the next campaign",
            THERMAL,
        )
    if isinstance(shape, Compliance):
        part = "drive and gearbox" if own else "bearings and arm"
        return (
            f"{part} of {name} give way under the weight that {name} carries",
            f"enter the payload and its centre of mass in the control, balance or reduce the load, check the {part} of "
            f"{name} for play, or compensate the angle by the torque",
            ROBOTS,
        )
    if isinstance(shape, Lag):
        return (
            f"{name} was read before it had settled, or its reading trails the movement: waiting time too short, "
            "following error, encoder filter, time offset between control and tracker",
            f"wait longer at each pose, average readings at rest, check the following error of {name} and the clocks "
            "of control and tracker",
            ROBOTS,
        )
    if isinstance(driver, (WarmUp, RunTime, Sequence)) or (
        isinstance(driver, Channel) and driver.name.endswith("_degC")
    ):
        if joint.kind == "spindle":
            return (
                "heat of the spindle bearings and motor makes the spindle grow or tilt",
                "warm the spindle up before measuring and machining, check bearing preload and cooling, or compensate "
                "from its temperature",
                THERMAL,
            )
        if own and linear:
            return (
                f"the ball screw or scale of {name} warms up and expands",
                f"warm {name} up, check screw preload, lubrication and cooling, or compensate from its temperature",
                THERMAL,
            )
        return (
            f"the structure that carries {name} warms up unevenly and bends",
            "warm the machine up, shield it from draughts and sun, check the coolant temperature, or compensate",
            THERMAL,
        )
    if isinstance(driver, Gravity):
        return (
            f"the weight on {name} bends it as it turns",
            f"reduce or balance the load on {name}, check its bearings' preload, or compensate by its angle",
            MOTION_ROTARY,
        )
    if isinstance(driver, Channel):
        return (f"{driver.name} acts on {name}", f"keep {driver.name} steady or compensate from it", THERMAL)
    if isinstance(shape, Reversal):
        if own:
            return (
                f"backlash or wind-up of the drive of {name}: worn nut, loose coupling or thrust bearing, friction",
                f"check nut, coupling and thrust bearing of {name}; then set the control's backlash compensation",
                POSITIONING,
            )
        return (
            f"play in the guide of {name} lets the carriage tip over when it reverses",
            f"check preload, gibs and wear of the guide of {name}; it cannot be compensated well",
            POSITIONING,
        )
    if isinstance(shape, Cyclic):
        return (
            f"eccentric screw or bearing of {name}, or interpolation error of its scale, with a pitch of "
            f"{shape.pitch:g} mm",
            f"check screw and encoder mounting of {name}, clean the scale, or enter a cyclic compensation",
            POSITIONING,
        )
    if isinstance(shape, Harmonic):
        return _harmonic(effect, shape, own)
    if effect.term.stage == LOCATION:
        return (
            f"{name} was not set up exactly, or has moved (crash, settling foundation, loosened fastening)",
            f"re-align {name}, or enter the value in the control's kinematic table",
            LOCATION_ERRORS,
        )
    if linear and own:
        return (
            f"scale or screw of {name} does not keep its pitch along the travel",
            f"enter a positioning compensation table for {name}",
            POSITIONING,
        )
    if linear:
        what = "twisted" if effect.term.is_rotation else "bent"
        return (
            f"the guideway of {name} is {what}: worn, badly levelled, or sagging under its load",
            f"check level and foundation bolts, re-scrape or re-align the guideway of {name}, or compensate "
            + ("volumetrically" if effect.term.is_rotation else "its straightness"),
            MOTION_LINEAR,
        )
    return (f"bearing or drive of {name} is worn", f"check bearing and drive of {name}", MOTION_ROTARY)


def _harmonic(effect: ChainEffect, shape: Harmonic, own: bool) -> tuple[str, str, str]:
    name = effect.joint.name
    if own and shape.order > 3:
        return (
            f"gear of {name} with {shape.order:g} errors a turn: eccentric pinion, tooth form, or the two waves of a "
            "strain wave gear's generator",
            f"check wear, lubrication and mounting of the gearbox of {name}, or enter a cyclic compensation "
            "by its angle",
            ROBOTS,
        )
    if own:
        source: dict[float, str] = {
            1: "eccentric encoder disc or worm wheel",
            2: "oval or doubly misaligned worm wheel or encoder",
        }
        return (
            f"{source.get(shape.order, 'worm wheel, gear or encoder error')} of {name}",
            f"check the encoder's centring and the worm drive of {name}, or enter an indexing compensation table",
            MOTION_ROTARY,
        )
    where = "face run-out and wobble" if effect.term.is_rotation else "run-out"
    return (
        f"bearing {where} of {name}, or its bearing seat is not round",
        f"check bearing preload, seat and wear of {name}, or compensate by its angle",
        MOTION_ROTARY,
    )


def _artefact(effect: ArtefactEffect) -> Words:
    if isinstance(effect.change, BallMoved):
        ball = effect.change.ball
        return Words(
            f"ball {ball} moved during run {effect.change.run}",
            "a stem came loose, or the ball was touched",
            f"tighten the stem of ball {ball} and repeat the run",
            "docs/effects.md",
        )
    if isinstance(effect.change, (TrackerShift, TrackerTurn)):
        how = "shifts" if isinstance(effect.change, TrackerShift) else "turns"
        return Words(
            f"the frame of the tracker {how}{_driver(effect)}",
            "the tracker's stand or the floor gives way, the tracker or the air warms up, or the robot's base moves",
            "warm the tracker up, fix its stand and the robot's base, measure fixed reflectors in between, and measure "
            "in shorter runs",
            "ISO 10360-10:2021 (laser trackers); docs/effects.md",
        )
    if isinstance(effect.change, Expansion):
        return Words(
            f"the artefact expands{_driver(effect)}",
            "the artefact's temperature changes while it is probed",
            "let the artefact take the machine's temperature, or give its expansion coefficient",
            "ISO 230-3:2020; ISO/TR 16015:2003",
        )
    return Words(
        f"the ball stems bend under their own weight as the table turns{_driver(effect)}",
        "stems are long or thin for the balls they carry",
        "use shorter or stiffer stems",
        "docs/effects.md",
    )


def describe(effect: ChainEffect | ArtefactEffect) -> Words:
    """The effect in words."""
    if isinstance(effect, ArtefactEffect):
        return _artefact(effect)
    cause, remedy, source = _cause_and_remedy(effect)
    return Words(_direction(effect) + _shape(effect) + _driver(effect), cause, remedy, source)
