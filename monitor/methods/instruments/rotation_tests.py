"""Which setups are tests of an axis of rotation (ISO 230-7), and their rows as the standard wants them.

One rotary axis or spindle turns, nothing else moves, and sensors that do not turn look at a sphere that does: a
``vector`` in the frame of the side that stands still, or a ``component`` where the tool turns. Two spheres at two
heights on the axis show its tilt.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from monitor.machine import Joint
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.readings.component import Component
from monitor.methods.instruments.readings.vector import VectorReading
from monitor.methods.standard_test import RotationTest
from monitor.records import Array

#: Joints that move by less than this stand still, mm and rad; directions agree to this part.
STILL_MM, STILL_RAD, ALONG = 1e-3, 1e-6, 1e-2
#: Two spheres nearer to each other along the axis than this show no tilt, mm.
LEAST_HEIGHT = 10.0


@dataclass(frozen=True)
class _Turned:
    """The rows of one setup and run around one axis: its ``angle`` (m,) by its own readings, ``deviation`` (m, 3) mm in
    the directions of the machine (NaN where none was read), where the sphere stands along the axis, u of a reading."""

    setup: str
    run: int
    joint: Joint
    angle: Array
    deviation: Array
    height: float
    u: float


def rotation_tests(problem: InstrumentProblem) -> Iterator[RotationTest]:
    """Every radial and axial error motion of a setup, and every tilt of two setups of one run."""
    turned = [each for part in problem.parts for each in _turned(problem, part)]
    for each in turned:
        for axis in range(3):
            if np.isfinite(each.deviation[:, axis]).all():
                yield RotationTest(
                    each.setup, each.run, each.joint.name, f"E{'XYZ'[axis]}{each.joint.name}", each.angle,
                    each.deviation[:, axis], axis != each.joint.main, each.u, False,
                )  # fmt: skip
    for first, second in combinations(turned, 2):
        yield from _tilts(first, second)


def _turned(problem: InstrumentProblem, part: Part) -> Iterator[_Turned]:
    """The rows of a setup, one a run in which it is such a test."""
    chain, positions = part.rows.chain, part.rows.positions
    for index in np.unique(part.rows.run):
        mine = part.rows.run == index
        size = np.ptp(positions[mine], axis=0)
        moving = [
            joint
            for joint, by in enumerate(size)
            if by > (STILL_RAD if chain.joints[joint].turns else STILL_MM)
        ]
        others = [
            joint for joint in range(len(chain.joints)) if chain.joints[joint].turns and joint not in moving
        ]
        if len(moving) != 1 or not chain.joints[moving[0]].turns:
            continue
        joint = chain.joints[moving[0]]
        if np.abs(positions[mine][:, others]).max(initial=0.0) > STILL_RAD or not _is_main(joint):
            continue
        deviation = _deviation(part, on_work=moving[0] < len(chain.work))
        if deviation is None:
            continue
        setup = part.reading.setup  # type: ignore[attr-defined]
        point = setup.work_point if moving[0] < len(chain.work) else setup.tool_point
        yield _Turned(
            part.id,
            int(problem.runs[index]),
            joint,
            joint.sign * positions[mine, moving[0]],
            deviation[mine],
            float(point[joint.main]),
            float(np.sqrt(np.mean(problem.sigma[part.at, 0][mine] ** 2))),
        )


def _is_main(joint: Joint) -> bool:
    """Whether an axis lies along a direction of the machine."""
    return 1.0 - abs(joint.direction[joint.main]) < ALONG


def _deviation(part: Part, *, on_work: bool) -> Array | None:
    """What was read (m, 3) mm in the directions of the machine; None where the sensors turn with the axis."""
    reading, measured = part.reading, part.rows.measured
    if isinstance(reading, VectorReading):
        return measured if reading.setup.frame == ("tool" if on_work else "work") else None
    if isinstance(reading, Component) and not on_work:
        assert reading.setup.direction is not None  # the reader asks for it
        along = int(np.abs(reading.setup.direction).argmax())
        if 1.0 - abs(reading.setup.direction[along]) > ALONG:
            return None
        deviation = np.full((len(measured), 3), np.nan)
        deviation[:, along] = measured[:, 0]
        return deviation
    return None


def _tilts(first: _Turned, second: _Turned) -> Iterator[RotationTest]:
    """The tilts about the two directions across the axis, from spheres at two heights at the same angles."""
    height = second.height - first.height
    same = (first.run, first.joint.name) == (second.run, second.joint.name)
    if not same or abs(height) < LEAST_HEIGHT or first.angle.shape != second.angle.shape:
        return
    if not np.allclose(first.angle, second.angle, rtol=0.0, atol=STILL_RAD):
        return
    main = first.joint.main
    along: Sequence[float] = np.eye(3)[main]
    apart = (second.deviation - first.deviation) / height
    # A turn t moves the point at a height h along the axis by t x h a: t = a x d / h.
    tilt = np.cross(along, apart)
    u = float(np.hypot(first.u, second.u)) / abs(height)
    for axis in range(3):
        if axis != main and np.isfinite(tilt[:, axis]).all():
            yield RotationTest(
                f"{first.setup}, {second.setup}", first.run, first.joint.name, f"E{'ABC'[axis]}{first.joint.name}",
                first.angle, tilt[:, axis], True, u, True,
            )  # fmt: skip
