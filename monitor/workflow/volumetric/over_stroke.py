"""The volumetric error point by point at one rotary pose, of one run or as the difference of two: for pictures."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace

import numpy as np
import scipy

from monitor.exceptions import InputError
from monitor.methods.model import chain_of
from monitor.records import Array
from monitor.reporting.svg.map_slices import Slice, slices_of
from monitor.store import Database
from monitor.uncertainty.volumetric import VolumetricError
from monitor.workflow.copied_readings import copied_readings
from monitor.workflow.measured import machine_campaign
from monitor.workflow.volumetric.answer import VolumetricAnswer
from monitor.workflow.volumetric.error_map import VolumetricMap, at_pose, drawn_axes, ranges_of
from monitor.workflow.volumetric.request import VolumetricRequest
from monitor.workflow.volumetric.stating import map_answer
from monitor.workflow.volumetric.volumetric import map_run

#: Points along each axis of a picture: more arrows than these hide each other.
PICTURE_POINTS = 5


@dataclass(frozen=True)
class OverStrokeRequest:
    """The error of a ``run`` (the last by default), or that less the error of the run ``minus`` of the same campaign.

    ``pose`` is the number of the rotary pose (0: all axes at zero). The other fields are those of a map. Raises
    InputError for a run less itself and a negative pose.
    """

    campaign: str
    run: int | None = None
    minus: int | None = None
    _: KW_ONLY
    pose: int = 0
    model: str | None = None
    points: int = PICTURE_POINTS
    absolute: bool = False

    def __post_init__(self) -> None:
        if self.run is not None and self.run == self.minus:
            raise InputError(f"run {self.run} less itself is zero everywhere; name two different runs")
        if self.pose < 0:
            raise InputError(f"pose {self.pose}: the poses are numbered from 0 on")

    def of_run(self, run: int | None) -> VolumetricRequest:
        """The question for the map of one run."""
        return VolumetricRequest(
            self.campaign, run, model=self.model, points=self.points, absolute=self.absolute
        )


@dataclass(frozen=True, eq=False)
class OverStrokeAnswer:
    """A map and its n points at the pose that was asked for: readings (n, 3) of the ``axes`` along X, Y, Z; error
    vectors (n, 3) in µm along the machine's X, Y, Z; expanded uncertainties (n,) of their lengths; three middle slices.

    Of a difference ``map`` is the difference throughout: its uncertainty adds those of both runs as independent. What
    both runs share (a bar that is wrong, lack of fit) would cancel, so that it is an upper value.
    """

    map: VolumetricAnswer
    minus: int | None
    pose: int
    axes: tuple[str, str, str]
    readings_mm: Array
    vectors_um: Array
    expanded_um: Array
    slices: tuple[Slice, ...]


def over_stroke(db: Database, request: OverStrokeRequest) -> OverStrokeAnswer:
    """Map one run, or the difference of two, point by point; nothing is stored.

    Raises NotFoundError, DataError, InputError for a machine without three linear axes or a pose that is not there.
    """
    # A robot has no strokes: said before anything is evaluated, which takes seconds.
    campaign = machine_campaign(db, request.campaign, "map", lambda method: method.map)
    chain = chain_of(campaign.machine)
    drawn_axes(chain, ranges_of(campaign, chain)[0])
    mapped = map_run(db, request.of_run(request.run))
    stated = replace(map_answer(mapped), copied_readings=copied_readings(db, campaign))
    if request.minus is not None:
        if mapped.evaluated.run == request.minus:
            raise InputError(f"run {request.minus} less itself is zero everywhere; name two different runs")
        other = map_run(db, request.of_run(request.minus))
        mapped = _difference(mapped, other)
        stated = replace(_by_parameter(map_answer(mapped)), copied_readings=stated.copied_readings)
    if request.pose >= len(mapped.poses):
        raise InputError(f"pose {request.pose}: the plan has the poses 0 to {len(mapped.poses) - 1}")
    drawn = at_pose(mapped, request.pose)
    return OverStrokeAnswer(
        map=stated,
        minus=request.minus,
        pose=request.pose,
        axes=drawn.axes,
        readings_mm=np.round(drawn.readings_mm, 4),
        vectors_um=np.round(drawn.vectors_um, 4),
        expanded_um=np.round(stated.k * drawn.u_um, 4),
        slices=tuple(slices_of(drawn.readings_mm, drawn.vectors_um, stated.k * drawn.u_um, drawn.axes)),
    )


def _difference(first: VolumetricMap, second: VolumetricMap) -> VolumetricMap:
    """The first map less the second: parameters of both runs side by side, those of the second with the sign turned."""
    ours, theirs = first.error, second.error
    before = dict(zip(second.errors.names, second.errors.estimate, strict=True))
    changes = [
        value - before.get(name, 0.0)
        for name, value in zip(first.errors.names, first.errors.estimate, strict=True)
    ]
    return replace(
        first,
        # What lies between the points has the size of its change.
        errors=replace(first.errors, estimate=np.array(changes)),
        error=VolumetricError(
            positions=ours.positions,
            vectors=ours.vectors - theirs.vectors,
            sensitivity=np.concatenate([ours.sensitivity, -theirs.sensitivity], axis=-1),
            names=(
                *(f"{name} of run {first.evaluated.run}" for name in ours.names),
                *(f"{name} of run {second.evaluated.run}" for name in theirs.names),
            ),
            coefficients=np.concatenate([ours.coefficients, theirs.coefficients]),
            parameter_covariance=scipy.linalg.block_diag(ours.parameter_covariance, theirs.parameter_covariance),
            # Both are of the same repeatability.
            degrees_of_freedom=min(ours.degrees_of_freedom, theirs.degrees_of_freedom),
            datum=ours.datum,
        ),
    )  # fmt: skip


def _by_parameter(answer: VolumetricAnswer) -> VolumetricAnswer:
    """The answer with what the change of each parameter adds at the worst point, both runs together."""
    sums: dict[str, float] = {}
    for name, value in (answer.worst.by_parameter_um or {}).items():
        parameter = name.rpartition(" of run ")[0]
        sums[parameter] = sums.get(parameter, 0.0) + value
    parameters = tuple(dict.fromkeys(name.rpartition(" of run ")[0] for name in answer.parameters))
    return replace(answer, parameters=parameters, worst=replace(answer.worst, by_parameter_um=sums))
