"""Of two errors of an axis that differ by less than the readings tell that of the drive leads.

Simulated by ``tests/simulator/instruments.py``, which shares no line with the package.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.separation.drive_first import drive_first
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.evidence import weigh_beside
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.readers import read_campaign
from tests.simulator.instruments import WAYS, SimulatedAxis, SimulatedChain, laser


def scene_with(folder: Path, heights: float, seed: int) -> ChainScene:
    """A laser along X below its slide, whose distance to it varies by the ``heights`` in mm; hidden is a square."""
    rng = np.random.default_rng(seed)
    bend = lambda x: (8e-3 * (x / 300.0) ** 2, 0.0, 0.0, 0.0, 0.0, 0.0)  # noqa: E731
    axes = [SimulatedAxis(name, "linear", way) for name, way in WAYS.items() if name != "X"]
    chain = SimulatedChain((SimulatedAxis("X", "linear", WAYS["X"], motion=bend), *axes))
    rows: list[dict[str, object]] = []
    there = np.linspace(-300.0, 300.0, 13)
    for run in (1, 2, 3):
        for x in np.r_[there, there[::-1]].tolist():
            at = {"X": x, "Y": 0.0, "Z": float(rng.uniform(-heights, heights))}
            seen = 1e3 * float((chain.pose(at) @ [0.0, 0.0, -150.0, 1.0])[0]) + rng.normal(0.0, 0.5)
            rows.append({"run": run, "setup": "laser", "reading_um": round(seen, 3)} | at)
    days = [f"2026-03-{day:02d}T20:00:00+00:00" for day in (2, 3, 4)]
    campaign = read_campaign(chain.write(folder, laser(tool=(0.0, 0.0, -150.0)), rows, started=days))
    fitted = fit(campaign_method(campaign).problem_of(campaign).for_search())
    texts = ("EXX:poly2", "EBX:poly2")
    return scene_of(
        fitted, [Variant(text, parse_effect(text, fitted.problem.context.chain)) for text in texts]
    )


def leading(scene: ChainScene) -> str:
    """What leads where the scan selected the tilt."""
    (_, tilt) = scene.candidates
    _, result = drive_first(scene, ScanResult(findings_of(scene, [tilt])))
    (finding,) = result.findings
    return finding.candidate.family


def test_the_drive_leads_where_the_arm_varies_by_micrometres(tmp_path: Path) -> None:
    """Chance made the tilt say more: 0.03 mm of arm are 1 nm, far more than rounding."""
    led = []
    for seed in range(4):
        scene = scene_with(tmp_path / f"{seed}", 0.03, seed)
        best, other = weigh_beside(scene, scene.candidates, [])
        assert 1e-6 < abs(best.explained - other.explained) < 0.1
        led.append(best.candidate.family)
        assert leading(scene) == "EXX:poly2"
    assert "EBX:poly2" in led


def test_what_the_data_tell_they_tell(tmp_path: Path) -> None:
    assert leading(scene_with(tmp_path / "far", 60.0, 0)) == "EBX:poly2"


@pytest.mark.slow
def test_the_positioning_of_an_axis_is_told_before_its_tilt(virtual_campaigns, explained) -> None:
    """Nothing else of what is found changes where the data tell errors apart."""
    from by_path import simulator

    hidden = simulator().Effect("EBX:poly3", peak_um=8.0)
    campaign, _ = virtual_campaigns.virtual(77, [hidden], days=2)
    (found,) = explained(campaign).missing
    assert found.effect == "EBX:poly3"
