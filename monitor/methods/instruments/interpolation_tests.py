"""Which rows are tests of rotary axes that linear ones follow (ISO 10791-6), and their rows as the standard wants them.

The tool point stays at a point of the work, or goes around it in a circle, while rotary and linear axes move together.
Where one rotary axis turns, readings are taken along the machine's axes and along the radial, tangential and axial
direction of that axis (tests AK1, AK2, BK1, BK2, CK1, CK2); where two turn at once, along the machine's axes, or by a
bar that goes around a circle, the path of a cone frustum (AK4, BK4, CK4). No text of the standard was at hand: the
tests are as others describe them, G. Florussen and others BK1, BK2 and BK4 by a sphere and sensors (Int. J. Automation
Technol. 14 (2020)), N. Kato and others the cone frustum by a ball bar (Int. J. Mach. Tools Manuf. 64 (2013) 1).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from monitor.machine import evaluate, orientation
from monitor.methods.instruments.part import Part
from monitor.methods.instruments.problem import InstrumentProblem
from monitor.methods.instruments.reading import direction_of
from monitor.methods.instruments.readings.component import Component
from monitor.methods.instruments.readings.distance import DistanceReading
from monitor.methods.instruments.readings.vector import VectorReading
from monitor.methods.standard_test import CircleTest, InterpolationTest
from monitor.records import Array

#: Joints that move by less than this stand still, mm and rad.
STILL_MM, STILL_RAD = 1e-3, 1e-6
#: Fewer readings than this are no path.
FEWEST = 8
#: A tool point that a machine without errors keeps to so much of one place on the work follows it, mm.
FOLLOWS = 0.1
#: A sphere nearer to the axis than this has no radial direction, mm.
LEAST_RADIUS = 1.0
#: A sensor or bar within 18 degrees of a direction reads along it (cosine 0.95); one that turns by less than that keeps
#: its direction.
ALONG = 0.95
_PLANES = ((1, 2), (2, 0), (0, 1))


@dataclass(frozen=True)
class _Path:
    """The rows ``at`` (m,) of a setup in one run in which the joints ``rotary``, the one that turns most first, and
    ``linear`` move together."""

    part: Part
    at: npt.NDArray[np.int64]
    rotary: tuple[int, ...]
    linear: tuple[int, ...]

    @cached_property
    def positions(self) -> Array:
        """Positions (m, J)."""
        return np.asarray(self.part.rows.positions[self.at])

    @cached_property
    def _none(self) -> Array:
        return np.zeros((len(self.at), len(self.part.rows.chain.joints), 2, 6))

    @cached_property
    def _nominal(self) -> tuple[Array, Array, Array, Array]:
        """Vectors r (m, 3) of a machine without errors, how they move (m, 3) with the first rotary joint, the work side
        (m, 3, 3) in the bed's frame and the tool side in that of the work."""
        chain, start = self.part.rows.chain, self.part.reading.start(1)
        every = np.zeros(len(self.part.rows), dtype=np.int64)
        work, tool = self.part.reading.ends(start[every], self.part.rows)
        pose = evaluate(chain, self.positions, self._none, work[self.at], tool[self.at], jacobian=True)
        sides = orientation(chain, self.positions, self._none)
        assert pose.by_error is not None
        first = self.rotary[0]
        moved = pose.by_error[:, :, first, 1, 3:] @ np.array(chain.joints[first].direction)
        return pose.residual, moved, sides.work, np.swapaxes(sides.work, 1, 2) @ sides.tool

    @property
    def nominal(self) -> Array:
        """The vector r (m, 3) mm of a machine without errors, in the frame of the last work axis."""
        return self._nominal[0]

    @cached_property
    def directions(self) -> dict[str, Array]:
        """Unit vectors (m, 3) in the frame of the last work axis, by their names."""
        nominal, moved, work, _ = self._nominal
        named: dict[str, Array] = {}
        if len(self.rotary) == 1:
            named = self._about_axis(nominal, moved, work)
        return named | {name: work[:, axis, :] for axis, name in enumerate("XYZ")}

    def _about_axis(self, nominal: Array, moved: Array, work: Array) -> dict[str, Array]:
        """The axial, radial and tangential direction at the point that turns with the one rotary axis."""
        chain, first = self.part.rows.chain, self.rotary[0]
        sides = orientation(chain, self.positions, self._none, jacobian=True)
        assert sides.by_error is not None
        turns = sides.by_error[:, :, first, 1, 3:] @ np.array(chain.joints[first].direction)
        axial = np.einsum("nji,nj->ni", work, turns)
        on_work = first < len(chain.work)
        # The tool point at d from the axis moves by a x d against the work, and the other way where the work turns;
        # with the work it is the work point that turns.
        arm = np.cross(axial, moved) if on_work else np.cross(moved, axial)
        if on_work:
            arm = arm - (nominal - np.sum(nominal * axial, axis=1, keepdims=True) * axial)
        radius = np.linalg.norm(arm, axis=1, keepdims=True)
        if radius.min() < LEAST_RADIUS:
            return {"axial": axial}
        radial = arm / radius
        return {"radial": radial, "tangential": np.cross(axial, radial), "axial": axial}

    @property
    def keeps_to_a_point(self) -> bool:
        """Whether the tool point of a machine without errors stays where it is on the work."""
        return bool(np.ptp(self.nominal, axis=0).max() < FOLLOWS)

    @property
    def vectors(self) -> Array:
        """What a vector reading is off the first one (m, 3) mm where it is read, in the frame of the last work axis.

        The first one is zero of the sensors and place of the sphere: programs follow the point where it was met.
        """
        reading, measured = self.part.reading, self.part.rows.measured[self.at]
        off = measured - measured[0]
        if isinstance(reading, VectorReading) and reading.setup.frame == "tool":
            off = np.einsum("nij,nj->ni", self._nominal[3], off)
        return np.asarray(off)


def interpolation_tests(problem: InstrumentProblem) -> Iterator[InterpolationTest | CircleTest]:
    """Every test of rotary axes that linear ones follow, in the order of the setups and of measuring."""
    for part in problem.parts:
        if not isinstance(part.reading, (VectorReading, Component, DistanceReading)):
            continue
        for index in np.unique(part.rows.run):
            for path in _paths(part, np.flatnonzero(part.rows.run == index)):
                test = _test_of(path, int(problem.runs[index]), problem)
                if test is not None:
                    yield test


def _paths(part: Part, at: npt.NDArray[np.int64]) -> Iterator[_Path]:
    """The stretches of rows (m,) in which the same rotary axis turns, or all rows where several turn at once."""
    joints = part.rows.chain.joints
    step = np.abs(np.diff(part.rows.positions[at], axis=0))
    turns = [joint for joint, each in enumerate(joints) if each.kind == "rotary"]
    linear = [joint for joint, each in enumerate(joints) if each.kind == "linear"]
    moves = step[:, turns] > STILL_RAD
    if not moves.any():
        return
    if (moves.sum(axis=1) > 1).any():
        stretches = [np.arange(len(at))]
    else:
        which = np.where(moves.any(axis=1), moves.argmax(axis=1), -1)
        # A step without a turn belongs to the stretch before it.
        for row in range(1, len(which)):
            which[row] = which[row - 1] if which[row] < 0 else which[row]
        begins = np.flatnonzero(np.diff(which, prepend=which[0] - 1))
        ends = [*begins[1:].tolist(), len(which)]
        stretches = [np.arange(first, last + 1) for first, last in zip(begins.tolist(), ends, strict=True)]
    for stretch in stretches:
        moved = np.ptp(part.rows.positions[at[stretch]], axis=0)
        rotary = tuple(
            sorted((joint for joint in turns if moved[joint] > STILL_RAD), key=lambda joint: -moved[joint])
        )
        followers = tuple(joint for joint in linear if moved[joint] > STILL_MM)
        if len(stretch) >= FEWEST and rotary and followers:
            yield _Path(part, at[stretch], rotary, followers)


def _test_of(path: _Path, run: int, problem: InstrumentProblem) -> InterpolationTest | CircleTest | None:
    part, joints = path.part, path.part.rows.chain.joints
    u = float(np.sqrt(np.mean(problem.sigma[part.at[path.at], 0] ** 2)))
    deviations = _deviations(path)
    if not deviations:
        return _swing(path, part.reading, run, u) if isinstance(part.reading, DistanceReading) else None
    first = joints[path.rotary[0]]
    names = tuple(joints[joint].name for joint in (*path.rotary, *path.linear))
    return InterpolationTest(
        part.id, run, names, names[: len(path.rotary)], first.sign * path.positions[:, path.rotary[0]],
        deviations, u,
    )  # fmt: skip


def _deviations(path: _Path) -> Mapping[str, Array]:
    """Readings (m,) mm by the name of their direction; none where a bar goes around or the work is not followed."""
    reading, measured = path.part.reading, path.part.rows.measured[path.at]
    if isinstance(reading, DistanceReading):
        length = np.linalg.norm(path.nominal, axis=1)
        name = _name_of(path.nominal / np.maximum(length, 1e-12)[:, None], path.directions)
        return {} if name is None else {name: measured[:, 0]}
    if not path.keeps_to_a_point:
        return {}
    if isinstance(reading, VectorReading):
        vectors = path.vectors
        return {name: np.sum(vectors * along, axis=1) for name, along in path.directions.items()}
    assert isinstance(reading, Component)
    along = np.tile(direction_of(reading.setup), (len(measured), 1))
    return {_name_of(along, path.directions) or "of the sensor": measured[:, 0]}


def _name_of(along: Array, directions: Mapping[str, Array]) -> str | None:
    """The name of the direction along which unit vectors (m, 3) point in all rows; that of a bar that keeps another
    direction on the work, None where it goes around."""
    for name, towards in directions.items():
        if np.abs(np.sum(along * towards, axis=1)).min() > ALONG:
            return name
    middle = along.mean(axis=0)
    keeps = (along @ middle).min() > ALONG * np.linalg.norm(middle)
    return "of the bar" if keeps else None


def _swing(path: _Path, reading: DistanceReading, run: int, u: float) -> CircleTest | None:
    """The circle of a bar that goes around its work point; None where it goes around by less than half a turn.

    Bars that lean by the same angle everywhere lie on a cone: its axis is the normal of the plane through their ends,
    and a work point that is off adds a constant and one wave a turn, as in a plane.
    """
    assert reading.setup.length is not None  # the reader asks for it
    bars = path.nominal
    normal = np.linalg.svd(bars - bars.mean(axis=0))[2][2]
    main = int(np.abs(normal).argmax())
    normal = normal * np.sign(normal[main])
    first, second = _PLANES[main]
    along = np.eye(3)[first] - normal[first] * normal
    along /= np.linalg.norm(along)
    angle = np.arctan2(bars @ np.cross(normal, along), bars @ along)
    if np.ptp(np.unwrap(angle)) < np.pi:
        return None
    names = tuple(path.part.rows.chain.joints[joint].name for joint in (*path.rotary, *path.linear))
    plane = ("XYZ"[first], "XYZ"[second])
    return CircleTest(
        path.part.id, run, names, True, plane, angle, path.part.rows.measured[path.at, 0], reading.setup.length,
        u, reading.u_length,
    )  # fmt: skip
