"""In which frame and unit residuals stand: points that an instrument reads in a frame of its own, and angles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from scipy.spatial.transform import Rotation

from monitor.cli import main
from monitor.cli.residual_output import ANGLES
from monitor.discovery.machine.suspects.anomalies import BadPoint
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.workflow.explain.machine_answer import residual_frames
from monitor.workflow.explain.off_answer import frame_of_point
from tests.methods.test_mount_terms import night
from tests.simulator.seen_gantry import seen_gantry


def _problem(folder: Path, *, known: str = "") -> ChainProblem:
    written = seen_gantry(folder, Rotation.from_euler("z", 2.0 * (known == "")), 1)
    text = (written / "campaign.toml").read_text(encoding="utf-8")
    (written / "campaign.toml").write_text(text.replace('reading = "point"', f'reading = "point"\n{known}'))
    campaign = read_campaign(written)
    return campaign_method(campaign).problem_of(campaign)


@pytest.mark.parametrize(
    ("known", "said"), [("", "setup tracker"), ('known = ["frame", "targets"]', "machine")]
)
def test_residuals_of_points_are_in_the_frame_of_their_setup(tmp_path: Path, known: str, said: str) -> None:
    problem = _problem(tmp_path / "seen", known=known)
    assert residual_frames(problem) == dict.fromkeys("xyz", said)


def test_a_bad_point_says_whose_frame_its_axis_is_of(tmp_path: Path) -> None:
    """What is off alike in every run is turned into the frame of the last axis."""
    problem = _problem(tmp_path / "seen")
    point = BadPoint(5, 1, 6, "T2", "x", 0.3, 1e-6)
    assert frame_of_point(point, problem) == "setup tracker"
    assert frame_of_point(replace(point, frame="C"), problem) == "axis C itself"
    assert frame_of_point(replace(point, axis="its place"), problem) is None


@pytest.mark.slow
def test_micrometres_of_angles_are_said_to_be_microradians(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Was: "RMS 18 µm" of a mount. Of points nothing is said."""
    angles = night(tmp_path, 1, stars=30)
    points = seen_gantry(tmp_path / "points", Rotation.identity(), 1)
    database = str(tmp_path / "one.duckdb")
    assert main(["--db", database, "import", str(angles), str(points)]) == 0
    for verb in ("compare", "predict"):
        for folder, is_said in ((angles, True), (points, False)):
            capsys.readouterr()
            assert main(["--db", database, verb, folder.name]) == 0
            assert (ANGLES in capsys.readouterr().out) is is_said
