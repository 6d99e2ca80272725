"""Waves of a free shape are told by their names, what is left of it stays free; the simulator shares no code."""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator


def test_a_fifth_wave_is_told_as_one_with_its_size(virtual_campaigns, explained):
    """It was `ECC:free(9,10)`: cosine and sine of five periods a turn."""
    sim = simulator()
    hidden = sim.Effect("ECC:curve", peak_um=8.0, curve=lambda q, t, now: np.cos(5.0 * q + 0.7))
    campaign, _ = virtual_campaigns.virtual(64000, [hidden], days=2)
    (missing,) = explained(campaign).missing
    assert missing.effect == "ECC:harmonic5"
    assert missing.peak * 1e3 == pytest.approx(8.0, rel=0.1)
    assert not [rival for rival in missing.rivals if "free" in rival.effect]


@pytest.mark.slow
def test_a_wave_beside_a_play_that_builds_up_is_told_by_its_name(virtual_campaigns, explained, seeds):
    """Both went into one free shape of C."""
    sim = simulator()

    def play(q: np.ndarray, travel: np.ndarray, now: object) -> np.ndarray:
        return travel * np.abs(np.sin(q / 2.0))

    for seed in seeds(8, 2):
        hidden = [
            sim.Effect("ECC:harmonic2", peak_um=6.0, direction=(1.0, 0.4)),
            sim.Effect("ECC:curve", peak_um=5.0, curve=play),
        ]
        campaign, _ = virtual_campaigns.virtual(64100 + seed, hidden, days=2)
        named = [effect.effect for effect in explained(campaign).missing]
        assert "ECC:harmonic2" in named
        assert all(name.startswith("ECC:") for name in named)
