"""A ball plate on a measuring machine of three axes: what it shows whose height the plate's certificate states as zero
or not at all. Simulated here with numpy alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from monitor.exceptions import DataError
from monitor.methods import campaign_method
from monitor.methods.method import ChainMethod
from monitor.readers import doubts, read_campaign
from monitor.records import Campaign
from monitor.workflow.tool_frames import tool_frames

AXIS = '[[machine.tool_chain]]\nname = "{0}"\nkind = "linear"\nalong = "{0}"\n'
SETUP = """[[setups]]
id = "plate-{0}"
reading = "point"
instrument = "ball plate"
standard_uncertainty_um = 0.5
known = ["scale", "targets"]
"""
LYING = np.eye(3)
STANDING_XZ = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
STANDING_YZ = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
#: µm/m and µrad.
TRUTH = {"EXX": 12.0, "EYY": -8.0, "EZZ": 15.0, "EC0X": 20.0, "EB0Z": -14.0, "EA0Z": 9.0}


def about_z(degrees: float) -> np.ndarray:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def campaign_of(
    folder: Path, placements: Sequence[np.ndarray], seed: int, height: str, told: str | None = None
) -> Path:
    """A plate of 25 balls, 83 mm apart, whose z the certificate states as ``height``, read once in every placement;
    Z stands where it is ``told``, else where it finds the ball."""
    rng = np.random.default_rng(seed)
    error = {name: value * 1e-6 for name, value in TRUTH.items()}
    # Columns: where one mm of x, y and z leads the probe.
    leads = np.eye(3) + np.array(
        [
            [error["EXX"], 0.0, error["EB0Z"]],
            [error["EC0X"], error["EYY"], -error["EA0Z"]],
            [0.0, 0.0, error["EZZ"]],
        ]
    )
    i, j = np.meshgrid(np.arange(5), np.arange(5))
    balls = np.stack([83.0 * i.ravel(), 83.0 * j.ravel(), np.zeros(25)], axis=1)
    balls[:, :2] += np.round(rng.normal(0.0, 0.02, (25, 2)), 5)
    rows = []
    for number, turn in enumerate(placements):
        slight = np.eye(3) + np.cross(np.eye(3), rng.normal(0.0, 3e-4, 3))
        placed = balls @ (turn @ slight).T + [300.0, 200.0, 150.0]
        read = placed @ np.linalg.inv(leads).T + rng.normal(0.0, 0.5e-3, placed.shape)
        for ball, at in zip(balls, read, strict=True):
            place = (
                f"{at[0]:.5f},{at[1]:.5f},{at[2]:.5f}" if told is None else f"{at[0]:.5f},{at[1]:.5f},{told}"
            )
            rows.append(f"plate-{number},{place},{ball[0]:.5f},{ball[1]:.5f},{height}")
    folder.mkdir(exist_ok=True)
    setups = "".join(SETUP.format(number) for number in range(len(placements)))
    head = 'format = 1\ncampaign = "cmm"\nmethod = "instruments"\n[machine]\nid = "cmm"\n'
    (folder / "campaign.toml").write_text(head + "".join(map(AXIS.format, "YXZ")) + setups, encoding="utf-8")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up,ambient_degC\n1,2026-03-02T08:00:00+00:00,1,false,20.0\n",
        encoding="utf-8",
    )
    columns = "run,sequence,time_s,setup,x_mm,y_mm,z_mm,point_x_mm,point_y_mm,point_z_mm"
    lines = [f"1,{count},{10 * count},{row}" for count, row in enumerate(rows, start=1)]
    (folder / "probings.csv").write_text("\n".join([columns, *lines]) + "\n", encoding="utf-8")
    return folder


def off(folder: Path) -> dict[str, float]:
    """How far every number is off the truth, in its standard uncertainties, all of which are below 3 µm/m or µrad."""
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    method = campaign_method(campaign)
    assert isinstance(method, ChainMethod)
    identified = method.identify(campaign)
    (run,) = identified.runs
    u = 1e6 * np.sqrt(np.diag(run.covariance))
    numbers = zip(identified.parameters, 1e6 * run.estimate, u, strict=True)
    return {name: (value - TRUTH[name]) / u for name, value, u in numbers if u < 3.0}


@pytest.mark.parametrize("height", ["", "0.00000"])
@pytest.mark.parametrize("seed", range(3))
def test_a_plate_lying_and_upright_gives_all_numbers(tmp_path: Path, seed: int, height: str) -> None:
    """Was: "did not converge", columns exchanged or in metres, or no number of EXX, EYY and EC0X."""
    found = off(campaign_of(tmp_path, [LYING, STANDING_XZ, STANDING_YZ], seed, height))
    assert set(found) == set(TRUTH)
    assert max(map(abs, found.values())) < 4.0


@pytest.mark.parametrize("height", ["", "0.00000"])
@pytest.mark.parametrize("placements", [[LYING], [LYING, about_z(90.0)], [about_z(40.0)]])
def test_a_plate_that_lies_gives_those_of_its_plane(
    tmp_path: Path, placements: list[np.ndarray], height: str
) -> None:
    found = off(campaign_of(tmp_path, placements, 1, height))
    assert set(found) == {"EXX", "EYY", "EC0X"}
    assert max(map(abs, found.values())) < 4.0


@pytest.mark.parametrize(
    ("factor", "said"),
    [(1e-3, "readings were in metres or its positions were in µm"), (1.0 / 25.4, "readings were in inches;")],
)
def test_points_in_another_unit_are_named_as_such(tmp_path: Path, factor: float, said: str) -> None:
    """Of points in metres it was said that the unit of the readings were µm."""
    table = campaign_of(tmp_path, [LYING], 1, "") / "probings.csv"
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines):
        cells = line.split(",")
        cells[7:9] = [f"{factor * float(cell):.9f}" for cell in cells[7:9]]
        lines[number] = ",".join(cells)
    table.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    with pytest.raises(DataError, match=said):
        off(tmp_path)


def unknowns_of(folder: Path) -> int:
    """How many unknowns the frame of the first setup has."""
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    problem = campaign_method(campaign).problem_of(campaign)
    return len(problem.parts[0].unknowns)


def test_a_height_that_axes_measured_is_a_statement_and_one_they_were_told_is_none(tmp_path: Path) -> None:
    """With it the frame of a plate has three turns and three shifts, in a plane one and two."""
    assert unknowns_of(campaign_of(tmp_path, [LYING], 1, "0.00000")) == 6
    assert unknowns_of(campaign_of(tmp_path, [LYING], 1, "")) == 3
    assert unknowns_of(campaign_of(tmp_path, [LYING], 1, "0.00000", told="150.0000")) == 3


def without_known_tip(folder: Path) -> Path:
    """The folder with the place of the tip unknown."""
    setup = folder / "campaign.toml"
    text = setup.read_text(encoding="utf-8").replace('known = ["scale", "targets"]', 'known = ["scale"]')
    setup.write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("jitter", [0.2e-3, 0.5e-3])
@pytest.mark.parametrize("equal", [False, True])
def test_a_height_that_was_written_beside_measured_points_is_none_though_z_jitters(
    tmp_path: Path, jitter: float, equal: bool
) -> None:
    """Was: an error of Z (``EZZ:lag``), where nobody touched across the plate; also where two rows are ``equal``."""
    folder = without_known_tip(campaign_of(tmp_path, [LYING], 1, "0.00000", told="150.0000"))
    table = folder / "probings.csv"
    rng = np.random.default_rng(3)
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines):
        cells = line.split(",")
        cells[6] = f"{150.0 + rng.normal(0.0, jitter):.5f}"
        cells[7:9] = [f"{float(cell) + rng.normal(0.0, 0.5e-3):.5f}" for cell in cells[7:9]]
        lines[number] = ",".join(cells)
    if equal:
        lines.append(",".join(["1", "26", "260", *lines[-1].split(",")[3:]]))
    table.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    assert unknowns_of(folder) == 6  # One turn, two shifts, and the place of the tip.


@pytest.mark.parametrize("placement", [LYING, STANDING_XZ])
def test_a_height_that_axes_measured_once_is_a_statement_without_a_known_tip(
    tmp_path: Path, placement: np.ndarray
) -> None:
    """Was: no number, where no ball was touched twice. Nobody tells axes to go along a plate that lies askew."""
    folder = without_known_tip(campaign_of(tmp_path, [placement], 1, "0.00000"))
    assert unknowns_of(folder) == 9


def test_a_ball_at_the_origin_of_its_plate_is_no_row_of_zeros(tmp_path: Path) -> None:
    """Was: "zeros that a program writes where it got no reading", where a plate had been turned on the table."""
    folder = campaign_of(tmp_path, [LYING], 1, "0.00000")
    table = folder / "probings.csv"
    head, first, *lines = table.read_text(encoding="utf-8").splitlines()
    cells = [*first.split(",")[:7], "0.00000", "0.00000", "0.00000"]
    elsewhere = [cells[0], "100", "9999.0", cells[3], "400.0", *cells[5:]]
    table.write_text("\n".join([head, ",".join(cells), *lines, ",".join(elsewhere)]) + "\n", encoding="utf-8")
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    assert not any("zeros" in doubt for doubt in doubts(campaign, tool_frames(campaign)))
