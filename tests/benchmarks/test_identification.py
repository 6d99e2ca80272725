"""How long the identification of a day's runs takes; run with `pytest tests/benchmarks`."""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from monitor.methods import methods
from monitor.methods.free_form.method import METHOD as free_form
from monitor.methods.model import Model
from monitor.methods.rotary_probing.method import METHOD as rotary_probing
from monitor.methods.samba.method import METHOD as samba
from monitor.readers import read_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _examples() -> list[Path]:
    return sorted(
        path.parent for path in EXAMPLES.glob("*/campaign.toml") if (path.parent / "runs.csv").exists()
    )


@pytest.mark.parametrize("folder", _examples(), ids=lambda folder: folder.name)
def test_every_example(benchmark: Any, folder: Path) -> None:
    """Every method is asked for less than a second a run."""
    campaign = read_campaign(folder)
    found = benchmark(methods()[campaign.method].identify, campaign)
    assert len(found.runs) == len(campaign.runs)


def test_all_44_runs_of_hot_cold(benchmark: Any) -> None:
    """The main job asks for less than a second."""
    campaign = read_campaign(EXAMPLES / "hot-cold")
    found = benchmark(samba.identify, campaign)
    assert len(found.runs) == 44
    assert sum(np.isfinite(run.estimate).sum() for run in found.runs) == 44 * 11


def test_twenty_runs_with_three_effects_in_common(benchmark: Any) -> None:
    campaign = read_campaign(EXAMPLES / "five-days")
    model = Model("grown", added=("EYX:poly2", "EXX:reversal", "EZC1:const@warmup45min"))
    found = benchmark(samba.identify, campaign, model)
    assert np.isfinite(found.added_estimate).all()


def test_free_form_92_points_at_8_angles(benchmark: Any, simulator: Any, tmp_path: Path) -> None:
    """The issue asks for less than 0.2 s."""
    sim = importlib.import_module("simulator.free_form")
    rng, layout, angles = np.random.default_rng(1), sim.cross_pocket(), sim.CASE_2_ANGLES
    truth = sim.draw_truth(layout, angles, rng)
    sim.write_folder(tmp_path, "eight", layout, [sim.probe(layout, angles, truth, rng)])
    found = benchmark(free_form.identify, read_campaign(tmp_path))
    assert len(found.runs[0].residuals) == 736
    assert found.runs[0].refused == ()


def test_rotary_probing_of_154_touches(benchmark: Any) -> None:
    """Less than a second is asked for, for one run; here there are four."""
    campaign = read_campaign(EXAMPLES / "tilting-table")
    found = benchmark(rotary_probing.identify, campaign)
    assert all(np.isfinite(run.estimate).all() for run in found.runs)
