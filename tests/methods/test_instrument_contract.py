"""Every kind of reading: its Jacobian against differences, and what it predicts against a simulator of its own.

The machine and its readings are those of ``test_instruments``, simulated by ``tests/simulator/instruments.py`` without
a line of the package.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.methods.instruments.readings import readings
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.methods.test_instruments import (
    MACHINE,
    OFF,
    SETUPS,
    TOOL,
    at,
    machine_campaign,
    tool_point,
)


class Silent(np.random.Generator):
    """Draws the poses of a plan and no noise."""

    def __init__(self) -> None:
        super().__init__(np.random.PCG64(5))

    def normal(self, loc: float = 0.0, scale: float = 1.0, size: object = None) -> object:  # type: ignore[override]
        """Nothing."""
        return np.zeros(size) if size is not None else 0.0  # type: ignore[call-overload]


def test_the_contract_has_every_kind() -> None:
    # A pose needs a body of its own on the tool: test_pose_readings.py.
    assert {kind for kind, *_ in SETUPS.values()} == set(readings()) - {"pose"}


@pytest.mark.parametrize("name", SETUPS)
def test_the_jacobian_is_that_of_differences(name: str, tmp_path: Path) -> None:
    """Central differences of 1e-6 mm or rad: what is left is rounding, 1e-6 of the largest derivative of its column."""
    problem = campaign_method(machine_campaign(tmp_path, name)).problem_of(
        machine_campaign(tmp_path / "b", name)
    )
    rng = np.random.default_rng(1)
    free = solve_problem(problem)
    local = free.local + rng.normal(0.0, 1e-5, free.local.shape)
    jacobian = problem.linearise(local, problem.common_start).local[0]
    for column, unknown in enumerate(problem.local_names):
        step = np.zeros_like(local)
        step[0, column] = 1e-6
        plus, minus = (
            problem.linearise(local + sign * step, problem.common_start).residual[0] for sign in (1, -1)
        )
        numeric = (plus - minus) / 2e-6
        size = max(np.abs(numeric).max(), 1.0)
        # Turns that a kind reads are right to second order in themselves (angle.py).
        np.testing.assert_allclose(jacobian[:, column], numeric, rtol=0, atol=2e-5 * size, err_msg=unknown)


@pytest.mark.parametrize("name", SETUPS)
def test_without_noise_nothing_is_left(name: str, tmp_path: Path) -> None:
    """The simulator's readings are the model's to a nanometre (a nanoradian): so are all products of its errors."""
    campaign = machine_campaign_without_noise(tmp_path, name)
    problem = campaign_method(campaign).problem_of(campaign)
    solution = solve_problem(problem)
    vectors = problem.vectors(solution.local, solution.common)
    assert np.abs(vectors[np.isfinite(problem.sigma)]).max() < 1e-6


def machine_campaign_without_noise(folder: Path, *names: str) -> Campaign:
    text, rows = "", []
    for name in names:
        kind, keys, made = SETUPS[name]
        text += f'\n[[setups]]\nid = "{name}"\nreading = "{kind}"\n{keys}\n'
        rows += [{"setup": name, **row} for row in made(Silent())]
    return read_campaign(MACHINE.write(folder / "machine", text, rows))


CENTRE = np.array([300.0, 200.0, 50.0])


def swing(folder: Path, plane: tuple[int, int], centre: str = "", *, seed: int = 2) -> Campaign:
    """A ball bar of 150 mm swung in a plane about a centre that lies 20 µm beside the stated one."""
    rng = np.random.default_rng(seed)
    rows = []
    for angle in np.deg2rad(np.arange(0.0, 361.0, 5.0)):
        arm = np.zeros(3)
        arm[plane[0]], arm[plane[1]] = 150.0 * np.cos(angle), 150.0 * np.sin(angle)
        place = arm + CENTRE - TOOL
        readings_ = at(X=place[0], Y=place[1], Z=place[2])
        length = np.linalg.norm(tool_point(readings_) - CENTRE - 2.0 * OFF) - 150.0
        rows.append({"setup": "bar", **readings_, "reading_um": 1e3 * length + rng.normal(0.0, 0.3)})
    setups = (
        '\n[[setups]]\nid = "bar"\nreading = "distance"\nstandard_uncertainty_um = 0.3\nlength_mm = 150.0\n'
    )
    setups += f"length_standard_uncertainty_um = 0.3\ntool_point_mm = [0.0, 0.0, -120.0]\n{centre}"
    return read_campaign(MACHINE.write(folder / "bar", setups, rows))


@pytest.mark.parametrize("centre", ["work_point_mm = [300.0, 200.0, 50.0]\n", ""])
@pytest.mark.parametrize("plane", [(0, 1), (1, 2), (2, 0)])
def test_a_bar_swung_in_one_plane_is_fitted_to_its_noise(
    plane: tuple[int, int], centre: str, tmp_path: Path
) -> None:
    """Across its plane such a bar sees nothing of its centre; a centre that nobody states is found."""
    campaign = swing(tmp_path, plane, centre)
    run = campaign_method(campaign).identify(campaign).runs[0]
    assert abs(run.chi_square - run.degrees_of_freedom) < 5.0 * np.sqrt(2.0 * run.degrees_of_freedom)
    squareness = {(0, 1): "EC0Y", (1, 2): "EA0Z", (2, 0): "EB0Z"}[plane]
    result = campaign_method(campaign).identify(campaign)
    index = result.parameters.index(squareness)
    truth = {"EC0Y": 40e-6, "EA0Z": -25e-6, "EB0Z": 30e-6}[squareness]
    assert abs(run.estimate[index] - truth) < 4.0 * np.sqrt(run.covariance[index, index])


def test_all_kinds_in_one_campaign_converge_at_once(tmp_path: Path) -> None:
    campaign = machine_campaign(tmp_path, *SETUPS)
    result = campaign_method(campaign).identify(campaign)
    run = result.runs[0]
    assert result.iterations <= 8
    assert abs(run.chi_square - run.degrees_of_freedom) < 5.0 * np.sqrt(2.0 * run.degrees_of_freedom)


def test_the_cosine_error_of_a_beam_counts_in_the_gain(tmp_path: Path) -> None:
    """A beam known to 1 mrad in two directions makes 1 µm/m of gain unsure: chi-square of two degrees of freedom."""
    alone = machine_campaign(tmp_path / "alone", "laser")
    result = campaign_method(alone).identify(alone)
    index = result.parameters.index("EXX")
    assert np.sqrt(result.runs[0].covariance[index, index]) == pytest.approx(1e-6, rel=0.2)


def test_readings_of_another_machine_are_refused(tmp_path: Path) -> None:
    """A dial whose readings wave by 20 mm: no error of a machine that travels by 400 mm."""
    machine_campaign(tmp_path, "dial")
    path = tmp_path / "machine" / "probings.csv"
    head, *lines = path.read_text().splitlines()
    wrong = [
        f"{line.rpartition(',')[0]},{float(line.rpartition(',')[2]) + 2e4 * (-1) ** number}"
        for number, line in enumerate(lines)
    ]
    path.write_text("\n".join([head, *wrong]) + "\n")
    campaign = read_campaign(path.parent)
    with pytest.raises(
        DataError, match="contradict the machine file: setup dial: after the fit its readings are off"
    ):
        campaign_method(campaign).identify(campaign)
