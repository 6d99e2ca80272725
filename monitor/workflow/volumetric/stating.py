"""States a volumetric map as the answer that is shown and stored."""

from __future__ import annotations

import numpy as np

from monitor.exceptions import InputError
from monitor.machine import Chain
from monitor.records import Array
from monitor.reporting.refused import RefusedParameters
from monitor.reporting.run_coefficient import run_of
from monitor.reporting.svg.map_slices import Slice, slices_of
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.models import label
from monitor.workflow.uncertainty.machine_frame import refers_to
from monitor.workflow.volumetric.answer import (
    LeftOutOfMap,
    MapLength,
    MapPoint,
    MapRegion,
    PoseError,
    VolumetricAnswer,
)
from monitor.workflow.volumetric.between_points import between_points, step_places
from monitor.workflow.volumetric.error_map import VolumetricMap, at_pose

AXES = "xyz"
#: What a vector of the map is (``monitor.uncertainty.volumetric``).
VECTORS = "the tip relative to the workpiece, along X, Y and Z of the machine"


def map_answer(mapped: VolumetricMap) -> VolumetricAnswer:
    """The answer of a map, in display units."""
    error, chain, evaluated = mapped.error, mapped.errors.chain, mapped.evaluated
    p = evaluated.answer.p
    k = error.factor(p)
    by_parameter = {
        name: _um(value)
        for name, value in error.budget(error.worst).items()
        if np.isfinite(value) and run_of(name) in (None, evaluated.run)
    }
    return VolumetricAnswer(
        campaign=evaluated.campaign.name,
        machine=evaluated.campaign.machine.id,
        run=evaluated.run,
        model=label(evaluated.model),
        p=p,
        k=k,
        degrees_of_freedom=error.degrees_of_freedom if np.isfinite(error.degrees_of_freedom) else None,
        region=MapRegion(
            readings_mm=mapped.ranges,
            origin="the machine file's strokes" if mapped.from_strokes else "what the campaign visited",
            points_an_axis=mapped.points,
            rotary_poses=len(mapped.poses),
            points=len(error.lengths),
        ),
        datum=None if error.datum is None else _at(chain, error.datum),
        parameters=tuple(
            name
            for name in error.names
            if name not in mapped.left_out and run_of(name) in (None, evaluated.run)
        ),
        left_out=tuple(_left_out(name, refused) for name, refused in mapped.left_out.items()),
        worst=_point(mapped, error.worst, k, by_parameter),
        mean=_length(*error.mean, k),
        rms=_length(*error.rms, k),
        least_certain=_point(mapped, error.least_certain, k),
        by_pose=tuple(_pose(mapped, number) for number in range(len(mapped.poses))),
        slices=_slices(mapped, k),
        refers_to=refers_to((*error.names, *mapped.left_out), chain),
        vectors_refer_to=VECTORS,
        between_points=between_points(mapped) or None,
        step_places=step_places(mapped) or None,
    )


def _left_out(name: str, refused: RefusedParameters) -> LeftOutOfMap:
    is_outside = refused.reason is not None and refused.reason.kind.is_outside_model
    return LeftOutOfMap(name, refused.why, True if is_outside else None)


def _um(length: float) -> float:
    return MICROMETRE.to_display(length)


def _length(value: float, u: float, k: float) -> MapLength:
    return MapLength(_um(value), _um(u), _um(k * u))


def _at(chain: Chain, position: Array) -> dict[str, float]:
    """Readings of a commanded point."""
    return {
        f"{joint.name.lower()}_{'deg' if joint.turns else 'mm'}": round(
            joint.sign * (DEGREE.to_display(float(value)) if joint.turns else float(value)), 6
        )
        + 0.0
        for joint, value in zip(chain.joints, position, strict=True)
        if joint.kind != "spindle"
    }


def _point(
    mapped: VolumetricMap, index: int, k: float, by_parameter_um: dict[str, float] | None = None
) -> MapPoint:
    error = mapped.error
    u = float(error.u_lengths[index])
    return MapPoint(
        at=_at(mapped.errors.chain, error.positions[index]),
        error_um=_um(float(error.lengths[index])),
        u_um=_um(u),
        expanded_um=_um(k * u),
        vector_um={axis: _um(float(v)) for axis, v in zip(AXES, error.vectors[index], strict=True)},
        u_vector_um={
            axis: _um(float(np.sqrt(max(v, 0.0))))
            for axis, v in zip(AXES, np.diag(error.covariance[index]), strict=True)
        },
        covariance_um2=error.covariance[index] / MICROMETRE.factor**2,
        by_parameter_um=by_parameter_um,
    )


def _pose(mapped: VolumetricMap, number: int) -> PoseError:
    each = mapped.points ** len(mapped.ranges)
    lengths = mapped.error.lengths[number * each : (number + 1) * each]
    readings = _at(mapped.errors.chain, mapped.poses[number])
    return PoseError(
        at={name: value for name, value in readings.items() if name.endswith("_deg")},
        worst_um=_um(float(lengths.max())),
        rms_um=_um(float(np.sqrt(np.mean(lengths**2)))),
    )


def _slices(mapped: VolumetricMap, k: float) -> tuple[Slice, ...]:
    """The middle of the map for the page of a health report; empty where there is nothing to draw."""
    try:
        drawn = at_pose(mapped)
    except InputError:
        return ()
    return tuple(slices_of(drawn.readings_mm, drawn.vectors_um, k * drawn.u_um, drawn.axes))
