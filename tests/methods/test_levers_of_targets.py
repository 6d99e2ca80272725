"""A target of a tracker on axes that do not turn it: its place is the lever of their turns, and stays as it is stated.

The machines are simulated without a line of the package (``tests/simulator/instruments.py``).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.methods.chain.first_frame import best_frame
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.assembly import problem_of
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator.instruments import SimulatedAxis, SimulatedChain, X, Y, Z

#: How the turn of Z about Y grows with the square of its position, rad/mm^2, and the noise of the tracker, mm.
TRUTH, NOISE = 692e-12, 2e-5
#: What only products of errors show is held: at 0.02 um that is two thousandths of what is left.
PRODUCTS = 1.005
SETUP = """
[[setups]]
id = "tracker"
reading = "point"
standard_uncertainty_um = 0.02
tool_point_mm = [0.0, 0.0, {z}]
"""


def _chain(seed: int) -> SimulatedChain:
    """Y, X and Z with location errors of 20 um and 30 urad each; Z turns about Y as it moves."""
    rng = np.random.default_rng(seed)
    errors = [(*rng.normal(0.0, 0.02, 3), *rng.normal(0.0, 3e-5, 3)) for _ in range(3)]
    return SimulatedChain(
        (
            SimulatedAxis("Y", "linear", Y, errors=errors[0]),
            SimulatedAxis("X", "linear", X, errors=errors[1]),
            SimulatedAxis(
                "Z", "linear", Z, errors=errors[2], motion=lambda q: (0.0, 0.0, 0.0, 0.0, TRUTH * q**2, 0.0)
            ),
        )
    )


def _campaign(folder: Path, tool: float, seed: int, known: str = "") -> Campaign:
    """80 poses of a reflector at Z = ``tool`` mm, seen from anywhere."""
    chain, rng = _chain(seed), np.random.default_rng(100 + seed)
    turn, shift = Rotation.from_rotvec(rng.normal(0.0, 1.0, 3)).as_matrix(), rng.normal(0.0, 1000.0, 3)
    rows: list[dict[str, object]] = []
    for _ in range(80):
        at = {"X": rng.uniform(0.0, 700.0), "Y": rng.uniform(0.0, 1000.0), "Z": rng.uniform(-500.0, 0.0)}
        seen = (
            turn @ (chain.pose(at) @ np.array([0.0, 0.0, tool, 1.0]))[:3] + shift + rng.normal(0.0, NOISE, 3)
        )
        named = dict(zip(("point_x_mm", "point_y_mm", "point_z_mm"), seen, strict=True))
        rows.append({"setup": "tracker", **at, **named})
    campaign = read_campaign(chain.write(folder, SETUP.format(z=tool) + known, rows))
    assert isinstance(campaign, Campaign)
    return campaign


def _fitted(campaign: Campaign, *added: str) -> tuple[np.ndarray, np.ndarray, float]:
    """The common coefficients with their standard uncertainties, and the RMS in mm."""
    problem = problem_of(campaign, Model("instruments", added=added))
    solution = solve_problem(problem)
    left = problem.vectors(solution.local, solution.common)
    return solution.common, np.sqrt(np.diag(solution.common_covariance)), float(np.sqrt(np.mean(left**2)))


@pytest.mark.parametrize(
    ("tool", "seed"),
    [
        (-100.0, 1),
        (-350.0, 2),
        *[
            pytest.param(tool, seed, marks=pytest.mark.slow)
            for tool in (-100.0, -150.0, -350.0, -500.0)
            for seed in range(3, 6)
        ],
    ],
)
def test_a_tilt_of_a_linear_axis_has_its_number_at_any_tool(tmp_path: Path, tool: float, seed: int) -> None:
    """692 urad/m^2, as with the target known; -191 at -100 mm and -952 at -500 mm before, by levers of hundreds of
    millimetres across the tool."""
    free = _campaign(tmp_path / "free", tool, seed)
    (value,), (u,), rms = _fitted(free, "EBZ:poly2")
    assert abs(value - TRUTH) < 5.0 * u
    assert u < 0.05 * TRUTH
    assert rms < 1.2 * NOISE
    (at_known,), _, rms_at_known = _fitted(
        _campaign(tmp_path / "known", tool, seed, 'known = ["targets"]\n'), "EBZ:poly2"
    )
    assert value == pytest.approx(at_known, rel=1e-3)
    # More unknowns never leave more.
    assert rms <= rms_at_known * PRODUCTS


def test_more_effects_never_leave_more(tmp_path: Path) -> None:
    """A tilt beside the straightness that does the same: what is left of both is no more than of either."""
    campaign = _campaign(tmp_path / "free", -500.0, 3)
    alone = [_fitted(campaign, effect)[2] for effect in ("EBZ:poly2", "EXZ:poly2")]
    both = _fitted(campaign, "EXZ:poly2", "EBZ:poly2")[2]
    assert both <= min(alone) * PRODUCTS
    # One cannot be told from the other at one tool.
    assert alone[1] == pytest.approx(alone[0], rel=1e-2)


@pytest.mark.parametrize("seed", range(8))
def test_places_that_nothing_turns_stay_as_stated(seed: int) -> None:
    """Along the one rotary axis of a table too; across it the readings say where the point is."""
    rng = np.random.default_rng(seed)
    turn, shift = Rotation.from_rotvec(rng.normal(0.0, 1.0, 3)).as_matrix(), rng.normal(0.0, 1000.0, 3)
    origin, at = rng.uniform(-400.0, 400.0, (60, 3)), np.arange(60) % 2
    places = np.array([[0.0, 0.0, -350.0], [30.0, -20.0, -200.0]])
    for angles in (np.zeros(60), rng.uniform(-3.0, 3.0, 60)):
        rotation = Rotation.from_rotvec(np.outer(angles, Z)).as_matrix()
        poses = np.einsum("nij,nj->ni", rotation, places[at]) + origin
        points = (poses - shift) @ turn + rng.normal(0.0, 0.02, (60, 3))
        # Where one target is against the other shows: both are stated 3 mm off along the axis.
        stated = places + np.array([0.0, 0.0, 3.0])
        found = best_frame(rotation, origin, points, at, stated, held=False)[2]
        np.testing.assert_allclose(found, stated, atol=0.05)
