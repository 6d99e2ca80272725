"""Setups that stand far from where the file says: their zeros are large, and no gain may suffer from it.

A machine of three axes with lasers along X and Z, and straightedges along all three that are read from zero some
0.2 m off the work point. No such reading tells the tilt of Z from how the straightedges lie.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

GAINS = {"X": -11e-6, "Y": 24e-6, "Z": -20e-6}
TOOL = np.array([0.0, 0.0, -120.0])
LASERS, EDGES = (
    {"laser-X": "X", "laser-Z": "Z"},
    {"edge-X-Y": "X", "edge-X-Z": "X", "edge-Y-X": "Y", "edge-Z-X": "Z"},
)
SETUPS = "".join(
    f'\n[[setups]]\nid = "{name}"\nreading = "displacement"\nstandard_uncertainty_um = 0.3\n'
    f'tool_point_mm = [0.0, 0.0, -120.0]\ndirection = "{axis}"\ndirection_standard_uncertainty_urad = 200.0\n'
    for name, axis in LASERS.items()
) + "".join(
    f'\n[[setups]]\nid = "{name}"\nreading = "offset"\nstandard_uncertainty_um = 0.4\n'
    f'tool_point_mm = [0.0, 0.0, -120.0]\ndirection = "{name[-1]}"\nalong = "{axis}"\n'
    for name, axis in EDGES.items()
)


def gain(axis: int, size: float) -> object:
    """Six errors of an axis that moves further by a part of its travel."""
    return lambda travel: [size * travel if component == axis else 0.0 for component in range(6)]


def machine() -> SimulatedChain:
    """The machine, out of square by 100 urad."""
    return SimulatedChain(
        axes=(
            SimulatedAxis("X", "linear", X, motion=gain(0, GAINS["X"])),
            SimulatedAxis("Z", "linear", Z, errors=(0, 0, 0, -4e-5, 1e-4, 0), motion=gain(2, GAINS["Z"])),
        ),
        work=(SimulatedAxis("Y", "linear", Y, sign=-1, motion=gain(1, GAINS["Y"])),),
    )


def test_straightedges_far_from_their_stated_places_leave_the_gains_alone(tmp_path: Path) -> None:
    """Gains within four standard uncertainties of what was simulated, and these below 1 um/m; before the zeros began
    where a machine without errors leaves them, EZZ was 57 000 um/m off."""
    rng = np.random.default_rng(20261125)
    chain, rows = machine(), []
    rest = {"X": 250.0, "Y": 200.0, "Z": 300.0}
    for setup, axis in {**LASERS, **EDGES}.items():
        along = np.eye(3)["XYZ".index(setup[-1])]
        first, u, askew = (0.0, 0.3, 0.0) if setup in LASERS else (0.0, 0.4, 3e-5)
        for index, travel in enumerate(np.linspace(0.0, 500.0, 26)):
            readings = rest | {axis: float(travel)}
            seen = float((chain.seen(readings) @ np.append(TOOL, 1.0))[:3] @ along)
            first = seen if index == 0 else first
            reading = 1e3 * (seen - first + askew * travel) + rng.normal(0.0, u)
            rows.append({**readings, "setup": setup, "reading_um": reading})
    campaign = read_campaign(chain.write(tmp_path / "edges", SETUPS, rows))
    problem = campaign_method(campaign).problem_of(campaign)
    solution = solve_problem(problem)
    u_of = np.sqrt(np.diag(solution.local_covariance[0]))
    for axis in "XZ":
        index = problem.base_names.index(f"E{axis}{axis}")
        assert solution.local_free[0, index]
        assert u_of[index] < 1e-6
        assert abs(solution.local[0, index] - GAINS[axis]) < 4 * u_of[index]
