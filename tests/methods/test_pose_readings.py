"""Targets with orientation: six numbers of a reading, against robots made of plain 4x4 matrices."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.discovery import fit
from monitor.discovery.machine.suspects.bad_poses import bad_poses
from monitor.exceptions import CampaignError, DataError
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from monitor.readers.doubts.doubts import column_doubts, doubts
from monitor.records import Array
from monitor.store.record_json import artefact_json, artefact_record
from monitor.workflow.tool_frames import tool_frames
from tests.simulator.robot import frames, point
from tests.simulator.robot_campaign import ELBOW, JOINTS, errors_of_robot, lever_arms

U_UM, U_URAD = 20.0, 60.0
MOUNT, PLACE = Rotation.from_euler("zyx", [100.0, -40.0, 70.0], degrees=True), np.array([90.0, -40.0, 130.0])


def six_numbers(
    folder: Path,
    seed: int,
    *,
    poses: int = 150,
    compliance: float = 0.0,
    edit: tuple[str, str] = ("", ""),
    second: tuple[str, str] = ("", ""),
    scatter: float = 1.0,
) -> Path:
    """A robot of ELBOW's geometry that one body of six numbers is seen on; ``compliance`` is that of J2 in rad/m."""
    rng = np.random.default_rng(seed)
    low, high = np.array([limits for *_, limits in ELBOW]).T
    degrees = np.round(rng.uniform(low, high, (poses, len(ELBOW))), 4)
    readings = {str(joint["name"]): np.deg2rad(degrees[:, index]) for index, joint in enumerate(JOINTS)}
    turn = compliance * lever_arms(readings)["J2"]
    motion = {"J2": np.column_stack([np.zeros((poses, 4)), turn, np.zeros(poses)])}
    tool = frames(JOINTS, readings, errors_of_robot(rng), motion)[-1]
    stand, away = Rotation.random(random_state=rng), np.array([2500.0, -1400.0, 300.0])
    points = stand.inv().apply(point(tool, PLACE) - away) + scatter * rng.normal(0.0, U_UM / 1e3, (poses, 3))
    turns = stand.inv() * Rotation.from_matrix(tool[:, :3, :3]) * MOUNT
    turns = Rotation.from_rotvec(scatter * rng.normal(0.0, U_URAD * 1e-6, (poses, 3))) * turns
    folder.mkdir(parents=True)
    text = 'format = 1\ncampaign = "six"\nmethod = "instruments"\n\n[machine]\nid = "elbow-1"\n'
    for name, axis, offset, sign, _ in ELBOW:
        text += f'\n[[machine.tool_chain]]\nname = "{name}"\nkind = "rotary"\n'
        text += f'about = "{"XYZ"[axis.index(1.0)]}"\noffset_mm = {list(offset)}\nsign = {sign}\n'
    text += '\n[[setups]]\nid = "probe"\nreading = "pose"\n'
    text += f"standard_uncertainty_um = {U_UM}\nstandard_uncertainty_urad = {U_URAD}\n"
    (folder / "campaign.toml").write_text(text.replace(*edit).replace(*second) if edit[0] else text)
    (folder / "runs.csv").write_text("run,started_at,day,warm_up\n1,2026-03-02T08:30:00+01:00,1,false\n")
    head = "run,sequence,time_s,setup," + ",".join(f"{name.lower()}_deg" for name, *_ in ELBOW)
    lines = [head + ",point_x_mm,point_y_mm,point_z_mm,quaternion_w,quaternion_x,quaternion_y,quaternion_z"]
    for row, (pose, at, (x, y, z, w)) in enumerate(zip(degrees, points, turns.as_quat(), strict=True)):
        numbers = ",".join(f"{value:.9g}" for value in (*pose, *at, w, x, y, z))
        lines.append(f"1,{row + 1},{10 * row},probe,{numbers}")
    (folder / "probings.csv").write_text("\n".join(lines) + "\n")
    return folder


def test_six_numbers_of_a_reading_are_fitted_to_their_noise(tmp_path: Path) -> None:
    """N - r degrees of freedom; without noise nothing is left but the ninth digit of the file."""
    campaign = read_campaign(six_numbers(tmp_path / "noisy", 1))
    fitted = fit(campaign_method(campaign).problem_of(campaign))
    rank = int(fitted.solution.rank[0])
    squares = float(np.sum((fitted.vectors / fitted.problem.sigma) ** 2))
    freedom = 6 * 150 - rank
    assert fitted.degrees_of_freedom == freedom
    assert abs(squares - freedom) < 5.0 * np.sqrt(2.0 * freedom)
    exact = read_campaign(six_numbers(tmp_path / "exact", 1, scatter=0.0))
    left = fit(campaign_method(exact).problem_of(exact))
    assert np.abs(left.vectors).max() < 1e-4


def test_mooring_roth_driels_4r_plus_6_parameters_of_whole_poses(tmp_path: Path) -> None:
    """A chain of R turning joints seen with its orientation has 4 R + 6 parameters, frame and tool among them (B.
    Mooring, Z. Roth, M. Driels, Fundamentals of manipulator calibration, 1991, chapter 3); of a point three less."""
    campaign = read_campaign(six_numbers(tmp_path / "six", 3))
    assert int(fit(campaign_method(campaign).problem_of(campaign)).solution.rank[0]) == 30
    point_alone = ('reading = "pose"', 'reading = "point"')
    campaign = read_campaign(
        six_numbers(
            tmp_path / "three", 3, edit=("standard_uncertainty_urad = 60.0\n", ""), second=point_alone
        )
    )
    assert int(fit(campaign_method(campaign).problem_of(campaign)).solution.rank[0]) == 27


def test_a_setup_keeps_the_uncertainty_of_its_turns(tmp_path: Path) -> None:
    artefact = read_campaign(six_numbers(tmp_path / "six", 4, poses=20)).artefact
    assert artefact.setups[0].turn_uncertainty == pytest.approx(60e-6)
    assert artefact_record(artefact_json(artefact)).setups == artefact.setups


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (("standard_uncertainty_urad = 60.0\n", ""), "write standard_uncertainty_urad of setup 'probe'"),
        (("standard_uncertainty_um = 20.0\n", ""), "write standard_uncertainty_um of setup 'probe'"),
    ],
)
def test_a_pose_needs_both_uncertainties(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        read_campaign(six_numbers(tmp_path / "six", 5, poses=12, edit=edit))


def test_a_quaternion_has_length_one(tmp_path: Path) -> None:
    folder = six_numbers(tmp_path / "six", 6, poses=12)
    rows = (folder / "probings.csv").read_text().splitlines()
    cells = rows[4].split(",")
    rows[4] = ",".join([*cells[:-1], "1.5"])
    (folder / "probings.csv").write_text("\n".join(rows))
    with pytest.raises(CampaignError, match=r"the quaternion has length .*; a quaternion has length 1"):
        read_campaign(folder)


@pytest.mark.parametrize("reading", ["pose", "point"])
def test_points_in_metres_are_refused_as_of_a_tracker(tmp_path: Path, reading: str) -> None:
    """The fit followed them by a robot that is shrunk to a point, and said so with numbers and u."""
    edits = {"pose": ("", ""), "point": ("standard_uncertainty_urad = 60.0\n", "")}
    second = ('reading = "pose"', f'reading = "{reading}"')
    folder = six_numbers(tmp_path / "six", 8, poses=40, edit=edits[reading], second=second)
    _altered(folder, lambda rows, _: rows / 1e3)
    campaign = read_campaign(folder)
    assert any(
        "point_x_mm, point_y_mm and point_z_mm of setup probe span" in told
        for told in doubts(campaign, tool_frames(campaign))
    )
    with pytest.raises(DataError, match=r"99\d times as large .* units of point_x_mm, .* of setup probe"):
        campaign_method(campaign).problem_of(campaign)


def test_points_of_other_poses_do_not_belong_to_the_joints(tmp_path: Path) -> None:
    folder = six_numbers(tmp_path / "six", 9, poses=60)
    _altered(folder, lambda rows, rng: rng.permutation(rows))
    campaign = read_campaign(folder)
    assert doubts(campaign, tool_frames(campaign)) == ()
    with pytest.raises(
        DataError, match=r"do not belong together row by row: .* of setup probe stands beside"
    ):
        campaign_method(campaign).problem_of(campaign)


def test_a_bad_pose_says_its_place_and_its_turn_apart(tmp_path: Path) -> None:
    """2 mm and nothing else: the norm over all six numbers was told as what the place is off by."""
    folder = six_numbers(tmp_path / "six", 11, poses=60)
    _altered(folder, lambda rows, _: rows + 2.0 * (np.arange(len(rows)) == 17)[:, None] * [0.0, 0.6, 0.8])
    campaign = read_campaign(folder)
    (bad,) = bad_poses(fit(campaign_method(campaign).problem_of(campaign)))
    assert (bad.sequence, bad.axis) == (18, "its place")
    assert bad.turn is not None
    assert 1.0 < bad.size < 2.2
    assert bad.turn < 8.0 * U_URAD * 1e-6


def test_points_at_zero_are_named_by_their_rows(tmp_path: Path) -> None:
    """A refusal named nothing but the signs of the axes."""
    folder = six_numbers(tmp_path / "six", 12, poses=40)
    is_zero = np.isin(np.arange(40), [10, 11, 12])
    _altered(folder, lambda rows, _: np.where(is_zero[:, None], 0.0, rows))
    campaign = read_campaign(folder)
    (told,) = column_doubts(campaign, tool_frames(campaign))
    assert told.startswith(
        "setup probe: 3 rows have the point 0, 0, 0 at different poses (run 1, sequence 11, 12, 13)"
    )
    once = six_numbers(tmp_path / "once", 12, poses=40)
    _altered(once, lambda rows, _: np.where((np.arange(40) == 10)[:, None], 0.0, rows))
    campaign = read_campaign(once)
    assert column_doubts(campaign, tool_frames(campaign)) == ()


def _altered(folder: Path, alter: Callable[[Array, np.random.Generator], Array]) -> None:
    """Put what ``alter`` makes of the points (n, 3) of a folder in their place."""
    head, *lines = (folder / "probings.csv").read_text().splitlines()
    cells = np.array([line.split(",") for line in lines], dtype=object)
    first = head.split(",").index("point_x_mm")
    cells[:, first : first + 3] = alter(
        cells[:, first : first + 3].astype(float), np.random.default_rng(10)
    ).astype(str)
    (folder / "probings.csv").write_text("\n".join([head, *(",".join(row) for row in cells)]) + "\n")
