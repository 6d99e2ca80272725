"""Effects that are common to the runs of a campaign: recovered, or refused by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy import stats

from monitor.exceptions import EffectError, NotConvergedError
from monitor.methods.chain import problem as chain_problem
from monitor.methods.chain.added_effects import STARTS_S
from monitor.methods.chain.problem import solve_problem
from monitor.methods.model import Model
from monitor.methods.samba.method import METHOD as samba, problem_of
from monitor.readers import read_campaign
from monitor.records import Array
from monitor.reporting.refused import refusal_sentence

Distance = Callable[[Array, Array], float]
EXAMPLES = Path(__file__).parents[2] / "examples"


def test_added_effects_are_recovered_with_the_right_covariance(
    simulator: ModuleType,
    simulated: Callable[..., Any],
    truth: Array,
    distance: Distance,
    seeds: Callable[[int, int], range],
) -> None:
    added = ("EYX:poly2", "EZC1:const@warmup45min", "EXX:reversal")
    true = np.array([9e-8, 0.008, 0.002])
    effects = (
        simulator.Effect("EYX:poly2", coefficients=true[0]),
        simulator.Effect("EZC1:const@warmup", coefficients=true[1], tau_s=45 * 60.0),
        simulator.Effect("EXX:reversal", coefficients=true[2]),
    )
    common, local = [], []
    numbers = seeds(60, 25)
    for seed in numbers:
        campaign = simulated(seed, days=1, runs=3, effects=effects)[1]
        found = samba.identify(campaign, Model("grown", added=added))
        assert found.added == added
        assert found.added_refused == ()
        common.append(distance(found.added_estimate - true, found.added_covariance))
        run = found.runs[-1]
        local.append(distance(run.estimate - truth, run.covariance))
    assert stats.kstest(common, stats.chi2(3).cdf).pvalue > 1e-3
    assert stats.kstest(local, stats.chi2(13).cdf).pvalue > 1e-3
    assert np.mean(common) == pytest.approx(3, abs=4 * np.sqrt(2 * 3 / len(numbers)))
    assert np.mean(local) == pytest.approx(13, abs=4 * np.sqrt(2 * 13 / len(numbers)))


def test_an_effect_that_is_missing_shows_in_chi_square(
    simulator: ModuleType, simulated: Callable[..., Any]
) -> None:
    effects = (simulator.Effect("EXX:reversal", peak_um=4.0),)
    campaign = simulated(1, days=1, runs=3, effects=effects)[1]
    plain = samba.identify(campaign)
    grown = samba.identify(campaign, Model("grown", added=("EXX:reversal",)))
    assert min(stats.chi2(run.degrees_of_freedom).sf(run.chi_square) for run in plain.runs) < 1e-4
    assert min(stats.chi2(run.degrees_of_freedom).sf(run.chi_square) for run in grown.runs) > 1e-4


@pytest.mark.parametrize(
    "text", ["EYX:poly1", "EZX:poly1", "EXY:poly1", "EYZ:poly1", "EBB:const", "EXX:poly1@each_run"]
)
@pytest.mark.parametrize("scale", [1.0, 50.0])
def test_effects_md_an_invisible_effect_is_refused_by_name(
    simulated: Callable[..., Any], truth: Array, text: str, scale: float
) -> None:
    campaign = simulated(2, days=1, runs=2, scale=scale)[1]
    found = samba.identify(campaign, Model("grown", added=(text,)))
    assert np.isnan(found.added_estimate).all()
    assert np.isnan(found.added_covariance).all()
    assert [refusal.parameters for refusal in found.added_refused] == [(name,) for name in found.added]
    assert {"free in every run" in refusal_sentence(refusal) for refusal in found.added_refused} == {True}
    # It takes nothing away from what the plan does see.
    plain = samba.identify(campaign)
    np.testing.assert_allclose(found.runs[0].estimate, plain.runs[0].estimate, rtol=0, atol=1e-9)


def test_a_model_names_an_effect_once(simulated: Callable[..., Any]) -> None:
    campaign = simulated(1)[1]
    with pytest.raises(EffectError, match="model twice has EA0B already; name an effect once"):
        samba.identify(campaign, Model("twice", added=("EA0B:const",)))


def test_a_time_constant_that_no_reading_shows_is_held_and_the_effect_keeps_its_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where no search for a time constant settles, the size is that of the effect with the held one, to 1e-6 of its
    standard uncertainty; before, the model could not be fitted, although `explain` may have named the effect."""
    campaign = read_campaign(EXAMPLES / "nothing-hidden")
    searches: list[int] = []

    def settles_with_a_held_one(*arguments: Any) -> Any:
        searches.append(len(searches))
        if len(searches) == 1:
            raise NotConvergedError("did not converge")
        return best_of(*arguments)

    best_of = chain_problem._best_of
    monkeypatch.setattr(chain_problem, "_best_of", settles_with_a_held_one)
    searching = solve_problem(problem_of(campaign, Model("warm", added=("EXC1:const@warmup",))))
    assert searches == [0, 1]
    assert searching.common_free.tolist() == [True, False]
    minutes = round(float(np.exp(searching.common[1])) / 60.0, 6)
    assert minutes in [seconds / 60.0 for seconds in STARTS_S]
    fixed = solve_problem(problem_of(campaign, Model("warm", added=(f"EXC1:const@warmup{minutes:g}min",))))
    u = float(np.sqrt(fixed.common_covariance[0, 0]))
    assert abs(searching.common[0] - fixed.common[0]) < 1e-6 * u
    assert np.isclose(np.sum(searching.last.residual**2), np.sum(fixed.last.residual**2), rtol=1e-12)
