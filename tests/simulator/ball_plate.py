"""A plate of balls in several places of a machine with three linear axes, simulated without a line of the package."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Row = dict[str, str]
#: Stated places of the balls in mm.
BALLS = {
    f"B{5 * row + column + 1}": (100.0 * column - 200.0, 100.0 * row - 200.0, 0.0)
    for row in range(5)
    for column in range(5)
}
#: Where the plate stands: how it is turned, and where its middle is.
PLACES: tuple[tuple[tuple[int, ...], tuple[float, ...]], ...] = (
    ((0, 1, 2), (0.0, 0.0, 60.0)),
    ((0, 1, 2), (20.0, 10.0, 360.0)),
    ((0, 2, 1), (0.0, -150.0, 260.0)),
    ((2, 1, 0), (-160.0, 0.0, 262.0)),
)


def plate_rows(seed: int, *, noise: float = 5e-4, passes: int = 2) -> list[Row]:
    """The readings of a machine with gains and squarenesses of some 10 µm/m: each ball of each place once a pass."""
    rng = np.random.default_rng(seed)
    gains, square = rng.normal(0.0, 1e-5, (2, 3))
    rows: list[Row] = []
    for place, (axes, middle) in enumerate(PLACES, 1):
        tilt = rng.normal(0.0, 2e-3, 3)
        for number in range(passes):
            names = list(BALLS) if number % 2 == 0 else list(BALLS)[::-1]
            for name in names:
                nominal = np.array(BALLS[name])[list(axes)]
                at = nominal + np.cross(tilt, nominal) + middle + rng.normal(0.0, noise, 3)
                error = gains * at + np.array([square[0] * at[1] + square[1] * at[2], square[2] * at[2], 0.0])
                x, y, z = at - error
                rows.append(
                    {
                        "run": "1", "sequence": str(len(rows) + 1), "time_s": f"{12.0 * len(rows):.1f}",
                        "setup": f"place{place}", "target": name,
                        "x_mm": f"{x:.5f}", "y_mm": f"{y:.5f}", "z_mm": f"{z:.5f}",
                        **{f"point_{axis}_mm": f"{value:.4f}" for axis, value in zip("xyz", BALLS[name], strict=True)},
                    }
                )  # fmt: skip
    return rows


def write_plate(folder: Path, rows: Sequence[Row], *, u_um: float = 0.5) -> Path:
    """A campaign folder of such rows."""
    folder.mkdir(parents=True)
    setups = "".join(
        f'[[setups]]\nid = "place{place}"\nreading = "point"\ninstrument = "ball plate"\n'
        f'standard_uncertainty_um = {u_um}\nknown = ["targets"]\nscale_standard_uncertainty_um_per_m = 0.5\n'
        for place in range(1, len(PLACES) + 1)
    )
    (folder / "campaign.toml").write_text(
        f'format = 1\ncampaign = "{folder.name}"\nmethod = "instruments"\n[machine]\nid = "CMM"\n'
        f'topology = "w b Y X Z t"\n{setups}'
    )
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:00:00+01:00,1,false,20.1\n"
    )
    with (folder / "probings.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return folder
