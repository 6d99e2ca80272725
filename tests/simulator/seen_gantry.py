"""A gantry with a turning head, on which a tracker sees two reflectors: campaigns from plain matrices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain

U_UM = 10.0
SETUP = f"""
[[setups]]
id = "tracker"
reading = "point"
standard_uncertainty_um = {U_UM}
"""
TARGETS = {"T1": np.array([150.0, 0.0, -80.0]), "T2": np.array([-60.0, 90.0, -200.0])}


def _gantry(bump: float = 0.0) -> SimulatedChain:
    """X Y Z C with small errors, and a ``bump`` (mm) of the straightness of X at 350 mm."""
    axes = {
        letter: SimulatedAxis(letter, "linear", WAYS[letter], errors=(0, 0, 0, 2e-5, -3e-5, 4e-5))
        for letter in "XYZ"
    }
    x = SimulatedAxis(
        "X",
        "linear",
        WAYS["X"],
        motion=lambda q: (0, bump * float(np.interp(q, [300, 350, 400], [0, 1, 0])), 0, 0, 0, 0),
    )
    head = SimulatedAxis("C", "rotary", (0.0, 0.0, 1.0), errors=(0.02, -0.01, 0, 3e-5, 2e-5, 0))
    return SimulatedChain((x, axes["Y"], axes["Z"], head))


def seen_gantry(
    folder: Path, frame: Rotation, seed: int, *, widest: float = 550.0, bump: float = 0.0
) -> Path:
    """Forty poses with X up to the ``widest``, both reflectors at each."""
    rng, chain = np.random.default_rng(seed), _gantry(bump)
    rows = []
    low, high = [0.0, 0.0, 0.0, -175.0], [widest, 1000.0, 500.0, 175.0]
    poses = rng.uniform(low, high, (40, 4))
    poses[:2, 0] = 0.0, widest
    for pose in poses:
        readings = dict(zip("XYZC", pose.tolist(), strict=True))
        tool = chain.pose(readings)
        for name, place in TARGETS.items():
            seen = frame.inv().apply(tool[:3, :3] @ place + tool[:3, 3] - [900.0, -1700.0, 400.0])
            seen += rng.normal(0.0, U_UM / 1e3, 3)
            point = dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), seen.tolist(), strict=True))
            stated = dict(zip(("nominal_x_mm", "nominal_y_mm", "nominal_z_mm"), place.tolist(), strict=True))
            rows.append({"setup": "tracker", "target": name, **readings, **point, **stated})
    written = chain.write(folder, SETUP, rows)
    text = (written / "campaign.toml").read_text(encoding="utf-8")
    (written / "campaign.toml").write_text(text.replace(f'id = "{folder.name}"', 'id = "gantry"'))
    return written
