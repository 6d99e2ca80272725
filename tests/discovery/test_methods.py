"""The search on methods that tell one number a touch: no noise is taken for an effect, and what is hidden is found.

A few seeds; rates over many are in ``tests/benchmarks/trial_methods.py``.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from by_path import load

from monitor.discovery import Verdict
from monitor.methods.chain.problem import solve_problem
from monitor.methods.rotary_probing.method import METHOD as rotary_probing

TESTS = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def trial(simulator: ModuleType) -> ModuleType:
    """The scenes of the trial, loaded by path."""
    before = list(sys.path)
    try:
        return load("trial_methods", TESTS / "benchmarks" / "trial_methods.py")
    finally:
        sys.path[:] = before


def named(trial: ModuleType, effect: str):
    return next(one for one in trial.ROTARY if one.name == effect)


@pytest.mark.parametrize("perfect", [False, True])
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.all_seeds)])
def test_rotary_probing_nothing_is_missing(trial, perfect, seed):
    told = trial.explained(trial.rotary(np.random.default_rng(seed), 4, perfect=perfect))
    assert trial.groups(told) == []
    assert told.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.parametrize(
    "seed",
    [
        100,
        pytest.param(102, marks=pytest.mark.slow),
        *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (103, 104, 105, 106)),
    ],
)
@pytest.mark.slow
def test_a_tool_that_goes_astray_while_it_touches_is_no_effect(trial, seed):
    """A drift of X shows in the touches along X alone; held against those before it, whatever their direction, it was
    told as an effect in each of these campaigns (an error of free shape, a bent axis)."""
    assert trial.groups(trial.explained(trial.rotary(np.random.default_rng([seed, 4]), 4, walk=0.25))) == []


def test_free_form_nothing_is_missing(trial):
    assert trial.groups(trial.explained(trial.pocket(np.random.default_rng(3), 2))) == []


@pytest.mark.slow
def test_modules_that_deviate_alike_in_every_run_are_no_effect(trial):
    """Ten runs told cycles of Y and Z in 7 of 20 campaigns, before the search allowed for it."""
    for seed in (1, 2, 3):
        assert trial.groups(trial.explained(trial.arms(np.random.default_rng(seed), 10))) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.all_seeds)])
def test_points_ten_millimetres_apart_make_no_cycle_of_ten(trial, seed):
    """Was: EZZ:cyclic5mm of 0.8 mm and reversals of 0.3 to 0.4 mm beside what is hidden, out of the touches' noise."""
    campaign = trial.rotary(np.random.default_rng([seed, 9]), 6, named(trial, "EYZ:poly1"), perfect=True)
    told = trial.explained(campaign)
    (group,) = trial.groups(told)
    assert "EYZ:poly1" in group
    # What is left is the noise, and no less.
    assert told.final.scale == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    "effect",
    ["ECC:harmonic1", "EZZ:poly2", pytest.param("EAC:harmonic2", marks=pytest.mark.all_seeds)],
)
@pytest.mark.slow
def test_hidden_effects_of_8_um_are_found(trial, effect):
    (group,) = trial.groups(trial.explained(trial.rotary(np.random.default_rng(5), 4, named(trial, effect))))
    assert effect in group


@pytest.mark.parametrize(
    ("lobes", "beside"),
    [
        (3, None),
        pytest.param(2, "ECC:harmonic1", marks=pytest.mark.all_seeds),
        pytest.param(3, "ECC:harmonic1", marks=pytest.mark.all_seeds),
    ],
)
def test_lobes_of_the_probe_are_no_play_of_the_machine(trial, lobes, beside):
    """An oval pre-travel was told EYY:reversal, EXX:reversal and EXX:cyclic5.0157mm (radius of ball and tip)."""
    hidden = named(trial, beside) if beside else None
    probe = trial.lobed(lobes, 3e-3, 0.7)
    told = trial.explained(trial.rotary(np.random.default_rng(6), 3, hidden, "spheres", pre_travel=probe))
    groups = trial.groups(told)
    assert len(groups) == (2 if beside else 1)
    # Indexed at four angles a first harmonic is a third one.
    assert not beside or any(beside in group for group in groups)
    (found,) = (one for one in told.missing if one.effect == f"probe:lobing{lobes}")
    np.testing.assert_allclose(np.abs(found.amplitude), 3e-3, atol=4 * found.u)


def test_expected_places_leave_nothing_and_are_their_own(trial):
    """What is expected holds no part of a row's residual: read there, the fit leaves nothing and expects the same."""
    campaign = trial.rotary(np.random.default_rng([4, 1]), 3)
    noisy = rotary_probing.problem_of(campaign)
    expected = noisy.foreseen().context.places
    assert 0.3e-3 < np.abs(expected - noisy.context.positions).max() < 4e-3
    quiet = replace(noisy, context=replace(noisy.context, positions=expected))
    solution = solve_problem(quiet)
    assert np.abs(quiet.vectors(solution.local, solution.common)).max() < 1e-6
    np.testing.assert_allclose(quiet.foreseen().context.places, expected, rtol=0, atol=1e-6)
