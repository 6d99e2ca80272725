"""What the user reads of an effect: its meaning, usual cause, remedy, and where it is described."""

from __future__ import annotations

from dataclasses import dataclass

# The standards that define the terms and their tests.
MOTION_LINEAR = "ISO 230-1:2012 (error motions of linear axes)"
MOTION_ROTARY = "ISO 230-1:2012 and ISO 230-7:2015 (error motions of axes of rotation)"
LOCATION_ERRORS = "ISO 230-1:2012 and ISO 230-7:2015 (location errors)"
POSITIONING = "ISO 230-2:2014 (positioning of axes)"
THERMAL = "ISO 230-3:2020 (thermal effects)"
ROBOTS = "ISO 9283:1998 (performance of industrial robots); Mooring, Roth and Driels, Manipulator calibration, 1991"
# Of effects that no standard describes.
OWN_DOCUMENT = "docs/effects.md"

# How specific an explanation is. The term explains every effect; its shape says more, its driver more than that.
# Settling and compliance are mechanisms of their own, and what varies by run without a record outranks them all.
OF_TERM, OF_SHAPE, OF_DRIVER, OF_MECHANISM, OF_RUNS = range(5)


@dataclass(frozen=True)
class Explanation:
    """The usual cause of an effect, what to do about it, and where it is described."""

    cause: str
    remedy: str
    described_in: str
    specificity: int = OF_SHAPE


@dataclass(frozen=True)
class Description:
    """An effect in plain sentences."""

    meaning: str
    cause: str
    remedy: str
    described_in: str


def described(meaning: str, explanation: Explanation) -> Description:
    """Join the meaning of an effect and its explanation."""
    return Description(meaning, explanation.cause, explanation.remedy, explanation.described_in)


def power_of(order: int) -> str:
    """Return how something grows with a power: ``with the square of``."""
    return {1: "in proportion to", 2: "with the square of", 3: "with the cube of"}.get(
        order, f"with power {order} of"
    )
