"""The volumetric error that a certificate prints: its largest, mean and RMS over the region, and every point of a grid.

It is stored with the certificate's record, so that figure and numbers can be made again from there alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import zip_longest

from monitor.documents import OMITTED
from monitor.records import Array
from monitor.refusal import Refusal
from monitor.reporting.between_points import BetweenPoints, StepPlace
from monitor.reporting.refused import RefusedParameters

Place = tuple[tuple[str, float, str], ...]


@dataclass(frozen=True)
class Length:
    """A length of the error, µm, its standard and expanded uncertainty; ``at`` is where: (axis, reading, unit)."""

    value_um: float
    u_um: float
    expanded_um: float
    at: Place = ()


@dataclass(frozen=True, eq=False)
class VolumetricResult:
    """The volumetric error of one state of the machine over a region, as one evaluation gave it.

    ``k`` is the coverage factor of one length for the probability ``p``. The region: ``ranges`` (axis, from, to) in mm
    of the linear axes, ``from_strokes`` where these are the machine's strokes, ``each`` points along each axis at
    ``poses`` rotary poses, ``points`` in all. ``datum`` is where the workpiece's zero was set, empty where nowhere.
    ``left_out`` are parameters that the map does not contain, and why in an English sentence;
    ``left_out_refusals`` are the refusals that they belong to, in their order, None where the sentence is all there is.
    ``between_points`` are the errors that the points do not follow, ``step_places`` the steps of whose place the range
    alone is known; None where there are none, and in older records. ``turns``: whether the machine has rotary axes;
    None in records of version 0.2.0, whose page has the number of poses of either.

    The grid with the rotary axes at zero: ``readings_mm`` (n, 3) of ``axes``, ``vectors_um`` (n, 3) along X, Y and Z
    of the machine, ``expanded_um`` (n,) of their lengths.
    """

    state: str
    p: float
    k: float
    ranges: tuple[tuple[str, float, float], ...]
    from_strokes: bool
    each: int
    poses: int
    points: int
    datum: Place
    largest: Length
    mean: Length
    rms: Length
    left_out: tuple[tuple[str, str], ...]
    axes: tuple[str, ...]
    readings_mm: Array
    vectors_um: Array
    expanded_um: Array
    left_out_refusals: tuple[Refusal | None, ...] = ()
    between_points: tuple[BetweenPoints, ...] | None = field(default=None, metadata=OMITTED)
    step_places: tuple[StepPlace, ...] | None = field(default=None, metadata=OMITTED)
    turns: bool | None = field(default=None, metadata=OMITTED)

    @property
    def refused(self) -> tuple[tuple[str, RefusedParameters], ...]:
        """The parameters that are left out, each with the refusal that it belongs to."""
        return tuple(
            (
                name,
                RefusedParameters((name,), why)
                if refusal is None
                else RefusedParameters(refusal.parameters, why, refusal.reason),
            )
            for (name, why), refusal in zip_longest(self.left_out, self.left_out_refusals)
        )
