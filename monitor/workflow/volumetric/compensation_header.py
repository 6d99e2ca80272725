"""What the lines above a compensation table state of the map: its origin, its axes, its tool and its zero."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from monitor.effects.joint_error import JointError
from monitor.effects.shapes import Reversal
from monitor.reporting.between_points import StepPlace
from monitor.reporting.compensation_lines import AxisValue, TableOrigin, positioning_lines, volumetric_lines
from monitor.workflow.models import label
from monitor.workflow.volumetric.between_points import between_points, step_places
from monitor.workflow.volumetric.error_map import VolumetricMap


def positioning_header(
    mapped: VolumetricMap, remaining: Mapping[int, float], jumps: Mapping[int, int], turns: bool
) -> list[str]:
    """The lines above the tables of linear axes, or of the rotary ones.

    ``remaining`` is what straight lines between the rows leave at most, mm or rad, ``jumps`` how many jumps have a
    row on either side, by the index of the axis.
    """
    joints = mapped.errors.chain.joints
    by_name = {joints[axis].name: size for axis, size in remaining.items()}
    jumping = {joints[axis].name: count for axis, count in jumps.items()}
    return positioning_lines(
        _origin(mapped),
        turns,
        by_name,
        jumping,
        list(_reversals(mapped, list(remaining))),
        _own_steps(mapped),
    )


def volumetric_header(mapped: VolumetricMap) -> list[str]:
    """The lines above the table of the volumetric error."""
    joints = mapped.errors.chain.joints
    x, y, z = (float(value) + 0.0 for value in mapped.errors.tip)
    datum = mapped.error.datum
    return volumetric_lines(
        _origin(mapped),
        [joint.name for joint in joints if not joint.turns],
        [joint.name for joint in joints if joint.kind == "rotary"],
        (x, y, z),
        None
        if datum is None
        else [
            AxisValue(joint.name, joint.sign * position + 0.0, joint.turns)
            for joint, position in zip(joints, map(float, datum), strict=True)
            if joint.kind != "spindle"
        ],
        (*between_points(mapped), *step_places(mapped)),
    )


def _origin(mapped: VolumetricMap) -> TableOrigin:
    evaluated = mapped.evaluated
    campaign = evaluated.campaign
    topology = mapped.errors.chain.topology
    return TableOrigin(campaign.machine.id, topology, campaign.name, evaluated.run, label(evaluated.model))


def _reversals(mapped: VolumetricMap, axes: list[int]) -> Iterator[AxisValue]:
    """The reversal value of every axis whose own reversal is known."""
    errors = mapped.errors
    first = 0
    for effect in errors.effects:
        amplitude = float(errors.estimate[first])
        first += len(effect.parameters(errors.context))
        is_of_axis = effect.term.joint in axes and JointError(effect.term, effect.joint).is_of_drive
        if is_of_axis and isinstance(effect.shape, Reversal) and not effect.driver_text:
            yield AxisValue(effect.joint.name, 2.0 * amplitude, effect.joint.turns)


def _own_steps(mapped: VolumetricMap) -> list[StepPlace]:
    """The steps of the axes along themselves; a positioning table takes off no error at a workpiece's zero."""
    of_drives = {
        name
        for effect in mapped.errors.effects
        if JointError(effect.term, effect.joint).is_of_drive
        for name in effect.parameters(mapped.errors.context)
    }
    return [replace(step, zero_between=False) for step in step_places(mapped) if step.parameter in of_drives]
