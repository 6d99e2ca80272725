"""Which setups are tests that a standard evaluates, and their rows as the standard wants them.

A ``displacement`` along one linear axis is a test of positioning (ISO 230-2), along several at once a diagonal
(ISO 230-6); an ``angle`` about a rotary axis that moves alone is a test of positioning too. A ``distance`` swung by two
linear axes about a centre is a circular test (ISO 230-4). Tests of axes of rotation are in ``rotation_tests``
(ISO 230-7), those of rotary axes that linear ones follow in ``interpolation_tests`` (ISO 10791-6), parts that the
machine cut in ``part_tests`` (ISO 10791-7). All other setups have no standard's figures here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from monitor.machine import Joint, evaluate
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.interpolation_tests import interpolation_tests
from monitor.methods.instruments.part import Part, exact_scale_of
from monitor.methods.instruments.part_tests import part_tests
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.reading import LEVER, direction_of
from monitor.methods.instruments.readings.angle import Angle
from monitor.methods.instruments.readings.displacement import Displacement
from monitor.methods.instruments.readings.distance import DistanceReading
from monitor.methods.instruments.rotation_tests import rotation_tests
from monitor.methods.standard_test import AxisTest, CircleTest, StandardTestRows
from monitor.records import Array

#: An axis that moves by less than this part of the one that moves most stands still.
STILL = 1e-3
#: A beam that leads off its axis by more than this is a diagonal, or no test of an axis.
ALONG = 1e-2


def standard_tests(problem: ChainProblem) -> tuple[StandardTestRows, ...]:
    """The tests of every setup and run that a standard evaluates."""
    assert isinstance(problem, InstrumentProblem)
    of_setups = (test for part in problem.parts for test in _tests_of(problem, part))
    return (*of_setups, *rotation_tests(problem), *interpolation_tests(problem), *part_tests(problem))


def _tests_of(problem: InstrumentProblem, part: Part) -> Iterator[AxisTest | CircleTest]:
    """The tests of one setup, one a run in which it is such a test."""
    for index in np.unique(part.rows.run):
        mine = part.rows.run == index
        u = float(np.sqrt(np.mean(problem.sigma[part.at, 0][mine] ** 2)))
        measured = _Measured(part, mine, int(problem.runs[index]), _moving(part, mine), u)
        kinds = {part.rows.chain.joints[joint].kind for joint in measured.moving}
        test: AxisTest | CircleTest | None = None
        if isinstance(part.reading, Displacement) and kinds == {"linear"}:
            test = _travel(measured, part.reading)
        elif isinstance(part.reading, Angle) and kinds == {"rotary"} and len(measured.moving) == 1:
            test = _turn(measured, part.reading)
        elif isinstance(part.reading, DistanceReading) and kinds == {"linear"} and len(measured.moving) == 2:
            test = _circle(measured, part.reading)
        if test is not None:
            yield test


@dataclass(frozen=True)
class _Measured:
    """The rows ``mine`` (m,) of a setup in one run, the joints that move in them, and u of a reading in mm."""

    part: Part
    mine: npt.NDArray[np.bool_]
    run: int
    moving: list[int]
    u: float

    @property
    def joints(self) -> list[Joint]:
        """The joints that move."""
        return [self.part.rows.chain.joints[joint] for joint in self.moving]

    @property
    def values(self) -> Array:
        """The readings (k,) in mm."""
        return np.asarray(self.part.rows.measured[self.mine, 0])

    @property
    def axis_reading(self) -> Array:
        """Where the first joint that moves stands (k,), by its own reading."""
        return np.asarray(self.joints[0].sign * self.part.rows.positions[self.mine, self.moving[0]])


def _travel(measured: _Measured, reading: Displacement) -> AxisTest | None:
    nominal = _nominal(measured.part, measured.mine) @ direction_of(reading.setup)
    travel = nominal - nominal[0]
    position, sense = travel, 1.0
    if len(measured.moving) == 1:
        position = measured.axis_reading
        if abs(np.ptp(travel) / np.ptp(position) - 1.0) > ALONG:
            return None
        # A deviation counts in the sense in which the reading of the axis grows.
        sense = float(np.sign((travel - travel.mean()) @ (position - position.mean())))
    beam = 0.0 if reading.holds("direction") else reading.beam**2
    names = tuple(joint.name for joint in measured.joints)
    deviation = sense * (measured.values - travel)
    gain = float(np.hypot(beam, measured.part.scale or 0.0))
    return AxisTest(
        measured.part.id, measured.run, names, position, deviation, measured.u, gain, False,
        exact_scale_of(reading.setup),
    )  # fmt: skip


def _turn(measured: _Measured, reading: Angle) -> AxisTest | None:
    (joint,) = measured.joints
    share = float(direction_of(reading.setup) @ np.array(joint.direction))
    if 1.0 - abs(share) > ALONG:
        return None
    # The work side turns the other way; the deviation is that of the axis in the sense of its own readings.
    on_work = measured.moving[0] < len(measured.part.rows.chain.work)
    sense = joint.sign * np.sign(share) * (-1.0 if on_work else 1.0)
    deviation = sense * measured.values / LEVER
    u = measured.u / LEVER
    return AxisTest(
        measured.part.id, measured.run, (joint.name,), measured.axis_reading, deviation, u, 0.0, True, ""
    )


def _circle(measured: _Measured, reading: DistanceReading) -> CircleTest | None:
    assert reading.setup.length is not None  # the reader asks for it
    along = [np.array(joint.direction) for joint in measured.joints]
    if any(1.0 - np.abs(way).max() > ALONG for way in along):
        return None
    arm = _nominal(measured.part, measured.mine) - np.array(reading.centre)
    first, second = _plane(along)
    angle = np.arctan2(arm[:, second], arm[:, first])
    plane = ("XYZ"[first], "XYZ"[second])
    names = tuple(joint.name for joint in measured.joints)
    return CircleTest(
        measured.part.id, measured.run, names, False, plane, angle, measured.values, reading.setup.length,
        measured.u, reading.u_length,
    )  # fmt: skip


def _moving(part: Part, mine: npt.NDArray[np.bool_]) -> list[int]:
    """The joints that move in these rows, in the order of the chain; those that move by rounding stand still."""
    size = np.ptp(part.rows.positions[mine], axis=0)
    linear = np.array([not joint.turns for joint in part.rows.chain.joints])
    largest = [float(size[group].max(initial=0.0)) for group in (linear, ~linear)]
    limits = np.where(linear, STILL * largest[0], STILL * largest[1])
    return [int(joint) for joint in np.flatnonzero((size > limits) & (size > 1e-9))]


def _nominal(part: Part, mine: npt.NDArray[np.bool_]) -> Array:
    """Where the tool point of a machine without errors stands (m, 3) mm, seen from the work side."""
    rows, count = part.rows, int(np.count_nonzero(mine))
    none = np.zeros((count, len(rows.chain.joints), 2, 6))
    start = part.reading.start(1)[np.zeros(len(rows), dtype=np.int64)]
    _, tool = part.reading.ends(start, rows)
    return evaluate(rows.chain, rows.positions[mine], none, np.zeros((count, 3)), tool[mine]).residual


def _plane(along: list[Array]) -> tuple[int, int]:
    """The two axes of a plane in cyclic order: XY, YZ, ZX."""
    pair = {int(np.abs(way).argmax()) for way in along}
    return {frozenset((0, 1)): (0, 1), frozenset((1, 2)): (1, 2), frozenset((0, 2)): (2, 0)}[frozenset(pair)]
