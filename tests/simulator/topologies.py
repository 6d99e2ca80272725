"""Machines of any order of axes and any size, measured by laser, ball bar, R-test and a dial on a square.

Shares no line with the package.

A topology is written as ``w C A b X Y Z t``: axes on the work's side from the work to the bed, then those to the tool.
The size is that of a machine with strokes of 400 mm; travels, bars and spheres grow with it, the noise of a laser too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.simulator.four_instruments import Row
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: Standard deviations of the errors of a machine: places of rotary axes (mm), angles (rad), gains (mm/mm).
PLACE, ANGLE, GAIN = 0.02, 40e-6, 10e-6
#: Standard uncertainties, mm: of the laser's readings, of a bar's, a nest's and a dial's; of a bar's length, in mm/mm;
#: of the laser's scale.
LASER, BAR, NEST, DIAL, BAR_LENGTH, SCALE = 3e-4, 5e-4, 5e-4, 1e-3, 2e-6, 0.5e-6
SPREAD = {"X": PLACE, "Y": PLACE, "Z": PLACE, "A": ANGLE, "B": ANGLE, "C": ANGLE}


@dataclass(frozen=True)
class Shop:
    """A machine with its ``truth`` by parameter, and what measures it."""

    topology: str
    truth: Mapping[str, float]
    size: float = 1.0

    @property
    def tool(self) -> np.ndarray:
        """The tool point, mm."""
        return np.array([0.0, 0.0, -150.0 * min(self.size, 2.0)])

    @property
    def rotary(self) -> list[str]:
        """The rotary axes."""
        return [name for name in self.topology.split() if name in "ABC"]

    def machine(self, truth: Mapping[str, float]) -> SimulatedChain:
        """The machine with some errors."""
        names = self.topology.split()
        bed = names.index("b")
        work = tuple(_axis(name, truth, -1) for name in names[bed - 1 : 0 : -1])
        return SimulatedChain(tuple(_axis(name, truth, 1) for name in names[bed + 1 : -1]), work=work)

    def seen(self, chain: SimulatedChain, readings: Mapping[str, float]) -> np.ndarray:
        """The tool point in the frame of the last work axis."""
        frame = chain.seen(readings)
        return np.asarray(frame[:3, :3] @ self.tool + frame[:3, 3])

    def following(self, point: np.ndarray, **turns: float) -> dict[str, float]:
        """Readings that bring the tool point of a machine without errors to a point of the work."""
        ideal = self.machine({})
        bare = dict.fromkeys([*"XYZ", *self.rotary], 0.0) | turns
        zero = self.seen(ideal, bare)
        slopes = np.column_stack([self.seen(ideal, bare | {axis: 1.0}) - zero for axis in "XYZ"])
        return bare | dict(zip("XYZ", np.linalg.solve(slopes, point - zero).tolist(), strict=True))

    def laser(self, rng: np.random.Generator) -> tuple[str, list[Row]]:
        """Three axes there and back twice, the beam askew by some 0.2 mrad, the scale off."""
        chain, noise = self.machine(self.truth), LASER * max(1.0, self.size)
        text, rows, scale = "", [], 1.0 + rng.normal(0.0, SCALE)
        for number, name in enumerate("XYZ"):
            keys = f'direction = "{name}"\ndirection_standard_uncertainty_urad = 200.0\n'
            keys += f"scale_standard_uncertainty_um_per_m = {1e6 * SCALE:g}\n"
            text += self._setup(f"laser-{name}", "displacement", "laser", noise, keys)
            way = np.eye(3)[number]
            beam = way + rng.normal(0.0, 2e-4, 3) * (1.0 - way)
            beam /= np.linalg.norm(beam)
            stops = self.size * np.linspace(-200.0, 200.0, 9)
            zero, mine = self.seen(self.machine({}), self._at({})), []
            for place in [*stops, *stops[::-1]] * 2:
                readings = self.following(zero + place * way)
                value = scale * float(self.seen(chain, readings) @ beam) + rng.normal(0.0, noise)
                mine.append({"setup": f"laser-{name}", **readings, "reading_um": 1e3 * value})
            first = mine[0]["reading_um"]
            rows += [{**row, "reading_um": row["reading_um"] - first} for row in mine]
        return text, rows

    def bar(self, rng: np.random.Generator) -> tuple[str, list[Row]]:
        """Three planes, both senses."""
        chain, nominal = self.machine(self.truth), float(np.clip(150.0 * self.size, 50.0, 600.0))
        centre = self.size * np.array([40.0, 60.0, -30.0])
        text, rows, length = "", [], nominal * (1.0 + rng.normal(0.0, BAR_LENGTH))
        for name, (first, second) in {"xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}.items():
            keys = f"work_point_mm = {centre.tolist()}\nlength_mm = {nominal}\n"
            keys += f"length_standard_uncertainty_um = {1e3 * nominal * BAR_LENGTH:g}\n"
            text += self._setup(f"bar-{name}", "distance", "ball bar", BAR, keys)
            ball, there = centre + rng.normal(0.0, 0.02, 3), np.arange(0.0, 361.0, 15.0)
            for angle in np.deg2rad([*there, *there[::-1]]):
                arm = np.zeros(3)
                arm[first], arm[second] = nominal * np.cos(angle), nominal * np.sin(angle)
                readings = self.following(centre + arm)
                long = float(np.linalg.norm(self.seen(chain, readings) - ball)) - length
                rows.append({
                    "setup": f"bar-{name}", **readings, "reading_um": 1e3 * (long + rng.normal(0.0, BAR)),
                })  # fmt: skip
        return text, rows

    def r_test(self, rng: np.random.Generator) -> tuple[str, list[Row]]:
        """A sphere followed around every rotary axis, at two heights."""
        chain, text, rows = self.machine(self.truth), "", []
        for axis in self.rotary:
            for height in (30.0, 90.0):
                point = self.size * np.array([90.0, 40.0, height])
                keys = f"work_point_mm = {point.tolist()}\n"
                text += self._setup(f"r-test-{axis}-{height:g}", "vector", "R-test", NEST, keys)
                ball = point + rng.normal(0.0, 0.02, 3)
                for angle in np.arange(-90.0, 91.0, 15.0):
                    readings = self.following(point, **{axis: float(angle)})
                    off = 1e3 * (self.seen(chain, readings) - ball + rng.normal(0.0, NEST, 3))
                    row = dict(zip(("dx_um", "dy_um", "dz_um"), off.tolist(), strict=True))
                    rows.append({"setup": f"r-test-{axis}-{height:g}", **readings, **row})
        return text, rows

    def square(self, rng: np.random.Generator) -> tuple[str, list[Row]]:
        """A dial along X and along Y while the tool goes along Z."""
        chain, text, rows = self.machine(self.truth), "", []
        for number, name in enumerate("XY"):
            text += self._setup(
                f"square-{name}", "component", "dial on a square", DIAL, f'direction = "{name}"\n'
            )
            zero = self.seen(self.machine({}), self._at({}))
            for place in self.size * np.linspace(-150.0, 150.0, 13):
                readings = self.following(zero + np.array([0.0, 0.0, place]))
                off = self.seen(chain, readings)[number] - zero[number] + rng.normal(0.0, DIAL)
                rows.append({"setup": f"square-{name}", **readings, "reading_um": 1e3 * off})
        return text, rows

    def write(self, folder: Path, rng: np.random.Generator, instruments: tuple[str, ...]) -> Path:
        """Write a campaign of one run by some instruments."""
        text, rows = "", []
        for name in instruments:
            setups, more = getattr(self, name)(rng)
            text, rows = text + setups, rows + more
        return self.machine({}).write(folder, text, rows)

    def _at(self, turns: Mapping[str, float]) -> dict[str, float]:
        return dict.fromkeys([*"XYZ", *self.rotary], 0.0) | dict(turns)

    def _setup(self, name: str, reading: str, instrument: str, u: float, keys: str) -> str:
        return (
            f'\n[[setups]]\nid = "{name}"\nreading = "{reading}"\ninstrument = "{instrument}"\n'
            f"standard_uncertainty_um = {1e3 * u:g}\ntool_point_mm = {self.tool.tolist()}\n{keys}"
        )


def truth_of(rng: np.random.Generator, parameters: tuple[str, ...]) -> dict[str, float]:
    """Errors of a machine of its own: location errors ``EX0C`` and gains ``EXX:poly1``."""
    truth = {}
    for name in parameters:
        spread = GAIN if name.endswith(":poly1") else SPREAD[name[1]]
        truth[name.removesuffix(":poly1")] = float(rng.normal(0.0, spread))
    return truth


def _axis(name: str, truth: Mapping[str, float], sign: int) -> SimulatedAxis:
    turns = name in "ABC"
    about = np.eye(3)["XYZ".index(name) if not turns else "ABC".index(name)]
    errors = tuple(truth.get(f"E{way}0{name}", 0.0) for way in "XYZABC")
    gain = truth.get(f"E{name}{name}", 0.0)

    def grown(q: float) -> np.ndarray:
        return np.concatenate([gain * q * about, np.zeros(3)])

    return SimulatedAxis(
        name,
        "rotary" if turns else "linear",
        tuple(about),
        sign=sign,
        errors=errors,
        motion=None if turns else grown,
    )
