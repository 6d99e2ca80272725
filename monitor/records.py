"""What a calibration campaign is: frozen records in internal units (mm, rad, s, °C).

Readers make them, the store keeps them, the methods read them. Recorded conditions and channels keep the
unit that their name ends in (``ambient_degC``, ``warm_up_min``).
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Kind = Literal["linear", "rotary", "spindle"]
Branch = Literal["work", "tool"]

#: ISO 841: X, Y, Z and U, V, W, parallel to them, are linear axes; A, B, C turn.
LINEAR_LETTERS = "XYZUVW"


@dataclass(frozen=True)
class AxisSettings:
    """What the machine file says of one axis; None where it says nothing.

    ``stroke`` is in mm for a linear axis and in rad for a rotary one, ``scale_pitch`` in mm. ``gear_ratio`` is
    the turns of the motor for one of a rotary axis.
    """

    name: str
    sign: int | None = None
    stroke: tuple[float, float] | None = None
    scale_pitch: float | None = None
    gear_ratio: float | None = None


@dataclass(frozen=True)
class ChainAxis:
    """One axis that the machine file places freely.

    ``direction`` is the unit vector of its travel or rotation and ``offset`` (mm) the step from the axis before
    it on its branch (from the bed for the first), both in the machine's frame at all axes zero. ``sign`` turns a
    reading into the physical displacement; None: ISO 841, +1 on the tool's side and -1 on the work's.
    """

    name: str
    kind: Kind
    branch: Branch
    direction: Vector
    offset: Vector = (0.0, 0.0, 0.0)
    sign: int | None = None


def topology_of(axes: Sequence[ChainAxis]) -> str:
    """The names of freely placed axes from the workpiece to the tool, the spindle in brackets: ``w b J1 J2 t``."""
    work = [axis.name for axis in axes if axis.branch == "work"]
    tool = [
        f"({axis.name})" if axis.kind == "spindle" else axis.name for axis in axes if axis.branch == "tool"
    ]
    return " ".join(["w", *reversed(work), "b", *tool, "t"])


@dataclass(frozen=True)
class Machine:
    """A machine as its file describes it. ``tolerances`` are limits of absolute values in display units.

    ``chain`` holds the axes of a machine that places them freely, the work branch from the bed outwards, then
    the tool branch; ``topology`` then only names them in their order. It is empty where the letters of
    ``topology`` say everything. ``gravity`` is the direction of gravity in the machine's frame, None where the
    file does not tell it.
    """

    id: str
    topology: str
    manufacturer: str | None = None
    model: str | None = None
    serial_number: str | None = None
    location: str | None = None
    axes: Mapping[str, AxisSettings] = field(default_factory=dict)
    tolerances: Mapping[str, float] = field(default_factory=dict)
    chain: tuple[ChainAxis, ...] = ()
    gravity: Vector | None = None

    def is_linear(self, axis: str) -> bool:
        """Whether an axis travels rather than turns."""
        for one in self.chain:
            if one.name == axis:
                return one.kind == "linear"
        return axis[:1] in LINEAR_LETTERS


@dataclass(frozen=True)
class Probe:
    """A probe; ``standard_uncertainty`` of one coordinate and ``tip`` (in the spindle frame) in mm."""

    id: str
    model: str
    standard_uncertainty: float
    tip: tuple[float, float, float] | None = None
    certificate: str | None = None


@dataclass(frozen=True)
class Ball:
    """A ball; ``nominal`` is its centre in the frame of the last work axis at all axes zero, in mm."""

    id: str
    nominal: tuple[float, float, float]
    diameter: float


@dataclass(frozen=True)
class ScaleBar:
    """A calibrated distance between the centres of two balls: length and standard uncertainty in mm.

    ``expansion_coefficient`` is in 1/K and ``reference_temperature`` in °C, None where not given.
    """

    balls: tuple[str, str]
    length: float
    standard_uncertainty: float
    certificate: str
    expansion_coefficient: float | None = None
    reference_temperature: float | None = None


@dataclass(frozen=True)
class Artefact:
    """The balls, and the scale bar where the method needs one."""

    id: str
    balls: tuple[Ball, ...]
    scale_bar: ScaleBar | None = None


@dataclass(frozen=True)
class Run:
    """One run of the plan and its conditions, each in the unit that its name ends in."""

    run: int
    started_at: datetime
    day: int
    warm_up: bool
    conditions: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Probings:
    """All probings of a campaign, row by row in file order (n rows).

    ``run`` and ``sequence`` are integers (n,), ``time`` seconds since the run's start (n,), ``target`` ball
    names (n,), ``readings`` axis name to (n,) in mm or rad, ``channels`` recorded column to (n,) in the unit
    that its name ends in, NaN where a cell is empty.
    """

    run: npt.NDArray[np.int64]
    sequence: npt.NDArray[np.int64]
    time: Array
    target: npt.NDArray[np.str_]
    readings: Mapping[str, Array]
    channels: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.run)

    def rows(self, chosen: npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> Probings:
        """The chosen rows (a mask or indices), in order."""
        return Probings(
            self.run[chosen],
            self.sequence[chosen],
            self.time[chosen],
            self.target[chosen],
            {axis: values[chosen] for axis, values in self.readings.items()},
            {name: values[chosen] for name, values in self.channels.items()},
        )


@dataclass(frozen=True)
class SourceFile:
    """One imported file, byte for byte."""

    name: str
    content: bytes

    @property
    def sha256(self) -> str:
        """The hash of the content, in hexadecimal digits."""
        return hashlib.sha256(self.content).hexdigest()


@dataclass(frozen=True)
class Campaign:
    """A campaign: one machine, one artefact, one probe, and the runs of one plan."""

    name: str
    method: str
    machine: Machine
    probe: Probe
    artefact: Artefact
    runs: tuple[Run, ...]
    probings: Probings
    files: tuple[SourceFile, ...] = ()
