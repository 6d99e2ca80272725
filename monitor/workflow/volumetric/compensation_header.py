"""Lines above a compensation table: of which machine it is, what is added to what, and what is not in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from monitor.effects.joint_error import JointError
from monitor.effects.shapes import Reversal
from monitor.units import DEGREE, MICROMETRE, MICRORADIAN
from monitor.workflow.models import label
from monitor.workflow.volumetric.error_map import VolumetricMap


def positioning_header(mapped: VolumetricMap, remaining: Mapping[int, float], turns: bool) -> list[str]:
    """The lines above the tables of linear axes, or of the rotary ones.

    ``remaining`` is what straight lines between the rows leave at most, mm or rad, by the index of the axis.
    """
    unit, small = ("deg", "urad") if turns else ("mm", "um")
    correction = "correction_deg" if turns else "correction_um"
    example = "-0.0010 deg at 90 deg: send 89.9990 deg" if turns else "-5.0 um at 100 mm: send 99.9950 mm"
    return [
        *_origin(mapped),
        f"ADD {correction} to the commanded reading reading_{unit} of the same axis ({example}).",
        f"error_{small} is the actual less the commanded reading of the axis; the correction is -error. Both are of",
        "the reading as the control shows it: the axis's sign and its side of the bed are in already.",
        "A control that subtracts its table takes the error instead.",
        "Only the errors of each axis along itself are in this table.",
        "Use it or the volumetric table of the run, not both.",
        *_circumstances(mapped),
        f"Between two rows: a straight line, which leaves at most {_left(mapped, remaining, turns)}.",
        *_reversals(mapped, list(remaining)),
    ]


def volumetric_header(mapped: VolumetricMap) -> list[str]:
    """The lines above the table of the volumetric error."""
    joints = mapped.errors.chain.joints
    linear = [joint.name for joint in joints if not joint.turns]
    turning = [joint.name for joint in joints if joint.kind == "rotary"]
    added = ", ".join(f"correction_{name.lower()}_um to the reading {name.lower()}_mm" for name in linear)
    held = f"; {' and '.join(turning)} stay at the commanded reading" if turning else ""
    return [
        *_origin(mapped),
        f"ADD to the commanded readings of the same row, all together: {added}{held}.",
        "The corrections are of readings as the control shows them: each axis's sign, its side of the bed and the turn",
        "of the rotary axes are in already.",
        "error_x_um, error_y_um, error_z_um: where the tip is less where it should be, relative to the workpiece,",
        "along X, Y, Z of the machine. DO NOT add these, nor their negatives, to readings: an axis that carries the",
        "workpiece may move it the other way.",
        "The place of the tip is corrected, the direction of the tool is not.",
        *_tool(mapped),
        "not_corrected_um is what no linear axis can move.",
        "The positioning errors of the axes are in this table.",
        "Use it or the positioning table of the run, not both.",
        _zero(mapped),
        *_circumstances(mapped),
    ]


def _left(mapped: VolumetricMap, remaining: Mapping[int, float], turns: bool) -> str:
    unit, small = (MICRORADIAN, "urad") if turns else (MICROMETRE, "um")
    joints = mapped.errors.chain.joints
    return ", ".join(
        f"{max(unit.to_display(size), 0.01):.2f} {small} ({joints[axis].name})"
        for axis, size in remaining.items()
    )


def _origin(mapped: VolumetricMap) -> Iterator[str]:
    evaluated = mapped.evaluated
    campaign = evaluated.campaign
    yield (
        f"machine {campaign.machine.id}, {mapped.errors.chain.topology}; campaign {campaign.name}, "
        f"run {evaluated.run}, model {label(evaluated.model)}"
    )


def _tool(mapped: VolumetricMap) -> Iterator[str]:
    """Lines on the tool for which the rows hold: angular errors act with its length."""
    x, y, z = (float(value) + 0.0 for value in mapped.errors.tip)
    yield f"The rows hold for a tool whose tip stands at x {x:.3f}, y {y:.3f}, z {z:.3f} mm in the frame of the"
    yield "spindle, as the stylus of the probing did. Squareness, tilts and angular errors act with the length of"
    yield "the tool: another tool needs a table of its own, or an error of 1 um remains for every 100 mm and 10 urad."


def _zero(mapped: VolumetricMap) -> str:
    if mapped.error.datum is None:
        return "Absolute: the workpiece's zero is where the axes say; offsets of axes appear whole."
    at = ", ".join(
        f"{joint.name} {joint.sign * (DEGREE.to_display(position) if joint.turns else position) + 0.0:.4f}"
        f"{' deg' if joint.turns else ' mm'}"
        for joint, position in zip(mapped.errors.chain.joints, map(float, mapped.error.datum), strict=True)
        if joint.kind != "spindle"
    )
    return f"The workpiece's zero is set at {at}, where all corrections are zero."


def _circumstances(mapped: VolumetricMap) -> Iterator[str]:
    yield "Every point is approached towards growing readings of all axes; what depends on a temperature or a time"
    yield "is taken at the mean of the run."


def _reversals(mapped: VolumetricMap, axes: list[int]) -> Iterator[str]:
    """A line for every axis whose own reversal is known: approached the other way it stands elsewhere by that value."""
    errors = mapped.errors
    first = 0
    for effect in errors.effects:
        amplitude = float(errors.estimate[first])
        first += len(effect.parameters(errors.context))
        drive = JointError(effect.term, effect.joint).is_of_drive
        if (
            effect.term.joint in axes
            and drive
            and isinstance(effect.shape, Reversal)
            and not effect.driver_text
        ):
            unit, small = (MICRORADIAN, "urad") if effect.joint.turns else (MICROMETRE, "um")
            value = unit.to_display(2.0 * amplitude)
            yield f"{effect.joint.name}: reversal value {value:.2f} {small} (ISO 230-2). Approached towards falling"
            yield f"readings its error is the printed one less {value:.2f} {small}; a control that compensates the"
            yield f"backlash itself takes the printed error less {value / 2:.2f} {small}, the mean of both directions."
