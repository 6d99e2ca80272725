"""Machines of any order of axes, measured by laser, ball bar and R-test; without a line of the package.

A machine is a word such as ``w C b X Y Z B t``: axes from the workpiece over the bed (``b``) to the tool. Its location
errors, the zeros of its axes and its gains are given by their names; what the tool misses at any place is computed from
homogeneous matrices, one pose at a time, so that an answer can be asked what of it it holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from tests.simulator.four_instruments import Row
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

TOOL = np.array([0.0, 0.0, -150.0])
BAR, BAR_AT, BALL = 150.0, np.array([40.0, 60.0, -30.0]), np.array([90.0, 40.0, 30.0])
#: Standard uncertainties of a beam's and a bar's readings, of one sensor and of the bar's calibration, mm.
LASER, LENGTH, NEST, BAR_U = 3e-4, 5e-4, 5e-4, 3e-4
PLANES = {"xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}
HALF_STROKE = 200.0


def iso_errors(word: str) -> dict[str, str]:
    """The position and orientation errors that ISO 230-1 gives every axis of a machine, each with the axis.

    A linear axis has two tilts and its zero, a rotary axis two shifts, two tilts and its zero.
    """
    work, _, tool = word.removeprefix("w ").removesuffix(" t").partition("b")
    names = {}
    for axis in (*work.split(), *tool.split()):
        along = "XYZ".find(axis) if axis in "XYZ" else "ABC".find(axis)
        for number, letter in enumerate("XYZABC"):
            is_own = number % 3 == along
            if (axis in "XYZ" and (number < 3) == is_own) or (
                axis in "ABC" and ((number < 3) != is_own or (number >= 3))
            ):
                names[f"E{letter}0{axis}"] = axis
    return names


@dataclass(frozen=True)
class SerialMachine:
    """A machine ``word`` with its ``truth``: errors by name in mm and rad, gains (``EXX``) in mm/mm."""

    word: str
    truth: Mapping[str, float]

    @property
    def chain(self) -> SimulatedChain:
        """The axes with their errors; by ISO 841 those of the work side read the other way round."""
        work, _, tool = self.word.removeprefix("w ").removesuffix(" t").partition("b")
        return SimulatedChain(
            tuple(self._axis(name, 1) for name in tool.split()),
            work=tuple(self._axis(name, -1) for name in reversed(work.split())),
        )

    def _axis(self, name: str, sign: int) -> SimulatedAxis:
        kind = "linear" if name in "XYZ" else "rotary"
        way = np.eye(3)["XYZ".find(name) if kind == "linear" else "ABC".find(name)]
        gain = self.truth.get(f"E{name}{name}", 0.0)
        return SimulatedAxis(
            name,
            kind,
            (float(way[0]), float(way[1]), float(way[2])),
            sign=sign,
            errors=tuple(self.truth.get(f"E{letter}0{name}", 0.0) for letter in "XYZABC"),
            motion=(lambda q: [*(gain * q * way), 0.0, 0.0, 0.0]) if gain else None,
        )

    @property
    def rotary(self) -> list[str]:
        """The rotary axes."""
        return [axis.name for axis in self.chain.all_axes if axis.kind == "rotary"]

    def tip(self, readings: Mapping[str, float]) -> np.ndarray:
        """The tool point in the frame of the work."""
        frame = self.chain.seen(readings)
        return np.asarray(frame[:3, :3] @ TOOL + frame[:3, 3])

    def following(self, point: np.ndarray, **turns: float) -> dict[str, float]:
        """Readings that bring the tool point of a machine without errors to a point of the work."""
        ideal = SerialMachine(self.word, {})
        bare = {axis.name: 0.0 for axis in self.chain.all_axes} | turns
        slopes = np.column_stack([ideal.tip({**bare, name: 1.0}) - ideal.tip(bare) for name in "XYZ"])
        return {
            **bare,
            **dict(zip("XYZ", np.linalg.solve(slopes, point - ideal.tip(bare)).tolist(), strict=True)),
        }

    def missed(self, readings: Mapping[str, float], datum: Mapping[str, float]) -> np.ndarray:
        """By how much the tool point misses its place, mm along the machine's X, Y, Z, less what it missed where the
        zero of the workpiece was set."""
        ideal = SerialMachine(self.word, {})
        vector = self.tip(readings) - ideal.tip(readings) - (self.tip(datum) - ideal.tip(datum))
        turned = ideal.chain.side(ideal.chain.work, readings)[:3, :3]
        return np.asarray(turned @ vector)


def lasers(machine: SerialMachine, rng: np.random.Generator, noise: float = 1.0) -> tuple[str, list[Row]]:
    """Three axes there and back, the beam askew by some 0.2 mrad."""
    text, rows = "", []
    for number, name in enumerate("XYZ"):
        way = np.eye(3)[number]
        text += _setup(
            f"laser-{name}", "displacement", "laser interferometer", LASER, f'direction = "{name}"\n'
            'direction_standard_uncertainty_urad = 200.0\nknown = ["scale"]\n'
        )  # fmt: skip
        beam = way + rng.normal(0.0, 2e-4, 3) * (1.0 - way)
        beam /= np.linalg.norm(beam)
        stops = np.linspace(-HALF_STROKE, HALF_STROKE, 9)
        rest = machine.following(np.zeros(3) + TOOL)
        mine: list[float] = []
        for place in [*stops, *stops[::-1]]:
            readings = {**rest, name: float(place)}
            mine.append(float(machine.tip(readings) @ beam) + noise * rng.normal(0.0, LASER))
            rows.append({"setup": f"laser-{name}", **readings, "reading_um": 1e3 * (mine[-1] - mine[0])})
    return text, rows


def ball_bars(machine: SerialMachine, rng: np.random.Generator, noise: float = 1.0) -> tuple[str, list[Row]]:
    """Three planes."""
    text, rows = "", []
    length = BAR + noise * rng.normal(0.0, BAR_U)
    for name, (first, second) in PLANES.items():
        keys = f"work_point_mm = {BAR_AT.tolist()}\nlength_mm = {BAR}\n"
        text += _setup(
            f"bar-{name}", "distance", "ball bar", LENGTH,
            keys + f"length_standard_uncertainty_um = {1e3 * BAR_U:g}\n",
        )  # fmt: skip
        centre = BAR_AT + rng.normal(0.0, 0.02, 3)
        for angle in np.deg2rad(np.arange(0.0, 360.0, 10.0)):
            arm = np.zeros(3)
            arm[first], arm[second] = BAR * np.cos(angle), BAR * np.sin(angle)
            readings = machine.following(BAR_AT + arm)
            long = float(np.linalg.norm(machine.tip(readings) - centre)) - length
            rows.append(
                {
                    "setup": f"bar-{name}",
                    **readings,
                    "reading_um": 1e3 * (long + noise * rng.normal(0.0, LENGTH)),
                }
            )
    return text, rows


def r_tests(
    machine: SerialMachine, rng: np.random.Generator, noise: float = 1.0, axes: Sequence[str] | None = None
) -> tuple[str, list[Row]]:
    """A sphere on the table, followed while each rotary axis turns with the others at zero."""
    text, rows = "", []
    for axis in machine.rotary if axes is None else axes:
        keys = f"work_point_mm = {BALL.tolist()}\n"
        text += _setup(f"r-test-{axis}", "vector", "R-test", NEST, keys)
        ball = BALL + rng.normal(0.0, 0.02, 3)
        for angle in np.arange(-180.0, 181.0, 15.0) if axis == "C" else np.arange(-90.0, 91.0, 10.0):
            readings = machine.following(BALL, **{axis: float(angle)})
            off = 1e3 * (machine.tip(readings) - ball + noise * rng.normal(0.0, NEST, 3))
            row = dict(zip(("dx_um", "dy_um", "dz_um"), off.tolist(), strict=True))
            rows.append({"setup": f"r-test-{axis}", **readings, **row})
    return text, rows


def campaign(
    folder: Path, machine: SerialMachine, seed: int, noise: float = 1.0, axes: Sequence[str] | None = None
) -> Path:
    """Write a run by laser, ball bar and R-test."""
    rng = np.random.default_rng(seed)
    text, rows = lasers(machine, rng, noise)
    for more, others in (ball_bars(machine, rng, noise), r_tests(machine, rng, noise, axes)):
        text, rows = text + more, rows + others
    return machine.chain.write(folder, text, rows)


def places(
    machine: SerialMachine, points: int, angles: Iterable[Mapping[str, float]]
) -> list[dict[str, float]]:
    """Readings on a grid over the strokes at every pose of the rotary axes."""
    bare = {axis.name: 0.0 for axis in machine.chain.all_axes}
    stops = np.linspace(-HALF_STROKE, HALF_STROKE, points).tolist()
    grid = [dict(zip("XYZ", place, strict=True)) for place in product(stops, repeat=3)]
    return [{**bare, **turns, **place} for turns in angles for place in grid]


def _setup(name: str, reading: str, instrument: str, u: float, keys: str) -> str:
    return (
        f'\n[[setups]]\nid = "{name}"\nreading = "{reading}"\ninstrument = "{instrument}"\n'
        f"standard_uncertainty_um = {1e3 * u:g}\ntool_point_mm = {TOOL.tolist()}\n{keys}"
    )
