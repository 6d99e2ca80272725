"""A column of positions that stands some rows too late or too early beside its readings is told, with the row."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import find_late_rows, find_late_rows_without_fit, fit
from monitor.methods import campaign_method
from monitor.methods.chain.problem import ChainProblem
from monitor.readers import read_campaign
from monitor.records import Campaign
from tests.simulator.ball_plate import plate_rows, write_plate

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _problem_of(campaign: Campaign) -> ChainProblem:
    method = campaign_method(campaign)
    return method.problem_of(campaign, method.own_model)


def _read(folder: Path) -> Campaign:
    campaign = read_campaign(folder)
    assert isinstance(campaign, Campaign)
    return campaign


def _late(campaign: Campaign, axis: str, rows: int, first: int) -> Campaign:
    """A campaign in which the column of an axis stands so many rows too late from a row on."""
    probings = campaign.probings
    values = probings.readings[axis].copy()
    at = np.arange(first, len(values))
    values[at] = probings.readings[axis][np.clip(at - rows, 0, len(values) - 1)]
    return replace(campaign, probings=replace(probings, readings={**probings.readings, axis: values}))


def _sequence(what: str) -> int:
    found = re.search(r"sequence (\d+)", what)
    assert found is not None
    return int(found[1])


@pytest.mark.parametrize(("axis", "rows", "first"), [("X", 1, 20), ("Z", -2, 250)])
def test_a_column_that_is_late_or_early_from_a_row_on_is_told(axis: str, rows: int, first: int) -> None:
    campaign = _late(_read(EXAMPLES / "laser"), axis, rows, first)
    (mistake,) = find_late_rows_without_fit(campaign, _problem_of)
    count = f"{abs(rows)} row{'s' * (abs(rows) > 1)} too {'late' if rows > 0 else 'early'}"
    assert f"{axis.lower()}_mm stood {count} beside the readings" in mistake.what
    assert abs(_sequence(mistake.what) - (first + 1)) <= 3
    assert mistake.rms_undone < 5e-4


def _table(folder: Path, rng: np.random.Generator) -> Campaign:
    """A ball some 10 µm beside the axis of a table that turns there and back twice, before an R-test of 0.2 µm."""
    degrees = np.tile(np.concatenate([np.arange(0.0, 361.0, 10.0), np.arange(360.0, -1.0, -10.0)]), 2)
    turned = np.exp(-1j * np.deg2rad(degrees)) * 10.0 * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi))
    noise = rng.normal(0.0, 0.2, (len(degrees), 3))
    folder.mkdir()
    (folder / "campaign.toml").write_text(
        'format = 1\ncampaign = "table"\nmethod = "instruments"\n[machine]\nid = "TABLE"\n'
        '[[machine.work_chain]]\nname = "C"\nkind = "rotary"\nabout = "Z"\nsign = -1\n'
        '[[setups]]\nid = "ball"\nreading = "vector"\nframe = "tool"\ntool_point_mm = [0.0, 0.0, 100.0]\n'
        "work_point_mm = [0.0, 0.0, 100.0]\nstandard_uncertainty_um = 0.2\n"
    )
    (folder / "runs.csv").write_text("run,started_at,day,warm_up\n1,2026-03-02T08:00:00+01:00,1,false\n")
    rows = [
        f"1,{row + 1},{6 * row},ball,{angle:.4f},{-at.real + x:.3f},{-at.imag + y:.3f},{z:.3f}"
        for row, (angle, at, (x, y, z)) in enumerate(zip(degrees, turned, noise, strict=True))
    ]
    (folder / "probings.csv").write_text(
        "\n".join(["run,sequence,time_s,setup,c_deg,dx_um,dy_um,dz_um", *rows]) + "\n"
    )
    return _read(folder)


@pytest.mark.parametrize(("rows", "first"), [(1, 50), (-3, 20)])
def test_a_late_angle_of_a_table_is_told_among_micrometres(tmp_path: Path, rows: int, first: int) -> None:
    right = _table(tmp_path / "table", np.random.default_rng(7))
    assert find_late_rows(right, _problem_of, fit(_problem_of(right))) == ()
    campaign = _late(right, "C", rows, first)
    (mistake,) = find_late_rows(campaign, _problem_of, fit(_problem_of(campaign)))
    assert f"c_deg stood {abs(rows)} row" in mistake.what
    assert abs(_sequence(mistake.what) - (first + 1)) <= 4
    assert mistake.rms_undone < 2.5e-4 < mistake.rms_as_recorded


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four-instruments", "hidden-reversal-x", "tracked-robot"])
def test_what_a_machine_hides_is_no_late_column(name: str) -> None:
    campaign = _read(EXAMPLES / name)
    assert find_late_rows(campaign, _problem_of, fit(_problem_of(campaign))) == ()


@pytest.mark.slow
def test_a_late_column_is_told_where_no_fit_holds(tmp_path: Path) -> None:
    campaign = _late(_read(write_plate(tmp_path / "plate", plate_rows(4))), "X", 2, 60)
    (mistake,) = find_late_rows_without_fit(campaign, _problem_of)
    assert "x_mm stood 2 rows too late beside the readings" in mistake.what
    assert abs(_sequence(mistake.what) - 61) <= 2
    assert mistake.rms_undone < 1e-3
