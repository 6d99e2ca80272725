"""Which setups are tests that a standard evaluates, and their rows as the standard wants them.

A ``displacement`` along one linear axis is a test of positioning (ISO 230-2), along several at once a diagonal
(ISO 230-6); an ``angle`` about a rotary axis that moves alone is a test of positioning too. A ``distance`` swung by two
linear axes about a centre is a circular test (ISO 230-4). All other setups have no standard's figures here.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from monitor.machine import evaluate
from monitor.methods.chain.problem import ChainProblem
from monitor.methods.instruments.problem import InstrumentProblem, Part
from monitor.methods.instruments.reading import LEVER, direction_of
from monitor.methods.instruments.readings.angle import Angle
from monitor.methods.instruments.readings.displacement import Displacement
from monitor.methods.instruments.readings.distance import DistanceReading
from monitor.methods.method import AxisTest, CircleTest
from monitor.records import Array

#: An axis that moves by less than this part of the one that moves most stands still.
STILL = 1e-3
#: A beam that leads off its axis by more than this is a diagonal, or no test of an axis.
ALONG = 1e-2


def standard_tests(problem: ChainProblem) -> tuple[AxisTest | CircleTest, ...]:
    """The tests of every setup and run that a standard evaluates."""
    assert isinstance(problem, InstrumentProblem)
    return tuple(test for part in problem.parts for test in _tests_of(problem, part))


def _tests_of(problem: InstrumentProblem, part: Part) -> Iterator[AxisTest | CircleTest]:
    rows, reading = part.rows, part.reading
    sigma = problem.sigma[part.at, 0]
    for index in np.unique(rows.run):
        mine = rows.run == index
        run = int(problem.runs[index])
        moving = _moving(part, mine)
        kinds = {rows.chain.joints[joint].kind for joint in moving}
        names = tuple(rows.chain.joints[joint].name for joint in moving)
        positions, measured = rows.positions[mine], rows.measured[mine, 0]
        u = float(np.sqrt(np.mean(sigma[mine] ** 2)))
        if isinstance(reading, Displacement) and kinds == {"linear"}:
            nominal = _nominal(part, mine) @ direction_of(reading.setup)
            travel = nominal - nominal[0]
            place, sense = travel, 1.0
            if len(moving) == 1:
                place = rows.chain.joints[moving[0]].sign * positions[:, moving[0]]
                if abs(np.ptp(travel) / np.ptp(place) - 1.0) > ALONG:
                    continue
                # A deviation counts in the sense in which the reading of the axis grows.
                sense = float(np.sign((travel - travel.mean()) @ (place - place.mean())))
            beam = 0.0 if reading.holds("direction") else reading.beam**2
            yield AxisTest(part.id, run, names, place, sense * (measured - travel), u, beam, False)
        elif isinstance(reading, Angle) and kinds == {"rotary"} and len(moving) == 1:
            joint = rows.chain.joints[moving[0]]
            share = float(direction_of(reading.setup) @ np.array(joint.direction))
            if 1.0 - abs(share) > ALONG:
                continue
            # The work side turns the other way; the deviation is that of the axis in the sense of its own readings.
            on_work = moving[0] < len(rows.chain.work)
            sense = joint.sign * np.sign(share) * (-1.0 if on_work else 1.0)
            deviation = sense * measured / LEVER
            place = joint.sign * positions[:, moving[0]]
            yield AxisTest(part.id, run, names, place, deviation, u / LEVER, 0.0, True)
        elif isinstance(reading, DistanceReading) and kinds == {"linear"} and len(moving) == 2:
            arm = _nominal(part, mine) - np.array(reading.centre)
            along = [np.array(rows.chain.joints[joint].direction) for joint in moving]
            if any(1.0 - np.abs(way).max() > ALONG for way in along):
                continue
            first, second = _plane(along)
            angle = np.arctan2(arm[:, second], arm[:, first])
            bar = 0.0 if reading.holds("length") else (reading.setup.length_uncertainty or np.nan)
            assert reading.setup.length is not None
            yield CircleTest(
                part.id, run, ("XYZ"[first], "XYZ"[second]), angle, measured, reading.setup.length, u, bar
            )


def _moving(part: Part, mine: Array) -> list[int]:
    """The joints that move in these rows, in the order of the chain; those that move by rounding stand still."""
    size = np.ptp(part.rows.positions[mine], axis=0)
    linear = np.array([not joint.turns for joint in part.rows.chain.joints])
    largest = [float(size[group].max(initial=0.0)) for group in (linear, ~linear)]
    limits = np.where(linear, STILL * largest[0], STILL * largest[1])
    return [int(joint) for joint in np.flatnonzero((size > limits) & (size > 1e-9))]


def _nominal(part: Part, mine: Array) -> Array:
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
