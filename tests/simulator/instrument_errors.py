"""A week of one machine, and what its instruments do wrong themselves: without a line of the package.

Laser, ball bar, R-test and dial are those of ``four_instruments``; a level on the spindle along X and a probe that
touches a square block on the turning table come besides. The air wanders by a kelvin. An error of an instrument changes
what it prints and nothing of the machine.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.simulator import four_instruments as shop
from tests.simulator.four_instruments import Row, SimulatedChain, pose

#: Standard uncertainty of the level in µrad and of the probe in mm.
LEVEL, PROBE = 1.0, 5e-4
BLOCK = np.array([90.0, 0.0, 40.0])


def level(chain: SimulatedChain, rng: np.random.Generator) -> tuple[str, list[Row]]:
    """A level on the spindle about Y, there and back along X."""
    rows = []
    there = np.linspace(0.0, 500.0, 11)
    for x in [*there, *there[::-1]]:
        readings = pose(X=float(x))
        turned = Rotation.from_matrix(chain.pose(readings)[:3, :3]).as_rotvec()
        rows.append({"setup": "level", **readings, "reading_urad": 1e6 * turned[1] + rng.normal(0.0, LEVEL)})
    text = (
        '\n[[setups]]\nid = "level"\nreading = "level"\ninstrument = "electronic level"\n'
        f'standard_uncertainty_urad = {LEVEL:g}\ndirection = "Y"\n'
    )
    return text, rows


def probe(chain: SimulatedChain, rng: np.random.Generator) -> tuple[str, list[Row]]:
    """A probe touches one face of a block on the table along its normal, the table at 24 angles, X and Y following."""
    rows = []
    zero = rng.normal(0.0, 0.02)
    for angle in np.arange(0.0, 360.0, 15.0):
        x, y, z = Rotation.from_rotvec([0.0, 0.0, -np.deg2rad(angle)]).apply(BLOCK) - shop.TOOL
        readings = pose(X=float(x), Y=float(y), Z=float(z), C=float(angle))
        off = shop.seen(chain, readings)[0] - BLOCK[0] - zero + rng.normal(0.0, PROBE)
        rows.append({"setup": "probe", **readings, "reading_um": 1e3 * off})
    text = shop._setup(
        "probe", "component", "touch probe", PROBE, f'direction = "X"\nwork_point_mm = {BLOCK.tolist()}\n'
    )
    return text, rows


def r_test(chain: SimulatedChain, rng: np.random.Generator) -> tuple[str, list[Row]]:
    """A sphere on the table at 25 angles of C and back again: what goes with time does not go with C."""
    rows = []
    ball = shop.BALL + rng.normal(0.0, 0.02, 3)
    there = np.arange(0.0, 361.0, 15.0)
    for angle in [*there, *there[::-1]]:
        x, y, z = Rotation.from_rotvec([0.0, 0.0, -np.deg2rad(angle)]).apply(shop.BALL) - shop.TOOL
        readings = pose(X=float(x), Y=float(y), Z=float(z), C=float(angle))
        off = 1e3 * (shop.seen(chain, readings) - ball + rng.normal(0.0, shop.NEST, 3))
        rows.append(
            {"setup": "r-test", **readings, **dict(zip(("dx_um", "dy_um", "dz_um"), off, strict=True))}
        )
    return shop._setup(
        "r-test", "vector", "R-test", shop.NEST, f"work_point_mm = {shop.BALL.tolist()}\n"
    ), rows


def _of(name: str) -> Callable[[Row], bool]:
    return lambda row: str(row["setup"]) == name or str(row["setup"]).startswith(f"{name}-")


def scaled(rows: list[Row], name: str, by: Callable[[Row], float]) -> None:
    """A laser's readings grow in proportion."""
    for row in filter(_of(name), rows):
        row["reading_um"] *= 1.0 + by(row)


def shifted(rows: list[Row], name: str, column: str, by: Callable[[Row], float]) -> None:
    """Readings shift by so many µm or µrad."""
    for row in filter(_of(name), rows):
        row[column] += by(row)


def lobed(rows: list[Row], size: float, lobes: int, phase: float) -> None:
    """The probe reads by its direction: the face's normal, seen from the spindle, turns back with the table."""
    shifted(rows, "probe", "reading_um", lambda row: size * np.cos(lobes * np.deg2rad(-row["C"]) - phase))


def counted_from_the_first(rows: list[Row]) -> None:
    """Lasers read zero in their first row."""
    for name in ("laser-X", "laser-Y", "laser-Z"):
        mine = list(filter(_of(name), rows))
        first = mine[0]["reading_um"] if mine else 0.0
        for row in mine:
            row["reading_um"] -= first


#: What is put in, in the order of its name: the effect that names it, and how readings change for a size in its unit.
ERRORS: Mapping[str, Callable[[list[Row], float, np.random.Generator], None]] = {
    "instrument:laser-X:cosine": lambda rows, size, rng: scaled(rows, "laser-X", lambda row: -1e-6 * size),
    "instrument:laser interferometer:scale": lambda rows, size, rng: scaled(
        rows, "laser", lambda row: 1e-6 * size
    ),
    "instrument:laser interferometer:scale@air_degC": lambda rows, size, rng: scaled(
        rows, "laser", lambda row: 1e-6 * size * (row["air_degC"] - 20.0)
    ),
    "instrument:laser-Y:dead_path@air_degC": lambda rows, size, rng: shifted(
        rows, "laser-Y", "reading_um", lambda row: size * (row["air_degC"] - 20.0)
    ),
    "instrument:bar-xy:length": lambda rows, size, rng: shifted(
        rows, "bar-xy", "reading_um", lambda row: -size
    ),
    "instrument:ball bar:length": lambda rows, size, rng: shifted(
        rows, "bar", "reading_um", lambda row: -size
    ),
    "instrument:r-test:drift@run_time": lambda rows, size, rng: shifted(
        rows, "r-test", "dx_um", lambda row: size * row["time"]
    ),
    "instrument:level:tilt@run_time": lambda rows, size, rng: shifted(
        rows, "level", "reading_urad", lambda row: size * row["time"]
    ),
    "instrument:probe:lobing3": lambda rows, size, rng: lobed(rows, size, 3, rng.uniform(0.0, 2.0 * np.pi)),
}


def week(
    folder: Path,
    rng: np.random.Generator,
    truth: Mapping[str, float],
    error: str = "",
    size: float = 0.0,
    *,
    cycles: int = 2,
    beside: Mapping[str, float] | None = None,
    pitch: float = 0.0,
) -> Path:
    """Write a campaign of six instruments; ``error`` of ``ERRORS`` has ``size`` µm, µrad or µm/m, and those ``beside``
    it theirs; X pitches by ``pitch`` rad/mm."""
    chain = shop.machine(pitch, truth)
    parts = [
        shop.laser(chain, rng, cycles),
        shop.ball_bar(chain, rng, 10.0),
        r_test(chain, rng),
        shop.dial(chain, rng),
        level(chain, rng),
        probe(chain, rng),
    ]
    rows = [row for _, of in parts for row in of]
    phase = rng.uniform(0.0, 2.0 * np.pi)
    for number, row in enumerate(rows):
        row["time"] = number / (len(rows) - 1)
        # It wanders over some 20 minutes: quickly enough for a change within every setup.
        row["air_degC"] = 20.3 + np.sin(2.0 * np.pi * number / 19.0 + phase)
    for name, of_name in {**(beside or {}), **({error: size} if error else {})}.items():
        ERRORS[name](rows, of_name, rng)
        counted_from_the_first(rows)
    for row in rows:
        del row["time"]
    return chain.write(folder, "".join(text for text, _ in parts), shop.rounded(rows))
