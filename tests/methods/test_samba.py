"""SAMBA on the examples: the figures of the conventions, thirteen and eleven parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from by_path import simulator
from scipy import stats

from monitor.methods.samba.method import METHOD as samba
from monitor.readers import read_campaign
from monitor.records import Array
from monitor.reporting.refused import refusal_sentence

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
THIRTEEN = simulator().SAMBA_PARAMETERS
# Conventions, section What SAMBA identifies, computed independently of the project: 4 balls, the 15 indexations
# of the five-day plan, a bar and 1 µm of white noise on every reading; in µrad, µm and µm/m.
FIGURES = {
    "EA0B": 1.9,
    "EC0B": 1.7,
    "EA0C": 2.0,
    "EB0C": 1.7,
    "EB0Z": 2.3,
    "EA0Y": 2.7,
    "EC0Y": 2.2,
    "EX0C": 0.28,
    "EX0C1": 0.33,
    "EY0C1": 0.36,
    "EXX": 6.2,
    "EYY": 5.7,
    "EZZ": 6.3,
}


def in_display_units(found: Any) -> tuple[Array, Array]:
    factors = np.array([unit.factor for unit in found.units])
    u = np.array([np.sqrt(np.diag(run.covariance)) for run in found.runs])
    return np.array([run.estimate for run in found.runs]) / factors, u / factors


def test_five_days_gives_the_thirteen_of_the_conventions() -> None:
    found = samba.identify(read_campaign(EXAMPLES / "five-days"))
    assert found.parameters == THIRTEEN
    assert len(found.runs) == 20
    estimates, u = in_display_units(found)
    assert np.isfinite(estimates).all()
    assert [run.refused for run in found.runs] == [()] * 20
    np.testing.assert_allclose(u, np.tile([FIGURES[name] for name in THIRTEEN], (20, 1)), rtol=0.10)
    units = dict(zip(found.parameters, (unit.name for unit in found.units), strict=True))
    assert units["EA0B"] == "µrad"
    assert units["EX0C1"] == "µm"
    assert units["EXX"] == "µm/m"


def test_five_days_shows_the_step_of_eb0c_on_day_4() -> None:
    campaign = read_campaign(EXAMPLES / "five-days")
    estimates, _ = in_display_units(samba.identify(campaign))
    days = np.array([run.day for run in sorted(campaign.runs, key=lambda run: run.run)])
    eb0c = estimates[:, THIRTEEN.index("EB0C")]
    p_value = stats.f_oneway(*(eb0c[days == day] for day in np.unique(days))).pvalue
    assert p_value < 0.001


@pytest.mark.parametrize("name", ["cold-cold", "hot-cold"])
def test_without_spindle_indexation_eleven_come_out_and_two_are_refused_by_name(name: str) -> None:
    found = samba.identify(read_campaign(EXAMPLES / name))
    assert found.parameters == THIRTEEN
    estimates, u = in_display_units(found)
    hidden = [THIRTEEN.index("EX0C1"), THIRTEEN.index("EY0C1")]
    others = np.delete(np.arange(13), hidden)
    assert len(found.runs) == 44
    for run in found.runs:
        assert [refusal.parameters for refusal in run.refused] == [("EX0C1",), ("EY0C1",)]
        assert refusal_sentence(run.refused[0]) == (
            "with this plan EX0C1 cannot be told apart from tip x: C1 stands at one angle throughout; probe also "
            "with C1 at 90, 180 and 270 degrees"
        )
        assert np.isnan(run.covariance[hidden]).all()
        assert np.isnan(run.covariance[:, hidden]).all()
    assert np.isnan(estimates[:, hidden]).all()
    assert np.isfinite(estimates[:, others]).all()
    assert (u[:, others] > 0).all()
