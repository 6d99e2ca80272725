"""The volumetric error that a certificate prints: the map of its run, as numbers to be kept with it."""

from __future__ import annotations

from monitor.discovery import fit
from monitor.methods import campaign_method
from monitor.records import Array
from monitor.reporting.certificate.volumetric_result import Length, Place, VolumetricResult
from monitor.reporting.refused import refusal_of
from monitor.units import DEGREE, MICROMETRE
from monitor.workflow.models import as_model
from monitor.workflow.uncertainty.stored import StatedUncertainty
from monitor.workflow.volumetric.between_points import between_points, step_places
from monitor.workflow.volumetric.error_map import VolumetricMap, at_pose, map_of


def volumetric_result(evaluated: StatedUncertainty, state: str) -> VolumetricResult:
    """The map of an evaluated run in display units. Raises InputError where not three linear axes moved."""
    problem = campaign_method(evaluated.campaign).problem_of(evaluated.campaign, as_model(evaluated.model))
    mapped = map_of(evaluated, fit(problem))
    drawn = at_pose(mapped)
    error, p = mapped.error, evaluated.answer.p
    k = error.factor(p)
    worst = error.worst
    return VolumetricResult(
        state=state,
        p=p,
        k=k,
        ranges=tuple((name, *ends) for name, ends in sorted(mapped.ranges.items())),
        from_strokes=mapped.from_strokes,
        each=mapped.points,
        poses=len(mapped.poses),
        points=len(error.lengths),
        datum=() if error.datum is None else _place(mapped, error.datum),
        largest=_length(
            float(error.lengths[worst]),
            float(error.u_lengths[worst]),
            k,
            _place(mapped, error.positions[worst]),
        ),
        mean=_length(*error.mean, k),
        rms=_length(*error.rms, k),
        left_out=tuple((name, refused.why) for name, refused in mapped.left_out.items()),
        left_out_refusals=tuple(map(refusal_of, mapped.left_out.values())),
        between_points=between_points(mapped) or None,
        step_places=step_places(mapped) or None,
        turns=any(joint.turns and joint.kind != "spindle" for joint in mapped.errors.chain.joints),
        axes=drawn.axes,
        readings_mm=drawn.readings_mm,
        vectors_um=drawn.vectors_um,
        expanded_um=k * drawn.u_um,
    )


def _length(value: float, u: float, k: float, at: Place = ()) -> Length:
    shown = MICROMETRE.to_display
    return Length(shown(value), shown(u), shown(k * u), at)


def _place(mapped: VolumetricMap, position: Array) -> Place:
    """Readings of a commanded point, without the spindle's angle."""
    return tuple(
        (
            joint.name,
            joint.sign * (DEGREE.to_display(float(value)) if joint.turns else float(value)) + 0.0,
            "°" if joint.turns else "mm",
        )
        for joint, value in zip(mapped.errors.chain.joints, position, strict=True)
        if joint.kind != "spindle"
    )
