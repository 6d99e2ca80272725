"""A horizontal centre ``w B Z b X Y A t`` with a swivelling head, measured by laser, ball bar and R-test; without a
line of the package.

The R-test goes around B, read in the frame of the table, and around A, read in that of the head: squareness of Z and X
shows by it and by the ball bar. Every instrument may meet another state of the machine, and read otherwise than it
should.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from tests.simulator.four_instruments import Row
from tests.simulator.instruments import SimulatedAxis, SimulatedChain

#: What is true of the machine, mm and rad (gains: mm/mm).
TRUTH = {
    "EX0B": 0.021, "EZ0B": -0.014, "EA0B": 37e-6, "EC0B": -52e-6, "EC0Y": 44e-6, "EY0A": 0.009, "EZ0A": -0.017,
    "EB0A": -33e-6, "EC0A": 26e-6, "EA0Y": -18e-6, "EB0X": 21e-6, "EXX": 14e-6, "EYY": -9e-6, "EZZ": 7e-6,
}  # fmt: skip
TOOL = np.array([0.0, 0.0, -150.0])
BAR, BAR_AT, BALL = 150.0, np.array([40.0, 60.0, -30.0]), np.array([90.0, 40.0, 30.0])
#: Standard uncertainties of the beam's and the bar's readings, of one sensor and of the bar's calibration, mm.
LASER, LENGTH, NEST, BAR_U = 3e-4, 5e-4, 5e-4, 3e-4
PLANES = {"xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}


def truth_of(rng: np.random.Generator) -> dict[str, float]:
    """Errors of a machine of its own, each of the size of that in ``TRUTH``."""
    return {name: float(rng.normal(0.0, abs(size))) for name, size in TRUTH.items()}


def machine(truth: Mapping[str, float] = TRUTH, warmer: float = 0.0) -> SimulatedChain:
    """The machine; ``warmer``: all its scales have grown by so much of their length."""

    def axis(name: str, kind: str, number: int, sign: int) -> SimulatedAxis:
        errors = [truth.get(f"E{letter}0{name}", 0.0) for letter in "XYZABC"]
        about = np.eye(3)[number]
        gain = truth.get(f"E{name}{name}", 0.0) + warmer

        def grown(q: float) -> np.ndarray:
            return np.concatenate([gain * q * about, np.zeros(3)])

        return SimulatedAxis(
            name,
            kind,
            tuple(about),
            sign=sign,
            errors=tuple(errors),
            motion=grown if kind == "linear" else None,
        )

    return SimulatedChain(
        (axis("X", "linear", 0, 1), axis("Y", "linear", 1, 1), axis("A", "rotary", 0, 1)),
        work=(axis("Z", "linear", 2, -1), axis("B", "rotary", 1, -1)),
        gravity=(0.0, -1.0, 0.0),
    )


def seen(chain: SimulatedChain, readings: Mapping[str, float]) -> np.ndarray:
    """The tool point in the frame of the table."""
    frame = chain.seen(readings)
    return np.asarray(frame[:3, :3] @ TOOL + frame[:3, 3])


def following(point: np.ndarray, **turns: float) -> dict[str, float]:
    """Readings that bring the tool point of a machine without errors to a point of the table."""
    return dict(_following(tuple(np.round(point, 9).tolist()), tuple(turns.items())))


@cache
def _following(at: tuple[float, ...], angles: tuple[tuple[str, float], ...]) -> dict[str, float]:
    ideal, point, turns = machine({}), np.array(at), dict(angles)
    bare = {"X": 0.0, "Y": 0.0, "Z": 0.0, "B": 0.0, "A": 0.0, **turns}
    slopes = np.column_stack([seen(ideal, {**bare, axis: 1.0}) - seen(ideal, bare) for axis in "XYZ"])
    return {
        **bare,
        **dict(zip("XYZ", np.linalg.solve(slopes, point - seen(ideal, bare)).tolist(), strict=True)),
    }


def laser(
    chain: SimulatedChain, rng: np.random.Generator, noise: np.random.Generator
) -> tuple[str, list[Row]]:
    """Three axes there and back twice, the beam askew by some 0.2 mrad."""
    text, rows = "", []
    for number, name in enumerate("XYZ"):
        way = np.eye(3)[number]
        text += _setup(
            f"laser-{name}", "displacement", "laser interferometer", LASER, f'direction = "{name}"\n'
            "direction_standard_uncertainty_urad = 200.0\n"
        )  # fmt: skip
        beam = way + rng.normal(0.0, 2e-4, 3) * (1.0 - way)
        beam /= np.linalg.norm(beam)
        stops = np.linspace(-200.0, 200.0, 9)
        mine: list[Row] = []
        for place in [*stops, *stops[::-1]] * 2:
            readings = {"X": 0.0, "Y": 0.0, "Z": 0.0, "B": 0.0, "A": 0.0, name: float(place)}
            value = float(seen(chain, readings) @ beam) + noise.normal(0.0, LASER)
            mine.append({"setup": f"laser-{name}", **readings, "reading_um": 1e3 * value})
        first = float(mine[0]["reading_um"])  # type: ignore[arg-type]
        rows += [{**row, "reading_um": float(row["reading_um"]) - first} for row in mine]  # type: ignore[arg-type]
    return text, rows


def ball_bar(
    chain: SimulatedChain, rng: np.random.Generator, noise: np.random.Generator
) -> tuple[str, list[Row]]:
    """Three planes, both senses."""
    text, rows = "", []
    length = BAR + rng.normal(0.0, BAR_U)
    for name, (first, second) in PLANES.items():
        keys = f"work_point_mm = {BAR_AT.tolist()}\nlength_mm = {BAR}\n"
        text += _setup(
            f"bar-{name}", "distance", "ball bar", LENGTH,
            keys + f"length_standard_uncertainty_um = {1e3 * BAR_U:g}\n",
        )  # fmt: skip
        centre = BAR_AT + rng.normal(0.0, 0.02, 3)
        there = np.arange(0.0, 361.0, 10.0)
        for angle in np.deg2rad([*there, *there[::-1]]):
            arm = np.zeros(3)
            arm[first], arm[second] = BAR * np.cos(angle), BAR * np.sin(angle)
            readings = following(BAR_AT + arm)
            long = float(np.linalg.norm(seen(chain, readings) - centre)) - length + noise.normal(0.0, LENGTH)
            rows.append({"setup": f"bar-{name}", **readings, "reading_um": 1e3 * long})
    return text, rows


def r_test(
    chain: SimulatedChain, rng: np.random.Generator, noise: np.random.Generator
) -> tuple[str, list[Row]]:
    """A sphere on the table at 25 angles of B, then at 19 angles of A, read by sensors on the head."""
    text, rows = "", []
    for axis, angles, frame in (
        ("B", np.arange(-180.0, 181.0, 15.0), "work"),
        ("A", np.arange(-90.0, 91.0, 10.0), "tool"),
    ):
        keys = f'work_point_mm = {BALL.tolist()}\nframe = "{frame}"\n'
        text += _setup(f"r-test-{axis}", "vector", "R-test", NEST, keys)
        ball = BALL + rng.normal(0.0, 0.02, 3)
        for angle in angles:
            readings = following(BALL, **{axis: float(angle)})
            off = seen(chain, readings) - ball
            if frame == "tool":
                off = chain.seen(readings)[:3, :3].T @ off
            off = 1e3 * (off + noise.normal(0.0, NEST, 3))
            row = dict(zip(("dx_um", "dy_um", "dz_um"), off.tolist(), strict=True))
            rows.append({"setup": f"r-test-{axis}", **readings, **row})
    return text, rows


INSTRUMENTS = {"laser": laser, "bar": ball_bar, "r-test": r_test}


class Scaled(np.random.Generator):
    """Normal numbers that scatter ``times`` as much as they should."""

    times = 1.0

    def normal(self, loc: float = 0.0, scale: float = 1.0, size: object = None) -> object:  # type: ignore[override]
        """Draw."""
        return super().normal(loc, self.times * scale, size)  # type: ignore[arg-type]


def scaled(seed: int, times: float) -> np.random.Generator:
    """What readings scatter that do so ``times`` as much as stated."""
    drawn = Scaled(np.random.PCG64([seed, 1]))
    drawn.times = times
    return drawn


def read_otherwise(rows: list[Row], setups: str, factor: float) -> None:
    """The readings of the setups whose names begin so come times ``factor``."""
    for row in rows:
        if str(row["setup"]).startswith(setups):
            for column in ("reading_um", "dx_um", "dy_um", "dz_um"):
                if column in row:
                    row[column] = factor * float(row[column])  # type: ignore[arg-type]


def only_of(setups: tuple[str, ...], text: str, rows: list[Row]) -> tuple[str, list[Row]]:
    """Some setups of a campaign with their rows."""
    blocks = text.split("\n[[setups]]\n")[1:]
    kept = [block for block in blocks if any(f'id = "{setup}"' in block for setup in setups)]
    return "".join(f"\n[[setups]]\n{block}" for block in kept), [
        row for row in rows if row["setup"] in setups
    ]


def campaign(
    folder: Path,
    rng: np.random.Generator,
    truth: Mapping[str, float] = TRUTH,
    *,
    noise: np.random.Generator | None = None,
    warmer: Mapping[str, float] | None = None,
    otherwise: tuple[str, float] | None = None,
    only: str = "",
) -> Path:
    """Write a run of three instruments, or of one of them ``only``, which reads the same as beside the others.

    ``noise`` draws what the readings scatter, ``warmer`` says by how much the scales had grown when each instrument
    measured, ``otherwise`` names setups and the factor of their readings.
    """
    text, rows = "", []
    for name, measure in INSTRUMENTS.items():
        setups, more = measure(machine(truth, (warmer or {}).get(name, 0.0)), rng, noise or rng)
        if only in ("", name):
            text, rows = text + setups, rows + more
    if otherwise is not None:
        read_otherwise(rows, *otherwise)
    return machine(truth).write(folder, text, rows)


def _setup(name: str, reading: str, instrument: str, u: float, keys: str) -> str:
    return (
        f'\n[[setups]]\nid = "{name}"\nreading = "{reading}"\ninstrument = "{instrument}"\n'
        f"standard_uncertainty_um = {1e3 * u:g}\ntool_point_mm = {TOOL.tolist()}\n{keys}"
    )
