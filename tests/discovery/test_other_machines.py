"""Other machines than the HU40-T: the search tells what was hidden, and nothing where nothing was."""

from __future__ import annotations

import numpy as np
import pytest
from by_path import simulator

from monitor.discovery import Verdict
from monitor.methods.chain.problem import solve_problem
from monitor.methods.samba.method import problem_of

#: The others have their turn in ``make slow``; of them two have a test below, one a rate in the trials.
MACHINES = ("trunnion", "head and table")
OTHERS = ("tilting table on X", "fork head", "one rotary table")


def groups(answer):
    return [{one.effect, *(rival.effect for rival in one.rivals)} for one in answer.missing]


@pytest.mark.parametrize(
    "machine", [*MACHINES, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)]
)
@pytest.mark.slow
def test_nothing_is_told_where_nothing_is_hidden(virtual_campaigns, explained, machine):
    campaign, _ = virtual_campaigns.on_machine(machine, 80000)
    answer = explained(campaign)
    assert not answer.missing
    assert answer.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.slow
@pytest.mark.parametrize(
    "machine", ["fork head", pytest.param("one rotary table", marks=pytest.mark.all_seeds)]
)
def test_two_hidden_effects_are_told(virtual_campaigns, explained, machine):
    sim = simulator()
    hidden = ("EXX:reversal", "EZZ:poly2" if machine == "one rotary table" else "EYX:poly3")
    campaign, _ = virtual_campaigns.on_machine(machine, 5, [sim.Effect(name, peak_um=6.0) for name in hidden])
    found = groups(explained(campaign))
    assert len(found) == 2
    assert all(any(name in group for group in found) for name in hidden)


@pytest.mark.parametrize(
    "seed", [90000, *(pytest.param(seed, marks=pytest.mark.all_seeds) for seed in (90001, 90002))]
)
def test_an_axis_that_stands_still_does_not_sell_its_noise(virtual_campaigns, explained, seed):
    """Along a single rotary table's axis nothing moves: cos(2 pi y / 16 mm) of the readings is then their noise in
    another unit, and a gain that only the stylus' offset of 0.3 mm determines would take the rest of it."""
    assert not explained(virtual_campaigns.on_machine("one rotary table", seed)[0]).missing


def test_a_chain_at_expected_places_leaves_the_identification_as_it_is(virtual_campaigns):
    problem = problem_of(virtual_campaigns.on_machine("one rotary table", 7)[0])
    assert problem.foreseen() is not problem
    as_read, foreseen = solve_problem(problem), solve_problem(problem.foreseen())
    # Gains that hang on 0.3 mm of offset differ most: their noise makes the estimate as read 0.2 u too small.
    u = np.sqrt(np.diagonal(as_read.local_covariance, axis1=1, axis2=2))
    assert np.all(np.abs(foreseen.local - as_read.local) < 0.5 * u)


def test_a_chain_that_moves_every_axis_stands_where_it_was_read(virtual_campaigns):
    problem = problem_of(virtual_campaigns.on_machine("trunnion", 7)[0])
    assert problem.foreseen() is problem
