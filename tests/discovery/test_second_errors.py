"""Two errors of which one has no shape of the catalogue, a wave of a guideway across, and growth of a ram.

The readings come from the independent simulator.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Explanation, explain
from monitor.effects.catalogue import of_ram
from monitor.machine import parse_topology
from monitor.methods.chain.base_effects import base_effects
from monitor.methods.model import Model
from monitor.methods.samba.method import problem_of


def wave(pitch: float) -> Any:
    """The curve of a wave of the position."""
    return lambda q, travel, now: np.sin(2.0 * np.pi * q / pitch)


def _of_two(virtual_campaigns: ModuleType, seed: int) -> tuple[Explanation, Any]:
    sim = simulator()
    hidden = [
        sim.Effect("EYY:reversal", peak_um=4.0),
        sim.Effect("EZX:curve", peak_um=3.0, curve=wave(160.0)),
    ]
    campaign, _ = virtual_campaigns.virtual(seed, hidden, days=2, runs_per_day=3)
    return explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1)), campaign


@pytest.mark.all_seeds
def test_beside_a_right_effect_an_unknown_shape_is_not_told_as_several_others(
    virtual_campaigns: ModuleType, seeds: Any
) -> None:
    for seed in seeds(30, 1):
        answer, campaign = _of_two(virtual_campaigns, seed)
        assert {found.effect.partition(":")[0] for found in answer.missing} == {"EYY", "EZX"}, seed
        grown = Model("grown", added=tuple(found.effect for found in answer.missing))
        beyond = explain(campaign, problem_of(campaign, grown), "grown", rng=np.random.default_rng(1))
        assert beyond.missing == ()


@pytest.mark.slow
def test_a_straightness_of_one_pitch_is_told_as_that_cycle(virtual_campaigns: ModuleType, seeds: Any) -> None:
    for seed in seeds(60, 1):
        hidden = simulator().Effect("EZX:curve", peak_um=3.0, curve=wave(160.0))
        campaign, _ = virtual_campaigns.virtual(seed, [hidden], days=2, runs_per_day=3)
        (found,) = explain(campaign, problem_of(campaign), "samba", rng=np.random.default_rng(1)).missing
        assert found.effect.startswith("EZX:cyclic"), seed
        assert found.searched is not None
        assert found.searched.value == pytest.approx(160.0, abs=5.0)
        assert found.amplitude == pytest.approx(3e-3, rel=0.2)


@pytest.mark.slow
def test_size_peak_and_curve_of_a_free_shape_are_one_quantity(
    virtual_campaigns: ModuleType, explained: Any
) -> None:
    def curve(q: Any, travel: Any, now: Any) -> Any:
        return np.exp(-(((q - 30.0) / 25.0) ** 2))

    hidden = simulator().Effect("EYX:curve", peak_um=8.0, curve=curve)
    campaign, told = virtual_campaigns.virtual(4, [hidden], days=2, runs_per_day=3)
    (found,) = explained(campaign).missing
    assert found.effect.startswith("EYX:free")
    assert found.amplitude == pytest.approx(float(np.abs(found.curve.size).max()))
    assert found.peak == pytest.approx(found.amplitude, rel=0.05)
    # What the simulator hid, without the constant and the slope that location errors take up.
    q = told["readings"]["X"]
    plain = np.column_stack([np.ones(len(q)), q])
    shape = curve(q, None, None)
    largest = np.abs(shape - plain @ np.linalg.lstsq(plain, shape, rcond=None)[0]).max() * 8e-3
    assert found.peak == pytest.approx(largest, rel=0.25)


@pytest.mark.parametrize(
    ("topology", "shifts"),
    [
        ("w b X Y Z C B t", {"EXX", "EYY", "EZZ"}),
        # Where B stands in X shifts along X itself; along Y and Z nothing else does.
        ("w C b X Y Z B (C1) t", {"EYY", "EZZ"}),
        # The tool is never turned: its own growth is the shift.
        ("w C A b Y X Z (C1) t", set()),
        ("w b X Y Z t", set()),
    ],
)
def test_shifts_of_a_ram_stand_where_no_location_error_does(topology: str, shifts: set[str]) -> None:
    chain = parse_topology(topology)
    found = of_ram(chain, base_effects(chain), ["warmup", "run_time"])
    assert set(found) == {f"{shift}:const@{driver}" for shift in shifts for driver in ("warmup", "run_time")}


@pytest.mark.slow
def test_growth_of_a_ram_by_the_same_everywhere_is_no_screw(
    virtual_campaigns: ModuleType, explained: Any
) -> None:
    """In the first run of each day, by a machine with a head."""
    hidden = simulator().Effect(
        "EZZ:curve", peak_um=8.0, curve=lambda q, travel, now: 1.0 - np.exp(-now.since_first_run_s / 700.0)
    )
    campaign, _ = virtual_campaigns.on_machine("fork head", 5, [hidden])
    found = explained(campaign).missing[0]
    assert "EZZ:const@warmup" in {found.effect, *(rival.effect for rival in found.rivals)}
    assert found.amplitude == pytest.approx(8e-3, rel=0.4)
