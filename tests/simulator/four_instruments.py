"""One machine in one week: laser, ball bar, R-test and a dial on a square; ``python -m tests.simulator.four_instruments
examples`` writes the four examples of the method ``instruments``.

A machining centre ``w C Y b X Z t`` has location errors and gains, and one effect that no instrument shows alone: X
pitches by 40 µrad on a metre of its travel (EBX:poly1). Near the table the laser sees it as one gain of X, half a metre
higher the ball bar as another.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

TOOL = np.array([0.0, 0.0, -120.0])
#: What is hidden, rad/mm, and what is true of the machine in mm and rad: the parameters that are identified.
PITCH = 40e-9
TRUTH = {
    "EX0C": 0.018, "EY0C": -0.011, "EA0C": 45e-6, "EB0C": -28e-6, "EC0Y": 35e-6, "EA0Z": -22e-6, "EB0Z": 26e-6,
    "EXX": 12e-6, "EYY": -8e-6, "EZZ": 5e-6,
}  # fmt: skip
BAR, BAR_AT = 100.0, np.array([150.0, 120.0, 380.0])
#: Of the bar's calibration, mm.
BAR_U = 3e-4
BALL = np.array([80.0, 0.0, 60.0])
LASER, LENGTH, NEST, DIAL = 3e-4, 5e-4, 5e-4, 1e-3
Row = dict[str, object]
#: What the examples state of the laser's scale: 1 K of air is 0.95 um/m, 1 hPa 0.27 (B. Edlen, Metrologia 2 (1966) 71).
SCALE_KEY = (
    "# Air known to 0.3 K and 1 hPa (0.3 um/m each), the laser's frequency to 0.1 um/m; no material is compensated.\n"
    "scale_standard_uncertainty_um_per_m = 0.5\n"
)


def machine(pitch: float = PITCH, truth: Mapping[str, float] = TRUTH) -> SimulatedChain:
    """The machine with a pitch of X in rad/mm and errors by name."""

    def six(**errors: float) -> tuple[float, ...]:
        return tuple(errors.get(letter, 0.0) for letter in "XYZABC")

    t = truth
    return SimulatedChain(
        (
            SimulatedAxis("X", "linear", X, motion=lambda q: six(X=t["EXX"] * q, B=pitch * q)),
            SimulatedAxis(
                "Z", "linear", Z, errors=six(A=t["EA0Z"], B=t["EB0Z"]), motion=lambda q: six(Z=t["EZZ"] * q)
            ),
        ),
        work=(
            SimulatedAxis(
                "Y", "linear", Y, sign=-1, errors=six(C=t["EC0Y"]), motion=lambda q: six(Y=t["EYY"] * q)
            ),
            SimulatedAxis(
                "C", "rotary", Z, sign=-1, errors=six(X=t["EX0C"], Y=t["EY0C"], A=t["EA0C"], B=t["EB0C"])
            ),
        ),
    )


def pose(**readings: float) -> dict[str, float]:
    """Readings of all axes, zero where none is named."""
    return {"X": 0.0, "Y": 0.0, "Z": 0.0, "C": 0.0, **readings}


def seen(chain: SimulatedChain, readings: Mapping[str, float]) -> np.ndarray:
    """The tool point in the frame of the table."""
    frame = chain.seen(readings)
    return np.asarray(frame[:3, :3] @ TOOL + frame[:3, 3])


def laser(
    chain: SimulatedChain, rng: np.random.Generator, cycles: int = 5, keys: str = ""
) -> tuple[str, list[Row]]:
    """Three axes there and back, the beam askew by some 0.2 mrad, near the table; setups have ``keys`` besides."""
    text, rows = "", []
    for name, way, limits in (("X", X, (0.0, 500.0)), ("Y", Y, (0.0, 400.0)), ("Z", Z, (0.0, 400.0))):
        text += _setup(
            f"laser-{name}", "displacement", "laser interferometer", LASER, f'direction = "{name}"\n'
            f"direction_standard_uncertainty_urad = 200.0\n{keys}"
        )  # fmt: skip
        beam = np.array(way) + rng.normal(0.0, 2e-4, 3) * (1.0 - np.array(way))
        beam /= np.linalg.norm(beam)
        stops = np.linspace(*limits, 11)
        for cycle in range(cycles):
            for place in [*stops, *stops[::-1]]:
                readings = pose(**{name: float(place)})
                value = float(seen(chain, readings) @ beam) + rng.normal(0.0, LASER)
                if cycle == 0 and len(rows) % (22 * cycles) == 0:
                    zero = value
                rows.append({"setup": f"laser-{name}", **readings, "reading_um": 1e3 * (value - zero)})
    return text, rows


def ball_bar(
    chain: SimulatedChain, rng: np.random.Generator, step: float = 5.0, off: float | None = None
) -> tuple[str, list[Row]]:
    """Three planes, both senses, high above the table; the bar is ``off`` its length by so much, drawn where None."""
    text, rows = "", []
    length = BAR + (rng.normal(0.0, BAR_U) if off is None else off)
    for name, first, second in (("xy", 0, 1), ("yz", 1, 2), ("zx", 2, 0)):
        keys = f"work_point_mm = {BAR_AT.tolist()}\nlength_mm = {BAR}\n"
        keys += f"length_standard_uncertainty_um = {1e3 * BAR_U:g}\n"
        text += _setup(f"bar-{name}", "distance", "ball bar", LENGTH, keys)
        centre = BAR_AT + rng.normal(0.0, 0.02, 3)
        there = np.arange(0.0, 360.0 + step / 2.0, step)
        for angle in np.deg2rad([*there, *there[::-1]]):
            arm = np.zeros(3)
            arm[first], arm[second] = BAR * np.cos(angle), BAR * np.sin(angle)
            x, y, z = BAR_AT + arm - TOOL
            readings = pose(X=float(x), Y=float(y), Z=float(z))
            long = float(np.linalg.norm(seen(chain, readings) - centre)) - length + rng.normal(0.0, LENGTH)
            rows.append({"setup": f"bar-{name}", **readings, "reading_um": 1e3 * long})
    return text, rows


def r_test(chain: SimulatedChain, rng: np.random.Generator) -> tuple[str, list[Row]]:
    """A sphere on the table at 25 angles of C, X and Y following."""
    rows = []
    ball = BALL + rng.normal(0.0, 0.02, 3)
    for angle in np.arange(0.0, 361.0, 15.0):
        x, y, z = Rotation.from_rotvec([0.0, 0.0, -np.deg2rad(angle)]).apply(BALL) - TOOL
        readings = pose(X=float(x), Y=float(y), Z=float(z), C=float(angle))
        off = 1e3 * (seen(chain, readings) - ball + rng.normal(0.0, NEST, 3))
        rows.append(
            {"setup": "r-test", **readings, **dict(zip(("dx_um", "dy_um", "dz_um"), off, strict=True))}
        )
    return _setup("r-test", "vector", "R-test", NEST, f"work_point_mm = {BALL.tolist()}\n"), rows


def dial(chain: SimulatedChain, rng: np.random.Generator) -> tuple[str, list[Row]]:
    """A dial along X on a square that stands on the table, swept along Z."""
    rows = []
    for z in np.linspace(0.0, 400.0, 13):
        readings = pose(Z=float(z))
        rows.append(
            {
                "setup": "square",
                **readings,
                "reading_um": 1e3 * (seen(chain, readings)[0] + rng.normal(0.0, DIAL)),
            }
        )
    return _setup("square", "component", "dial on a square", DIAL, 'direction = "X"\n'), rows


def session(
    folder: Path,
    rng: np.random.Generator,
    truths: Sequence[Mapping[str, float]],
    step: float = 5.0,
    *,
    days: bool = False,
) -> Path:
    """Write one day: a run with laser and bar, then runs with the same bar alone, each of a machine of its own; with
    ``days`` every run is on a day of its own."""
    off = rng.normal(0.0, BAR_U)
    text, rows = "", []
    for run, truth in enumerate(truths, start=1):
        chain = machine(0.0, truth)
        parts = [ball_bar(chain, rng, step, off)]
        if run == 1:
            parts.insert(0, laser(chain, rng, 1))
            text = "".join(setups for setups, _ in parts)
        rows += [{"run": run, **row} for _, of in parts for row in of]
    count = len(truths)
    numbers = list(range(1, count + 1)) if days else [1] * count
    started = [f"2026-03-{1 + day:02d}T{8 + run:02d}:00:00+00:00" for run, day in enumerate(numbers)]
    return chain.write(folder, text, rows, started=started, days=numbers)


def _setup(name: str, reading: str, instrument: str, u: float, keys: str) -> str:
    return (
        f'\n[[setups]]\nid = "{name}"\nreading = "{reading}"\ninstrument = "{instrument}"\n'
        f"standard_uncertainty_um = {1e3 * u:g}\ntool_point_mm = {TOOL.tolist()}\n{keys}"
    )


def rounded(rows: Sequence[Row]) -> list[Row]:
    """Readings as instruments print them: 10 nm, axes to 0.1 µm."""
    return [
        {
            name: round(value, 2 if name.endswith("_um") else 4) if isinstance(value, float) else value
            for name, value in row.items()
        }
        for row in rows
    ]


def write_examples(folder: Path) -> None:
    """Write ``four-instruments`` and each of three instruments by itself, the same readings."""
    rng = np.random.default_rng(20)
    chain = machine()
    measured = {
        "laser": laser(chain, rng, keys=SCALE_KEY),
        "ball-bar": ball_bar(chain, rng),
        "r-test": r_test(chain, rng),
    }
    for name, (text, rows) in measured.items():
        _write(chain, folder / name, text, rows)
    parts = [*measured.values(), dial(chain, rng)]
    _write(
        chain,
        folder / "four-instruments",
        "".join(text for text, _ in parts),
        [r for _, rows in parts for r in rows],
    )


def _write(chain: SimulatedChain, folder: Path, text: str, rows: Sequence[Row]) -> None:
    chain.write(folder, text, rounded(rows))
    path = folder / "campaign.toml"
    path.write_text(
        path.read_text(encoding="utf-8").replace(f'id = "{folder.name}"', 'id = "CENTRE-4"', 1),
        encoding="utf-8",
    )


if __name__ == "__main__":
    write_examples(Path(sys.argv[1]))
