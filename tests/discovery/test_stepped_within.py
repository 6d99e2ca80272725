"""A step within a run of a machine tool is said in place of the drift that takes it up by half; drifts stay drifts, in
the independent simulator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from by_path import simulator

#: µm at the ball that moves most.
PEAK = 10.0


def lost(run: int) -> Callable[[np.ndarray, np.ndarray, Any], np.ndarray]:
    """A zero that is lost in the middle of one run."""
    return lambda position, travel, now: 1.0 * ((now.run_fraction >= 0.5) & (now.run == run))


def settling(position: np.ndarray, travel: np.ndarray, now: Any) -> np.ndarray:
    """What settles within a fifth of every run."""
    return np.asarray(1.0 - np.exp(-now.run_fraction / 0.2))


@pytest.mark.slow
def test_a_zero_of_b_that_is_lost_within_a_run_is_a_step(virtual_campaigns, explained, seeds):
    sim = simulator()
    campaigns, besides = seeds(10, 1), 0
    for seed in campaigns:
        hidden = sim.Effect("EBB:curve", peak_um=PEAK, curve=lost(2))
        campaign, _ = virtual_campaigns.virtual(67100 + seed, [hidden], days=1, runs_per_day=2)
        found = explained(campaign)
        probings = campaign.probings
        of_run = probings.run == 2
        elapsed = probings.time[of_run] - probings.time[of_run].min()
        first = int(probings.sequence[of_run][elapsed >= 0.5 * elapsed.max()].min())
        assert found.stepped is not None
        assert found.stepped.errors[0] == "EB0C"
        assert (found.stepped.moment.run, found.stepped.moment.sequence) == (2, first)
        assert not [each.effect for each in found.missing if each.effect.startswith("EB0C")]
        besides += bool(found.missing)
    assert besides <= len(campaigns) // 5


@pytest.mark.slow
@pytest.mark.parametrize("curve", [None, settling])
def test_what_warms_up_is_no_step(virtual_campaigns, explained, seeds, curve):
    sim = simulator()
    for seed in seeds(10, 1):
        name = "EZC1:const@warmup" if curve is None else "EZC1:curve"
        hidden = sim.Effect(name, peak_um=PEAK, curve=curve)
        campaign, _ = virtual_campaigns.virtual(67200 + seed, [hidden], days=1, runs_per_day=2)
        found = explained(campaign)
        assert found.stepped is None
        assert found.missing[0].effect.startswith("EZC1:const@")
