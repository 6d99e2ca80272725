"""What a calibration campaign is: frozen records in internal units (mm, rad, s, °C).

Recorded conditions and channels keep the unit that their name ends in (``ambient_degC``, ``warm_up_min``).
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Literal

import numpy as np
import numpy.typing as npt

from monitor.sources import Source

Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Kind = Literal["linear", "rotary", "spindle"]
Branch = Literal["work", "tool"]

#: ISO 841: X, Y, Z and U, V, W, parallel to them, are linear axes; A, B, C turn.
LINEAR_LETTERS = "XYZUVW"
VOLUMETRIC = "volumetric"  #: Among the tolerances, the limit of the longest error vector over the strokes.


class ValidationVerdict(StrEnum):
    """Whether Monte Carlo confirms a first-order result; the value is how documents store it."""

    VALIDATED = "validated"
    NOT_VALIDATED = "not validated"
    UNDECIDED = "undecided"


class Verdict(StrEnum):
    """Whether a model explains the measurements."""

    EXPLAINED = "explained"
    SOMETHING_IS_MISSING = "something is missing"


class SecondSetup(StrEnum):
    """What a second set-up has that tells effects apart where no pose of the first one does."""

    LONGER_STYLUS = "longer_stylus"
    STYLUS_BESIDE = "stylus_beside"
    TURNED = "turned"
    FURTHER = "further"
    HIGHER = "higher"


@dataclass(frozen=True)
class AuditAnchor:
    """The last entry of a database's audit chain at a moment: its number and its SHA-256, hexadecimal.

    Kept outside of the database, on a certificate or a report, it shows later that nothing before it was rewritten.
    """

    entry: int
    sha256: str


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


@dataclass(frozen=True)
class Machine:
    """A machine as its file describes it. ``tolerances`` are limits of absolute values in display units.

    ``chain`` holds the axes of a machine that places them freely, the work branch from the bed outwards, then the tool
    branch; ``topology`` then only names them in their order. It is empty where the letters of ``topology`` say all.
    ``gravity`` is its direction in the machine's frame, None where not stated. A ``virtual`` machine was simulated.
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
    virtual: bool = False

    def is_linear(self, axis: str) -> bool:
        """Whether an axis travels rather than turns."""
        for chain_axis in self.chain:
            if chain_axis.name == axis:
                return chain_axis.kind == "linear"
        return axis[:1] in LINEAR_LETTERS


@dataclass(frozen=True)
class Probe:
    """A probe: u of a coordinate and ``tip`` (spindle frame) in mm, of a scale in mm/mm; what is ``known`` as exact."""

    id: str
    model: str
    standard_uncertainty: float
    tip: tuple[float, float, float] | None = None
    certificate: str | None = None
    scale_uncertainty: float | None = None
    known: tuple[str, ...] = ()


@dataclass(frozen=True)
class Ball:
    """A ball; ``nominal`` is its centre in the frame of the last work axis at all axes zero, in mm."""

    id: str
    nominal: tuple[float, float, float]
    diameter: float


@dataclass(frozen=True)
class ScaleBar:
    """A calibrated distance between the centres of two balls: length and standard uncertainty in mm,
    ``expansion_coefficient`` in 1/K and ``reference_temperature`` in °C, None where not given."""

    balls: tuple[str, str]
    length: float
    standard_uncertainty: float
    certificate: str
    expansion_coefficient: float | None = None
    reference_temperature: float | None = None


@dataclass(frozen=True)
class KnownError:
    """An error that was measured by other means: ``EXX(110)``, its value and standard uncertainty in mm."""

    parameter: str
    value: float
    standard_uncertainty: float
    certificate: str


@dataclass(frozen=True)
class SelfCalibration:
    """How the errors of a self-calibration are tabulated, and what fixes the frame that no reading fixes.

    ``nodes`` maps a linear axis to the readings in mm at which its errors are unknowns. ``conditions`` are the
    boundary conditions, each a parameter that is zero by choice (``EYX(0)``) or a word of the method; empty
    means the method's own. ``length`` is the one error that must be measured by other means, for the unit of length.
    """

    nodes: Mapping[str, tuple[float, ...]]
    length: KnownError
    conditions: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reflector:
    """A reflector that a tracker looks at: on the tool, or ``fixed`` beside the machine."""

    id: str
    fixed: bool = False


@dataclass(frozen=True)
class Module:
    """A module of an L-shaped piece: calibrated ``centre`` (2,) mm and ``tilt`` (2,) rad along the arms."""

    id: str
    centre: tuple[float, float]
    tilt: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Placement:
    """How the piece lies: its arms along the two axes of ``plane``; ``corner`` (3,) mm are the readings of X, Y and Z
    with which the sensor stands over the first module."""

    plane: str
    corner: tuple[float, float, float]


@dataclass(frozen=True)
class LShape:
    """An L-shaped standard piece and the optics that it is scanned with.

    ``focal_length`` of the autocollimator and ``paraboloid``, the radius of curvature at the vertex of the modules'
    paraboloids, in mm; standard uncertainties of the modules' calibration in mm and rad. The module whose centre is
    nearest to the piece's origin is the ``reference`` to which the others were calibrated.
    """

    focal_length: float
    paraboloid: float
    place_uncertainty: float
    tilt_uncertainty: float
    modules: tuple[Module, ...]
    placements: tuple[Placement, ...]

    @property
    def reference(self) -> int:
        """Index of the reference module."""
        return min(range(len(self.modules)), key=lambda index: sum(c**2 for c in self.modules[index].centre))


#: The kinds of readings that tell where the tool point is against the work point, in the machine's own coordinates.
FROM_TOOL_POINT = frozenset({"vector", "component", "distance", "displacement", "offset"})
#: The kinds of readings that bring a unit of length of their own: whole travels and places, not deviations.
BRINGS_SCALE = frozenset({"displacement", "point", "pose"})


@dataclass(frozen=True)
class Setup:
    """One way in which an instrument is set up: what one of its readings is a statement about.

    ``reading`` names the kind; ``standard_uncertainty`` is that of one reading, in mm or rad, None where every row
    states its own; ``turn_uncertainty`` (rad) is that of the orientation of a kind that reads a place besides.
    ``tool_point`` and ``work_point`` (mm) are in the frames of the last tool and work axis; the unit vectors
    ``direction`` and ``tool_direction`` are parallel to the machine's frame at all axes zero. ``length`` (mm) of a bar
    is free where ``length_uncertainty`` is None; ``direction_uncertainty`` (rad) is that of a beam across its
    direction, None where nobody states it. ``along`` is the axis of a straightness, ``side`` that of a level, ``frame``
    that in which a vector is read; ``known`` names the unknowns held as stated; ``drift_uncertainty`` (mm or rad) is
    that of what its numbers drift over a run, ``tool_point_uncertainty`` (mm) of each tool-point coordinate,
    ``scale_uncertainty`` (mm/mm) of what its lengths are off in proportion to themselves."""

    id: str
    reading: str
    standard_uncertainty: float | None
    instrument: str | None = None
    tool_point: Vector = (0.0, 0.0, 0.0)
    work_point: Vector = (0.0, 0.0, 0.0)
    direction: Vector | None = None
    tool_direction: Vector | None = None
    length: float | None = None
    length_uncertainty: float | None = None
    direction_uncertainty: float | None = None
    along: str | None = None
    side: Branch = "tool"
    frame: Branch = "work"
    known: tuple[str, ...] = ()
    turn_uncertainty: float | None = None
    certificate: str | None = None
    drift_uncertainty: float | None = None
    tool_point_uncertainty: float | None = None
    scale_uncertainty: float | None = None

    @property
    def takes_tool_point(self) -> bool:
        """Whether its readings count from a tool point that is taken as it is stated."""
        return self.reading in FROM_TOOL_POINT and self.tool_point_uncertainty is None

    @property
    def takes_scale(self) -> bool:
        """Whether its readings bring a unit of length that is taken as exact, without its being stated as known."""
        return self.reading in BRINGS_SCALE and self.scale_uncertainty is None and "scale" not in self.known


@dataclass(frozen=True)
class Artefact:
    """Balls, scale bar, reflectors, tables and conditions of a self-calibration, setups: what the method has."""

    id: str
    balls: tuple[Ball, ...]
    scale_bar: ScaleBar | None = None
    reflectors: tuple[Reflector, ...] = ()
    l_shape: LShape | None = None
    self_calibration: SelfCalibration | None = None
    setups: tuple[Setup, ...] = ()


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

    def rows(self, selection: npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> Probings:
        """Return the selected rows (a mask or indices), in order."""
        return Probings(
            self.run[selection],
            self.sequence[selection],
            self.time[selection],
            self.target[selection],
            {axis: values[selection] for axis, values in self.readings.items()},
            {name: values[selection] for name, values in self.channels.items()},
        )


@dataclass(frozen=True)
class SourceFile:
    """One imported file, byte for byte; of one that was archived only the hash, its ``content`` is empty."""

    name: str
    content: bytes
    archived_sha256: str | None = None

    @property
    def sha256(self) -> str:
        """The hash of the content, in hexadecimal digits."""
        return self.archived_sha256 or hashlib.sha256(self.content).hexdigest()


@dataclass(frozen=True)
class Campaign:
    """A campaign: one machine, one artefact, one probe, the runs of one plan, and the stated sources of uncertainty."""

    name: str
    method: str
    machine: Machine
    probe: Probe
    artefact: Artefact
    runs: tuple[Run, ...]
    probings: Probings
    files: tuple[SourceFile, ...] = ()
    sources: tuple[Source, ...] = ()


@dataclass(frozen=True)
class Instrument:
    """What a curve belongs to: a load cell, a resistor, a thermometer."""

    id: str
    manufacturer: str | None = None
    model: str | None = None
    serial_number: str | None = None
    location: str | None = None


@dataclass(frozen=True)
class CurveCampaign:
    """One response measured at many values of its inputs, row by row in file order (n rows).

    ``columns`` are the numbers (n,) by name, the response among them, each in the unit of ``units`` ("" where
    nothing says one); a column of dates holds days since its first. ``groups`` are labels (n,) by name. ``base``
    is the one-line model; ``time`` the column that says when a row was measured, None where the order of the
    rows is all there is; ``lines`` (n,) the line of each row in the file. ``standard_uncertainty`` is that of one
    response as stated, in its unit.
    """

    name: str
    method: str
    instrument: Instrument
    response: str
    base: str
    columns: Mapping[str, Array]
    groups: Mapping[str, npt.NDArray[np.str_]]
    units: Mapping[str, str]
    time: str | None
    lines: npt.NDArray[np.int64]
    standard_uncertainty: float | None = None
    files: tuple[SourceFile, ...] = ()

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def measured(self) -> Array:
        """The response (n,)."""
        return self.columns[self.response]


@dataclass(frozen=True)
class LinearAxisErrors:
    """Standard uncertainties of what is left of one linear axis's errors, in mm and mm/mm.

    ``proportional`` is positioning in proportion to the travel, ``positioning`` the rest of it, ``straightness`` each
    of the two directions across the travel; ``squareness`` to another axis, by the name of that axis.
    """

    proportional: float = 0.0
    positioning: float = 0.0
    straightness: float = 0.0
    squareness: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class LinearAxes:
    """Errors of the linear axes by name. What is not proportional is independent at nodes a distance apart that lies,
    unknown, between ``node_spacing`` (mm), with straight lines between them."""

    axes: Mapping[str, LinearAxisErrors]
    node_spacing: tuple[float, float]


class FrameKind(StrEnum):
    """What a parameter is stated relative to; the value is how records store it."""

    MACHINE = "machine frame"
    PRECEDING_AXIS = "preceding axis"
    OWN_AXIS = "own axis"


@dataclass(frozen=True)
class FrameOfReference:
    """What a parameter refers to: the frame of the machine, or that of an ``axis``, before it or its own."""

    kind: FrameKind
    axis: str | None = None
