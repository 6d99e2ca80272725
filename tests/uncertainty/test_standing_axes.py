"""A run of a machine with one rotary axis, taken out of a campaign: along that axis nothing moves a linear axis, and
the chain stands at expected places, beside what was read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.effects import parse_effect
from monitor.methods.chain.problem import solve_problem
from monitor.methods.samba.method import problem_of
from monitor.uncertainty import measured_run
from monitor.uncertainty.runs.program import compile_program
from monitor.uncertainty.runs.row_run import repeated_readings
from monitor.workflow.plan.candidates import _first_run

virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery" / "virtual.py")


@pytest.fixture(scope="module")
def problems():
    """A campaign of four runs as read, with an effect, and where the chain is expected to stand."""
    campaign = virtual.on_machine("one rotary table", 7)[0]
    campaign = replace(campaign, probings=campaign.probings.rows(campaign.probings.run <= 4))
    bare = problem_of(replace(campaign, runs=campaign.runs[:4]))
    read = replace(bare, added=(parse_effect("EXX:reversal", bare.context.chain),))
    return read, read.foreseen()


def test_a_run_alone_has_the_residuals_that_it_has_beside_the_others(problems) -> None:
    read, foreseen = problems
    assert foreseen.beside is not None
    solution = solve_problem(foreseen)
    run = measured_run(foreseen, 3, solution.common)
    whole = foreseen.linearise(solution.local, solution.common)
    alone = run.repeated(np.column_stack([run.inputs, run.inputs])).linearise(
        np.repeat(solution.local[[2]], 2, axis=0), solution.common
    )
    for trial in range(2):
        count = alone.residual.shape[1]
        np.testing.assert_allclose(alone.residual[trial], whole.residual[2, :count], atol=1e-9)
    # Its inputs are what was read, and a reading that moves moves the chain as far.
    np.testing.assert_array_equal(repeated_readings(foreseen), repeated_readings(read))
    moved = run.inputs + 1e-3
    joints = run.linear
    by = run.repeated(moved[:, None]).context.positions - run.problem.context.positions
    np.testing.assert_allclose(by[:, joints] * run.signs, 1e-3, atol=1e-9)
    assert not np.delete(by, joints, axis=1).any()


def test_a_run_at_expected_places_is_solved_to_its_own_numbers(problems) -> None:
    foreseen = problems[1]
    solution = solve_problem(foreseen)
    run = measured_run(foreseen, 2, solution.common)
    assert compile_program(run) is None
    solved, converged = run.solve(run.inputs[:, None], solution.local[1])
    assert converged.all()
    free = solution.local_free[1]
    u = np.sqrt(np.diagonal(solution.local_covariance[1]))
    # The effect common to all runs is held; what it moved of a run is below its uncertainty.
    assert np.all(np.abs(solved[free, 0] - solution.local[1, free]) < 0.01 * u[free])


def test_a_plan_of_the_first_run_stands_where_it_is_planned(problems) -> None:
    read, foreseen = problems
    plan = _first_run(foreseen)
    assert plan.vectors(plan.start, plan.common_start).shape == (int((read.context.run == 1).sum()), 3)
