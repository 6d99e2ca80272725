"""How long the identification of a day's runs takes; run with `pytest tests/benchmarks`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from monitor.methods import rotary_probing, samba
from monitor.methods.model import Model
from monitor.readers import read_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


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


def test_rotary_probing_of_154_touches(benchmark: Any) -> None:
    """Less than a second is asked for, for one run; here there are four."""
    campaign = read_campaign(EXAMPLES / "tilting-table")
    found = benchmark(rotary_probing.identify, campaign)
    assert all(np.isfinite(run.estimate).all() for run in found.runs)
