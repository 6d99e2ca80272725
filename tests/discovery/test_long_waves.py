"""Waves of one and a half to two periods over the travel: told where they alone are their error, as nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import explain
from tests.discovery.laser_along_x import laser_along_x, wave

#: Three runs at eleven positions over 760 mm.
RUNS = [[76.0 * step for step in range(11)]] * 3


def found_in(folder: Path, error_um: Callable[[float], float], seed: int) -> list[str]:
    """The effects that are told of three runs."""
    campaign, problem = laser_along_x(folder, RUNS, error_um, seed)
    explanation = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    return [missing.effect for missing in explanation.missing]


@pytest.mark.parametrize(
    ("pitch", "seed"),
    [
        (460.0, 1),
        pytest.param(400.0, 1, marks=pytest.mark.all_seeds),
        pytest.param(420.0, 3, marks=pytest.mark.slow),
    ],
)
def test_a_wave_longer_than_half_of_the_travel_is_told_alone(tmp_path: Path, pitch: float, seed: int) -> None:
    """Two leads and a parabola were told of one wave (1.9, 6.6 and 7 um of 4), or leads that look 380 and 304 mm
    long."""
    (effect,) = found_in(tmp_path / "wave", wave(pitch), seed)
    assert float(effect.removeprefix("EXX:cyclic").removesuffix("mm")) == pytest.approx(pitch, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.all_seeds)])
def test_a_dead_zone_is_no_long_wave(tmp_path: Path, seed: int) -> None:
    """With waves of one period in the travel, cycles of 410 to 610 mm were told of it."""
    told = found_in(
        tmp_path / "zone",
        lambda x: 16.0 * float(np.sign(x - 380.0)) * max(abs(x - 380.0) / 760.0 - 0.2, 0.0),
        seed,
    )
    assert told
    assert not any("cyclic" in effect for effect in told)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.all_seeds)])
def test_a_pitch_at_the_end_of_its_range_is_not_told(tmp_path: Path, seed: int) -> None:
    """Of waves that become shorter along the axis a pitch of half of the travel was told, and a parabola of 2.5 um."""
    positions = [50.0 * step for step in range(16)]
    campaign, problem = laser_along_x(
        tmp_path / "chirp",
        [positions] * 3,
        lambda x: 4.0 * float(np.sin(2.0 * np.pi * (1.1 * x / 750.0 + 0.5 * (x / 750.0) ** 2))),
        seed,
    )
    explanation = explain(campaign, problem, "instruments", rng=np.random.default_rng(1))
    values = [missing.searched.value for missing in explanation.missing if missing.searched is not None]
    assert all(abs(value / 375.0 - 1.0) > 0.005 for value in values)
