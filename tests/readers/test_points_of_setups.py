"""Points that instruments read of a head: what is refused as zeros or metres, and what only looks like it."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from monitor.exceptions import CampaignError
from monitor.readers import doubts, read_campaign
from monitor.readers.doubts.unit_doubts import off_places
from monitor.records import Array, Campaign
from monitor.workflow.tool_frames import tool_frames
from tests.simulator.seen_gantry import seen_gantry

HEAD = 'format = 1\ncampaign = "head"\nmethod = "instruments"\n[machine]\nid = "head"\n'
LINEAR = '[[machine.tool_chain]]\nname = "{0}"\nkind = "linear"\nalong = "{0}"\n'
ROTARY = '[[machine.tool_chain]]\nname = "{0}"\nkind = "rotary"\nabout = "{1}"\n'
SETUP = (
    '[[setups]]\nid = "p"\nreading = "point"\nstandard_uncertainty_um = 2.0\ntool_point_mm = [0.0, 0.0, {0}]\n'
    "known = [{1}]\n"
)
LENGTH = 180.0


def told(folder: Path, tips: Array, points: Array, *, stated: float = LENGTH, known: str = "") -> list[str]:
    """What is said of a head whose tip, 180 mm below its axes, stood at ``tips`` (n, 3) and was read at ``points``."""
    rng = np.random.default_rng(3)
    angles = rng.uniform([-180.0, -60.0], [180.0, 60.0], (len(tips), 2)).round(4)
    arms = Rotation.from_euler("ZY", angles, degrees=True).apply([0.0, 0.0, -LENGTH])
    # A nominal chain knows nothing of what the machine does wrong.
    axes = tips - arms + rng.normal(0.0, 20e-3, tips.shape)
    chain = "".join(LINEAR.format(axis) for axis in "XYZ") + ROTARY.format("C", "Z") + ROTARY.format("B", "Y")
    (folder / "campaign.toml").write_text(HEAD + chain + SETUP.format(-stated, known), encoding="utf-8")
    (folder / "runs.csv").write_text(
        "run,started_at,day,warm_up\n1,2025-02-01T08:00:00+00:00,1,false\n", encoding="utf-8"
    )
    lines = ["run,sequence,time_s,setup,target,x_mm,y_mm,z_mm,c_deg,b_deg,point_x_mm,point_y_mm,point_z_mm"]
    for row, numbers in enumerate(np.hstack([axes, angles, points]), start=1):
        lines.append(f"1,{row},{20 * row},p,tip," + ",".join(f"{number:.5f}" for number in numbers))
    (folder / "probings.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return [text for text in doubts(campaign, tool_frames(campaign)) if "zeros" in text or "metres" in text]


def anywhere(rows: int = 40) -> Array:
    return np.random.default_rng(5).uniform(-200.0, 200.0, (rows, 3))


@pytest.mark.parametrize("stated", [LENGTH, LENGTH + 2.0, 0.0])
@pytest.mark.parametrize("known", ["", '"targets", "scale"'])
def test_a_nest_at_the_frame_s_origin_is_no_row_of_zeros(tmp_path: Path, stated: float, known: str) -> None:
    """Was: 12 honest rows "left out", touched at 12 angles of a head; wherever the tip is on the tool."""
    nests = np.repeat([[0.0, 0.0, 0.0], [150.0, 0.0, 0.0], [0.0, 150.0, 0.0], [150.0, 150.0, 120.0]], 12, 0)
    assert told(tmp_path, nests + np.array([400.0, 300.0, 500.0]), nests, stated=stated, known=known) == []


@pytest.mark.parametrize("known", ["", '"targets", "scale"'])
@pytest.mark.parametrize("zeros", [3, 5, 22])
def test_zeros_where_the_tip_is_elsewhere_are_named(tmp_path: Path, known: str, zeros: int) -> None:
    """Was: nothing of a tracker with known targets, nor where most rows are zeros."""
    tips = anywhere()
    points = np.where(np.arange(len(tips))[:, None] < zeros, 0.0, tips)
    (sentence,) = told(tmp_path, tips, points, known=known)
    assert sentence.startswith(
        f"setup p: {zeros} rows have the point 0, 0, 0 at different poses (run 1, sequence 1, "
    )


@pytest.mark.parametrize("stated", [LENGTH, 0.0])
def test_a_tip_that_the_axes_keep_in_place_is_not_read_in_metres(tmp_path: Path, stated: float) -> None:
    """Was: "Readings in metres look like this" of an RTCP test, whose camera reads micrometres."""
    tips = np.tile([812.0, -340.0, 210.0], (40, 1))
    points = tips + np.random.default_rng(7).normal(0.0, 3e-3, tips.shape)
    assert told(tmp_path, tips, points, stated=stated) == []


def test_points_in_metres_are_named_where_the_axes_moved_the_tip(tmp_path: Path) -> None:
    (sentence,) = told(tmp_path, anywhere(), anywhere() / 1000.0)
    assert "point_x_mm, point_y_mm and point_z_mm of setup p span 0.39" in sentence


def test_a_setup_whose_rows_cannot_be_read_is_not_said_to_have_none(tmp_path: Path) -> None:
    """Was: "setup 'p' has no row in probings.csv" beside forty faults of its forty rows."""
    told(tmp_path, anywhere(), anywhere())
    file = tmp_path / "probings.csv"
    header, *rows = file.read_text(encoding="utf-8").splitlines()
    spoilt = [",".join([*row.split(",")[:5], "1:2", *row.split(",")[6:]]) for row in rows]
    file.write_text("\n".join([header, *spoilt]) + "\n", encoding="utf-8")
    with pytest.raises(CampaignError, match="'1:2' is not a number") as refused:
        read_campaign(tmp_path)
    assert {fault.file for fault in refused.value.faults} == {"probings.csv"}


def test_a_setup_of_which_no_row_names_a_target_is_its_own(tmp_path: Path) -> None:
    """Was: "'' is not a name" of a laser beside a plate, whose balls have names."""
    example = Path(__file__).resolve().parents[2] / "examples" / "four-instruments"
    folder = shutil.copytree(example, tmp_path / "named")
    rows = list(csv.DictReader((folder / "probings.csv").read_text(encoding="utf-8").splitlines()))

    def with_targets(target: Callable[[int, str], str]) -> Campaign:
        with (folder / "probings.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, [*rows[0], "target"])
            writer.writeheader()
            writer.writerows(
                {**row, "target": target(number, row["setup"])} for number, row in enumerate(rows)
            )
        campaign = read_campaign(folder)
        assert isinstance(campaign, Campaign)
        return campaign

    named = with_targets(lambda _, setup: setup)
    empty = with_targets(lambda _, setup: "" if setup.startswith("laser") else setup)
    assert empty.probings.target.tolist() == named.probings.target.tolist()
    with pytest.raises(CampaignError, match=r"line 3, column target: '' is not a name"):
        with_targets(lambda number, setup: "" if number == 1 else setup)


def test_places_on_the_tool_are_no_distances_that_the_axes_go(tmp_path: Path) -> None:
    """Was: "the distances between points that were probed are 0 times the declared ones" of two reflectors on a head
    whose places each row states."""
    campaign = read_campaign(seen_gantry(tmp_path / "seen", Rotation.from_euler("z", 1.0), 1))
    assert isinstance(campaign, Campaign)
    assert off_places(campaign) is None
    assert doubts(campaign, tool_frames(campaign)) == ()
