"""One error of one joint (ISO 230-1), in words: what it is, what usually causes it, what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

from monitor.effects.description import (
    LOCATION_ERRORS,
    MOTION_LINEAR,
    MOTION_ROTARY,
    OF_DRIVER,
    OF_TERM,
    POSITIONING,
    THERMAL,
    Explanation,
)
from monitor.machine import LOCATION, Joint, Term

#: Names of error motions by: rotation or not, axis that turns or not, along the joint's own axis or not.
MOTIONS = {
    (True, True, True): "angular positioning error",
    (True, True, False): "tilt about {axis}",
    (True, False, True): "roll",
    (True, False, False): "tilt about {axis}",
    (False, True, True): "axial displacement",
    (False, True, False): "radial displacement in {axis}",
    (False, False, True): "positioning error",
    (False, False, False): "straightness deviation in {axis}",
}


@dataclass(frozen=True)
class JointError:
    """A term of ISO 230-1 with the joint to which it belongs."""

    term: Term
    joint: Joint

    @property
    def name(self) -> str:
        """The name of the axis."""
        return self.joint.name

    @property
    def is_along(self) -> bool:
        """Whether the error is along or about the direction of the axis."""
        return self.joint.main == self.term.component % 3

    @property
    def is_of_drive(self) -> bool:
        """Whether the error is in the coordinate that the drive of the axis moves."""
        return self.is_along and self.term.is_rotation == self.joint.turns

    @property
    def is_location(self) -> bool:
        """Whether this is a location error, not an error motion."""
        return self.term.stage == LOCATION

    @property
    def meaning(self) -> str:
        """What the error is, in words."""
        axis = "XYZ"[self.term.component % 3]
        label = f"{'spindle' if self.joint.kind == 'spindle' else f'{self.name} axis'} ({self.name})"
        if not self.is_location:
            motion = MOTIONS[self.term.is_rotation, self.joint.turns, self.is_along].format(axis=axis)
            return f"{motion} of the {label}"
        if not self.term.is_rotation:
            return f"{label} shifted in {axis}"
        return f"{label} off its zero angle" if self.is_along else f"{label} turned about {axis}"

    def explanation(self) -> Explanation:
        """Explain the error where neither its shape nor its driver says more."""
        if self.is_location:
            return self._explain_location()
        if self.joint.turns:
            return Explanation(
                f"bearing or drive of {self.name} is worn",
                f"check bearing and drive of {self.name}",
                MOTION_ROTARY,
                OF_TERM,
            )
        if self.is_of_drive:
            return Explanation(
                f"scale or screw of {self.name} does not keep its pitch along the travel",
                f"enter a positioning compensation table for {self.name}",
                POSITIONING,
                OF_TERM,
            )
        return self._explain_guideway()

    def _explain_location(self) -> Explanation:
        return Explanation(
            f"{self.name} was not set up exactly, or has moved (crash, settling foundation, loosened fastening)",
            f"re-align {self.name}, or enter the value in the control's kinematic table",
            LOCATION_ERRORS,
            OF_TERM,
        )

    def _explain_guideway(self) -> Explanation:
        rotation = self.term.is_rotation
        return Explanation(
            f"the guideway of {self.name} is {'twisted' if rotation and self.is_along else 'bent'}: worn, badly "
            "levelled, or sagging under its load",
            f"check level and foundation bolts, re-scrape or re-align the guideway of {self.name}, or compensate "
            + ("volumetrically" if rotation else "its straightness"),
            MOTION_LINEAR,
            OF_TERM,
        )

    def explanation_of_heat(self) -> Explanation:
        """Explain the error where it follows a temperature or the time since a start."""
        if self.joint.kind == "spindle":
            return Explanation(
                "heat of the spindle bearings and motor makes the spindle grow or tilt",
                "warm the spindle up before measuring and machining, check bearing preload and cooling, or compensate "
                "from its temperature",
                THERMAL,
                OF_DRIVER,
            )
        if self.is_of_drive and not self.joint.turns:
            return Explanation(
                f"the ball screw or scale of {self.name} warms up and expands",
                f"warm {self.name} up, check screw preload, lubrication and cooling, or compensate from its "
                "temperature",
                THERMAL,
                OF_DRIVER,
            )
        if self.joint.turns and self.term.stage != LOCATION and self.term.component == self.joint.main:
            return Explanation(
                f"{self.name} or what it carries warms up and grows along its axis",
                f"warm {self.name} up before measuring and machining, check bearing preload and cooling, or compensate "
                "from its temperature",
                THERMAL,
                OF_DRIVER,
            )
        return Explanation(
            f"the structure that carries {self.name} warms up unevenly and bends",
            "warm the machine up, shield it from draughts and sun, check the coolant temperature, or compensate",
            THERMAL,
            OF_DRIVER,
        )
