"""Readings, targets and runs that are off, in the answer of `explain`."""

from __future__ import annotations

from collections.abc import Sequence

from monitor.discovery import Explanation
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.methods.chain.problem import ChainProblem
from monitor.records import FrameKind, FrameOfReference
from monitor.reporting.frames import frame_words
from monitor.reporting.machine_finding import OffTarget
from monitor.units import MICROMETRE, MICRORADIAN
from monitor.workflow.explain.explain_answer import (
    BadProbing,
    ScatteringTarget,
    TargetOffInPlaces,
    UnlikeRun,
)

#: The numbers of a residual that is a vector.
COORDINATES = ("x", "y", "z")


def left_out(points: Sequence[BadPoint], problem: ChainProblem) -> tuple[BadProbing, ...]:
    """Readings that were left out."""
    um = MICROMETRE.to_display
    return tuple(
        BadProbing(
            point.run,
            point.sequence,
            point.target,
            point.axis,
            um(point.size),
            point.p_value,
            None if point.turn is None else MICRORADIAN.to_display(point.turn),
            frame_of_point(point, problem),
        )
        for point in points
    )


def frame_of_point(point: BadPoint, problem: ChainProblem) -> str | None:
    """Whose frame x, y or z of a bad point is of, in words, where that is not the machine's."""
    instruments = problem.context.instruments
    if point.axis not in COORDINATES or instruments is None:
        return None
    if point.frame is not None:
        return frame_words(FrameOfReference(FrameKind.OWN_AXIS, point.frame))
    setup = instruments.setups[instruments.setup[point.row]]
    return f"setup {setup.id}" if setup.has_own_frame else None


def targets_off(explanation: Explanation) -> tuple[TargetOffInPlaces, ...]:
    """The targets that are off alike in all places."""
    answers = []
    for each in explanation.off_targets:
        x, y, z, size = (MICROMETRE.to_display(value) for value in (*each.off, each.size))
        readings, p_value = len(each.point.rows), each.point.p_value
        answers.append(
            TargetOffInPlaces(each.target, x, y, z, size, each.places, each.runs, readings, p_value)
        )
    return tuple(answers)


def said_off(targets: Sequence[TargetOffInPlaces], word: str) -> tuple[OffTarget, ...]:
    """The targets that are off alike in all places, as sentences say them."""
    return tuple(
        OffTarget(
            word,
            each.target,
            each.size_um,
            f"x {each.x_um:+.1f}, y {each.y_um:+.1f}, z {each.z_um:+.1f} µm on the piece",
            each.places,
        )
        for each in targets
    )


def unlike(explanation: Explanation) -> tuple[UnlikeRun, ...]:
    """The runs that leave more than the others."""
    return tuple(
        UnlikeRun(
            each.run,
            each.times,
            MICROMETRE.to_display(each.deviation),
            each.neighbours,
            each.p_value,
            each.as_if,
        )
        for each in explanation.apart
    )


def scattering_targets(explanation: Explanation) -> tuple[ScatteringTarget, ...]:
    """The targets that scatter more than the others."""
    return tuple(
        ScatteringTarget(
            each.target, each.times, MICROMETRE.to_display(each.deviation), each.touches, each.p_value
        )
        for each in explanation.scatter
    )
