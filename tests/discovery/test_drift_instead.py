"""Balls that shift with their table within every run, touched in one order: a drift looks like a shape of an axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from monitor.discovery.machine.fit import Fit
from monitor.discovery.machine.scene import ChainScene, scene_of
from monitor.discovery.machine.separation.rivals import RivalSearch, same_drift
from monitor.discovery.machine.shapes.drift_instead import drift_instead
from monitor.discovery.search.candidate import Variant
from monitor.discovery.search.scan import ScanResult, findings_of
from monitor.effects import parse_effect
from monitor.machine import parse_topology
from monitor.readers import read_campaign
from tests.discovery.ordered_balls import touched


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """8 µm along Z of the table within every run."""
    return touched(tmp_path_factory.mktemp("drifting"), drift=8e-3)


def scene_with(fitted: Fit, *texts: str) -> ChainScene:
    chain = fitted.problem.context.chain
    return scene_of(fitted, [Variant(text, parse_effect(text, chain)) for text in texts])


@pytest.mark.parametrize(
    ("accepted", "told"), [(True, ["EZB:const@run_time"]), (False, ["EZB:free(1,2,3,4,5,6)"])]
)
def test_a_drift_stands_in_place_of_a_free_shape(drifting: Fit, accepted: bool, told: list[str]) -> None:
    """Was: EZB:free(2,3,12,16,23,36), of six parts, without the drift among its rivals."""
    scene = scene_with(drifting, "EZB:free(1,2,3,4,5,6)")
    result = ScanResult(findings_of(scene, scene.candidates))
    _, after = drift_instead(scene, result, ("run_time",), lambda others, single: accepted)
    assert [candidate.effect.text for candidate in after.candidates] == told


def test_a_drift_has_the_same_of_the_other_axes_among_its_rivals(drifting: Fit) -> None:
    """Was: EZY:const@x_axis_degC, alone; EZX and EZZ are exactly alike there, and are not searched."""
    scene = scene_with(drifting, "EZY:const@run_time")
    (drift,) = scene.candidates
    found = RivalSearch(scene, [drift], ("run_time",)).rivals(0, 0.0, np.array([8e-3]))
    alike = {rival.effect.text for rival, same in found if same}
    assert {"EZX:const@run_time", "EZZ:const@run_time"} <= alike


def test_a_drift_with_the_time_is_that_of_no_spindle_alone() -> None:
    """Was: EZC1:const@run_time without EZX:const@run_time, which was hidden; growth as it warms up is the spindle's."""
    chain = parse_topology("w C B b X Y Z (C1) t")
    drift, growth = (parse_effect(f"EZC1:const@{driver}", chain) for driver in ("run_time", "warmup"))
    assert "EZX:const@run_time" in {variant.family for variant in same_drift(drift, chain)}
    assert same_drift(growth, chain) == []


@pytest.mark.slow
@pytest.mark.parametrize("drift", [pytest.param(8e-3, marks=pytest.mark.all_seeds), 3e-3])
def test_a_drift_of_a_table_is_told_as_that(tmp_path: Path, drift: float) -> None:
    problem = touched(tmp_path, drift=drift).problem
    answer = explain(read_campaign(tmp_path), problem, "rotary-probing", rng=np.random.default_rng(1))
    (missing,) = answer.missing
    assert "EZB:const@run_time" in {missing.effect, *(rival.effect for rival in missing.rivals)}
    assert abs(missing.amplitude - drift) < 3.0 * missing.u
