"""The answer to the question for the volumetric error: what is shown and what is stored. Lengths of errors in µm.

Readings are keyed ``x_mm``, ``b_deg``, vectors ``x``, ``y``, ``z``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from monitor.documents import OMITTED, Said, named
from monitor.records import Array
from monitor.reporting.between_points import BetweenPoints, StepPlace
from monitor.reporting.svg.map_slices import Slice


@dataclass(frozen=True)
class MapRegion:
    """Where the error was mapped: readings from and to of the linear axes, and where these are from."""

    readings_mm: Mapping[str, tuple[float, float]]
    origin: str = field(metadata=named("from"))
    points_an_axis: int
    rotary_poses: int
    points: int


@dataclass(frozen=True, eq=False)
class MapPoint:
    """The error at one commanded point, with its covariance (3, 3); at the worst point what each parameter adds to its
    length, signed, along the vector."""

    at: Mapping[str, float]
    error_um: float
    u_um: float
    expanded_um: float
    vector_um: Mapping[str, float]
    u_vector_um: Mapping[str, float]
    covariance_um2: Array
    by_parameter_um: Mapping[str, float] | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class MapLength:
    """A mean length of the error with its uncertainty."""

    error_um: float
    u_um: float
    expanded_um: float


@dataclass(frozen=True)
class PoseError:
    """Largest and RMS error over the grid at one rotary pose."""

    at: Mapping[str, float]
    worst_um: float
    rms_um: float


@dataclass(frozen=True)
class LeftOutOfMap:
    """A parameter that the map does not contain, and why.

    ``outside_model``: it is an error of the machine that the model does not have.
    """

    parameter: str
    why: str
    outside_model: bool | None = field(default=None, metadata=OMITTED)


@dataclass(frozen=True)
class VolumetricAnswer:
    """The volumetric error of one run. ``k`` is the coverage factor of one length for the probability ``p``.

    ``refers_to`` says in words what each parameter, in the map or left out of it, is stated relative to, and
    ``vectors_refer_to`` what the vectors are: not of the same frame. ``copied_readings`` says which runs of the
    campaign equal those of another, and which rows of a run earlier ones: no part of what is stored.
    """

    campaign: str
    machine: str
    run: int
    model: str
    p: float
    k: float
    degrees_of_freedom: float | None
    region: MapRegion
    datum: Mapping[str, float] | None
    parameters: tuple[str, ...]
    left_out: tuple[LeftOutOfMap, ...]
    worst: MapPoint
    mean: MapLength
    rms: MapLength
    least_certain: MapPoint
    by_pose: tuple[PoseError, ...]
    slices: tuple[Slice, ...]
    refers_to: Mapping[str, str]
    vectors_refer_to: str
    between_points: tuple[BetweenPoints, ...] | None = field(default=None, metadata=OMITTED)
    step_places: tuple[StepPlace, ...] | None = field(default=None, metadata=OMITTED)
    figures: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    tables: tuple[str, ...] | None = field(default=None, metadata=OMITTED)
    copied_readings: tuple[Said, ...] | None = field(default=None, metadata=OMITTED)

    @property
    def has_rotary_axes(self) -> bool:
        """Whether the machine has rotary axes, by which there are poses."""
        return any(pose.at for pose in self.by_pose)
