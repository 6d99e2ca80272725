"""What could be measured next: tests of instruments within the strokes of a machine, each a setup and its poses.

A test is what people do with such an instrument: a laser, a square or a level along one axis with the others at the
ends or in the middle of their strokes, a ball bar around a circle of two axes or beside a rotary axis, an R-test around
a rotary axis (ISO 230-1:2012, 230-2, 230-4, 10791-6). Use ``forecast`` for what they would say.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from monitor.exceptions import DataError
from monitor.machine import Chain, evaluate, orientation, touching_positions
from monitor.records import Array, Setup, Vector
from monitor.units import METRE, MICROMETRE, MICRORADIAN

#: Stops of a linear sweep (ISO 230-2:2014, 4.3.2 asks for five a metre at least), angles of a turn and of a circle.
STOPS, TURNS, CIRCLE = 11, 12, 36
#: The directions of an axis and an instrument are the same, or across each other, within this part.
ALONG, ACROSS = 0.99, 0.1
#: A sphere of an R-test stands at its place and this much higher, mm.
HIGHER = 200.0
LETTERS: dict[str, Vector] = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class CandidateTest:
    """A test that could be made: its ``setup``, the ``positions`` (m, J) of the axes, and whether the campaign has the
    instrument already."""

    setup: Setup
    positions: Array
    available: bool


def usual_instruments(tool_point: Vector) -> tuple[Setup, ...]:
    """Instruments that many shops have, with uncertainties of the size that their makers state."""

    def lengths(name: str, reading: str, u_um: float, instrument: str) -> Setup:
        return Setup(name, reading, MICROMETRE.to_internal(u_um), instrument, tool_point)

    setups = [
        replace(
            lengths(f"usual-laser-{letter}", "displacement", 0.3, "laser interferometer"),
            direction=way,
            direction_uncertainty=MICRORADIAN.to_internal(200.0),
            scale_uncertainty=MICROMETRE.per(METRE).to_internal(0.5),
        )
        for letter, way in LETTERS.items()
    ]
    setups += [
        replace(lengths(f"usual-square-{letter}", "component", 1.0, "dial on a square"), direction=way)
        for letter, way in LETTERS.items()
    ]
    setups += [
        Setup(f"usual-{kind}-{letter}", kind, MICRORADIAN.to_internal(u_urad), name, direction=way)
        for kind, u_urad, name, letters in (
            ("angle", 1.0, "angular laser", "XYZ"),
            ("level", 2.0, "electronic level", "XY"),
        )
        for letter, way in LETTERS.items()
        if letter in letters
    ]
    bar = replace(lengths("usual-bar", "distance", 0.5, "ball bar"), work_point=(100.0, 0.0, 50.0))
    nest = replace(lengths("usual-r-test", "vector", 0.5, "R-test"), work_point=(100.0, 0.0, 50.0))
    return (*setups, replace(bar, length=150.0, length_uncertainty=MICROMETRE.to_internal(0.5)), nest)


class Workspace:
    """Where the axes of a chain may stand: ``limits`` of every joint by its name, mm and rad."""

    def __init__(self, chain: Chain, limits: Mapping[str, tuple[float, float]]) -> None:
        self.chain = chain
        self.limits = np.array([limits[joint.name] for joint in chain.joints])
        self.linear = [index for index, joint in enumerate(chain.joints) if not joint.turns]
        self.rotary = [index for index, joint in enumerate(chain.joints) if joint.turns]
        self.rest = np.where([joint.turns for joint in chain.joints], 0.0, self.limits.mean(axis=1))

    def tests(self, setups: Sequence[Setup], *, available: bool) -> Iterator[CandidateTest]:
        """Every test of setups whose kind has some; what one instrument does in several setups is named once."""
        distinct = {_apart_from_place(setup): setup for setup in reversed(setups)}
        for setup in reversed(distinct.values()):
            for placed, positions in self._placed(setup):
                yield CandidateTest(placed, positions, available)

    def _placed(self, setup: Setup) -> Iterator[tuple[Setup, Array]]:
        if setup.reading == "distance":
            yield from self._bars(setup)
        elif setup.reading == "vector":
            for lift in (0.0, HIGHER):
                x, y, z = setup.work_point
                higher = replace(setup, work_point=(x, y, z + lift))
                turns = [self.turn(joint) for joint in self.rotary] + self._grid()
                yield from ((higher, way) for way in self._followed(higher, turns, np.zeros(3)))
        else:
            yield from ((setup, positions) for positions in self._paths(setup))

    def _paths(self, setup: Setup) -> Iterator[Array]:
        """The paths (m, J) of a kind that reads along a line, about an axis, or anywhere."""
        if setup.reading in ("displacement", "component", "offset"):
            yield from self._lines(setup)
        elif setup.reading in ("angle", "level"):
            yield from (self._sweep(joint, self.rest) for joint in self.linear)
            dots = self._dots(setup)
            about = [joint for joint in self.rotary if setup.reading == "level" or dots[joint] > ALONG]
            yield from map(self.turn, about)
        elif setup.reading in ("direction", "point"):
            paths = [self.turn(joint) for joint in self.rotary] + self._grid()
            if setup.reading == "point" and self.linear:
                paths += [self._product([(joint, 3) for joint in self.linear])]
            if paths:
                yield np.concatenate(paths)

    def _lines(self, setup: Setup) -> Iterator[Array]:
        """Sweeps along the direction of a beam (or a diagonal), across that of a dial, along that of a straightedge."""
        dots, names = self._dots(setup), [joint.name for joint in self.chain.joints]
        swept = {
            "displacement": [joint for joint in self.linear if dots[joint] > ALONG],
            "component": [joint for joint in self.linear if dots[joint] < ACROSS],
            "offset": [joint for joint in self.linear if names[joint] == setup.along],
        }[setup.reading]
        for joint in swept:
            yield from self.sweeps(joint)
        if setup.reading == "displacement" and not swept:
            yield from self._diagonal(np.array(setup.direction))

    def _dots(self, setup: Setup) -> list[float]:
        """How much every joint lies along the direction of a setup."""
        way = np.array(setup.direction or (0.0, 0.0, 0.0))
        return [abs(float(np.dot(joint.direction, way))) for joint in self.chain.joints]

    def sweeps(self, joint: int) -> Iterator[Array]:
        """A linear axis over its stroke, the other linear ones at the ends and all in the middle."""
        others = [other for other in self.linear if other != joint]
        for places in _corners(len(others)):
            stand = self.rest.copy()
            for other, part in zip(others, places, strict=True):
                stand[other] = self._at(other, part)
            yield self._sweep(joint, stand)

    def turn(self, joint: int) -> Array:
        """A rotary axis around, or over its stroke; the others at rest."""
        positions = np.tile(self.rest, (TURNS + 1, 1))
        positions[:, joint] = self._between(joint, TURNS + 1)
        return positions

    def _sweep(self, joint: int, stand: Array) -> Array:
        positions = np.tile(stand, (STOPS, 1))
        positions[:, joint] = self._between(joint, STOPS)
        return positions

    def _diagonal(self, way: Array) -> Iterator[Array]:
        """The longest travel through the middle along a direction that is no axis'."""
        parts = {
            joint: float(np.dot(self.chain.joints[joint].direction, way)) * (-1.0 if on_work else 1.0)
            for joint in self.linear
            for on_work in (joint < len(self.chain.work),)
        }
        spans = [np.ptp(self.limits[joint]) / 2.0 / abs(part) for joint, part in parts.items() if part]
        if len(spans) > 1:
            positions = np.tile(self.rest, (STOPS, 1))
            for joint, part in parts.items():
                positions[:, joint] += part * np.linspace(-min(spans), min(spans), STOPS)
            yield positions

    def _grid(self) -> list[Array]:
        """All rotary axes together, where there are several."""
        return [self._product([(joint, 4) for joint in self.rotary])] if len(self.rotary) > 1 else []

    def _product(self, counts: Sequence[tuple[int, int]]) -> Array:
        """Every combination of places of some joints, so many of each; the others at rest."""
        places = []
        for joint, count in counts:
            low, high = self.limits[joint]
            places.append(np.linspace(float(low), float(high), count, endpoint=joint in self.linear))
        grid = np.array(list(product(*places)))
        positions = np.tile(self.rest, (len(grid), 1))
        positions[:, [joint for joint, _ in counts]] = grid
        return positions

    def _bars(self, setup: Setup) -> Iterator[tuple[Setup, Array]]:
        """A bar around circles of two linear axes, and across every rotary axis that turns below it."""
        assert setup.length is not None  # the reader asks for it
        angle = np.linspace(0.0, 2.0 * np.pi, CIRCLE, endpoint=False)
        for first, second in combinations(self.linear, 2):
            ways = [np.array(self.chain.joints[joint].direction) for joint in (first, second)]
            arms = setup.length * (np.cos(angle)[:, None] * ways[0] + np.sin(angle)[:, None] * ways[1])
            for places in _corners(len(self.linear)):
                stand = self.rest.copy()
                for joint, part in zip(self.linear, places, strict=True):
                    low, high = self.limits[joint]
                    room = setup.length if joint in (first, second) else 0.0
                    stand[joint] = low + room + part * (high - low - 2.0 * room)
                centred = replace(setup, work_point=self._seen(stand, setup))
                turned = np.tile(stand, (CIRCLE, 1))
                yield from ((centred, way) for way in self._followed(centred, [turned], arms))
        for joint in self.rotary:
            turned = self.turn(joint)
            none = np.zeros((len(turned), len(self.chain.joints), 2, 6))
            sides = orientation(self.chain, turned, none)
            for way in np.eye(3):
                # Along the rotary axis the bar would keep one direction, which shows nothing of its centre.
                if abs(float(np.dot(way, self.chain.joints[joint].direction))) < ACROSS:
                    arms = setup.length * np.einsum("nji,j->ni", sides.work, way)
                    yield from ((setup, path) for path in self._followed(setup, [turned], arms))

    def _seen(self, stand: Array, setup: Setup) -> Vector:
        """Where the tool point stands at a pose, seen from the work side."""

        none = np.zeros((1, len(self.chain.joints), 2, 6))
        vector = evaluate(
            self.chain, stand[None], none, np.zeros((1, 3)), np.array(setup.tool_point)[None]
        ).residual[0]
        return (float(vector[0]), float(vector[1]), float(vector[2]))

    def _followed(self, setup: Setup, turned: Sequence[Array], arms: Array) -> Iterator[Array]:
        """Poses whose linear axes bring the tool point off the work point by ``arms``, where they reach."""
        for positions in turned:
            count = len(positions)
            target = np.array(setup.work_point) + np.broadcast_to(arms, (count, 3))
            none = np.zeros((count, len(self.chain.joints), 2, 6))
            try:
                reached = touching_positions(
                    self.chain, positions, none, target, np.tile(setup.tool_point, (count, 1))
                )
            except DataError:
                continue
            low, high = self.limits[self.linear].T
            stands = reached[:, self.linear]
            within = np.all((stands >= low - 1e-6) & (stands <= high + 1e-6), axis=1)
            if np.count_nonzero(within) >= TURNS // 2:
                yield reached[within]

    def _between(self, joint: int, count: int) -> Array:
        low, high = map(float, self.limits[joint])
        return np.linspace(low, high, count)

    def _at(self, joint: int, part: float) -> float:
        low, high = self.limits[joint]
        return float(low + part * (high - low))


def _corners(count: int) -> Iterator[tuple[float, ...]]:
    """The ends of so many strokes, and the middle of all."""
    yield (0.5,) * count
    if count:
        yield from product((0.0, 1.0), repeat=count)


def _apart_from_place(setup: Setup) -> Setup:
    """A setup without what tells it from another of the same instrument; a ball on the table keeps its place."""
    nameless = replace(setup, id="", instrument=None)
    return replace(nameless, work_point=(0.0, 0.0, 0.0)) if setup.reading == "distance" else nameless
