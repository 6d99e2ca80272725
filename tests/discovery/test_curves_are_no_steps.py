"""Steps beside powers follow smooth curves as well: which of them the positions of a laser tell; simulated without the
package."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain, fit
from monitor.discovery.machine.scene import scene_of
from monitor.discovery.machine.shapes.scale_steps import StepsOfError
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "laser"
TRAVEL = 500.0


def lasers(
    folder: Path, seed: int, error: Callable[[float], float], *, positions: int, runs: int = 2
) -> Path:
    """A campaign of lasers along X, Y and Z, each to and fro twice a run, of 0.5 um; X errs by ``error`` in um."""
    rng = np.random.default_rng(seed)
    shift = rng.uniform(-3.0, 3.0, positions) if positions > 40 else np.zeros(positions)
    places = np.sort(np.linspace(0.0, TRAVEL, positions) + shift)
    way = np.concatenate([places, places[::-1]] * 2)
    rows: list[str] = []
    for run in range(1, runs + 1):
        time = 0.0
        for axis in "XYZ":
            gain = rng.normal(0.0, 5e-3)
            for place in way:
                at = {name: place if name == axis else 0.0 for name in "XYZ"}
                reading = place * 1e3 + gain * place + 0.5 * rng.standard_normal()
                reading += error(place) if axis == "X" else 0.0
                time += 60.0
                x, y, z = at.values()
                rows.append(
                    f"{run},{len(rows)},{time},laser-{axis},{y:.4f},0.0,{x:.4f},{z:.4f},{reading:.3f}"
                )
    text = (EXAMPLE / "campaign.toml").read_text(encoding="utf-8")
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    heading = "run,sequence,time_s,setup,y_mm,c_deg,x_mm,z_mm,reading_um"
    (folder / "probings.csv").write_text("\n".join([heading, *rows, ""]), encoding="utf-8")
    heading = "run,started_at,day,warm_up,ambient_degC"
    days = [f"{run},2026-03-{run + 1:02d}T20:00:00+00:00,{run},false," for run in range(1, runs + 1)]
    (folder / "runs.csv").write_text("\n".join([heading, *days, ""]), encoding="utf-8")
    return folder


def told(folder):
    campaign = read_campaign(folder)
    problem = campaign_method(campaign).problem_of(campaign)
    return explain(campaign, problem, "m", rng=np.random.default_rng(1))


def kink(place: float) -> float:
    return 8.0 * max(place - 250.0, 0.0) / 250.0


def decay(place: float) -> float:
    return float(10.0 * np.exp(-place / 80.0))


def root(place: float) -> float:
    return float(15.0 * np.sqrt(place / TRAVEL))


@pytest.mark.slow
@pytest.mark.parametrize("curve", [kink, decay, pytest.param(root, marks=pytest.mark.all_seeds)])
def test_a_smooth_curve_is_no_step_with_powers(tmp_path: Path, curve: Callable[[float], float]) -> None:
    """Steps at 188, 288 and 338 mm and ``EXX:poly2`` were told of a kink; a free shape and a table are any curve."""
    (missing,) = told(lasers(tmp_path, 11, curve, positions=21)).missing
    assert missing.effect.startswith(("EXX:free", "EXX:table"))


@pytest.mark.slow
def test_the_last_position_alone_is_no_step_beyond_the_travel(tmp_path: Path) -> None:
    """A step of three times its size was told between 494 and 509 mm, behind the last position."""
    last = lasers(tmp_path, 12, lambda place: 6.0 * (place > 494.0), positions=41, runs=1)
    assert not any("step" in found.effect for found in told(last).missing)


@pytest.mark.slow
def test_a_step_beside_a_wave_of_its_error_is_of_that_error(tmp_path: Path) -> None:
    """``EBX`` was told as the step: what is told of an error was asked for no steps of it."""

    def both(place: float) -> float:
        return float(8.0 * (place > 262.0) + 3.0 * np.sin(2.0 * np.pi * place / 60.0 + 1.0))

    missing = told(lasers(tmp_path, 13, both, positions=41)).missing
    assert {found.effect.partition(":")[0] for found in missing} == {"EXX"}
    assert sorted(found.effect[4:8] for found in missing) == ["cycl", "step"]


def of_unequal_widths(place: float) -> float:
    """A step over 60 mm about 130 mm, and one at once at 390 mm."""
    return float(5.0 * np.clip((place - 130.0) / 60.0 + 0.5, 0.0, 1.0) + 4.0 * (place > 390.0))


def test_steps_of_unequal_widths_are_each_of_their_own(tmp_path: Path) -> None:
    """Over one width between the two they were told as a table or a free shape."""
    campaign = read_campaign(lasers(tmp_path, 14, of_unequal_widths, positions=31))
    scene = scene_of(fit(campaign_method(campaign).problem_of(campaign).for_search()), [])
    effect = parse_effect("EXX:poly2", scene.fit.problem.context.chain)
    wide, sharp = (each.effect.shape for each in StepsOfError(scene, effect).beside([]))
    assert wide.readings == pytest.approx([130.0], abs=8.0)
    assert wide.width > 40.0
    assert sharp.readings == pytest.approx([390.0], abs=TRAVEL / 30)
    assert sharp.width == 0.0


@pytest.mark.slow
def test_steps_of_unequal_widths_are_told_without_another_effect(tmp_path: Path) -> None:
    missing = told(lasers(tmp_path, 15, of_unequal_widths, positions=31)).missing
    assert missing
    assert all(found.effect.startswith("EXX:step") for found in missing)
