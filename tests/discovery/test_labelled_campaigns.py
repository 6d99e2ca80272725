"""The labelled campaigns in examples/: what was hidden in them is told, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.discovery import Verdict

# The noise floor of every example but cold-cold, in mm: 1 µm white noise on each reading.
FLOOR = 1e-3


def within_the_floor(found):
    assert found.held_out_after == pytest.approx(FLOOR, rel=0.03)
    assert found.held_out_days_after == pytest.approx(FLOOR, rel=0.03)
    assert found.held_out_before > found.held_out_after
    assert found.rms_before > found.rms_after


def nothing_else(answer):
    assert len(answer.missing) == 1
    assert answer.suspect == ()
    assert answer.moves == ()
    assert answer.steps == ()
    assert answer.comparison.verdict is Verdict.SOMETHING_IS_MISSING


@pytest.mark.parametrize("name", ["nothing-hidden", pytest.param("cold-cold", marks=pytest.mark.slow)])
def test_where_nothing_is_missing_the_answer_is_nothing(example, name):
    answer = example(name)
    assert answer.missing == ()
    assert answer.suspect == ()
    assert answer.moves == ()
    assert answer.steps == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED


@pytest.mark.slow
def test_spindle_growth_with_its_time_constant(example):
    answer = example("hidden-spindle-growth")
    nothing_else(answer)
    (found,) = answer.missing
    assert found.effect == "EZC1:const@warmup"
    assert found.rivals == ()
    assert abs(found.amplitude - 6e-3) < 3 * found.u
    assert found.u < 0.5e-3
    assert found.peak == pytest.approx(6e-3, abs=1e-3)
    assert found.searched.name == "time constant"
    assert abs(found.searched.value - 18.0) < 2 * found.searched.u
    assert "spindle" in found.description.meaning
    within_the_floor(found)


@pytest.mark.all_seeds
def test_b_indexing_is_the_sine_of_two_periods_a_turn(example):
    answer = example("hidden-b-indexing")
    nothing_else(answer)
    (found,) = answer.missing
    assert found.effect == "EBB:harmonic2"
    assert found.parameters == ("EBB:harmonic2.cos", "EBB:harmonic2.sin")
    u = np.sqrt(np.diag(found.covariance))
    assert abs(found.coefficients[0]) < 3 * u[0]
    assert abs(abs(found.coefficients[1]) - 25e-6) < 3 * u[1]
    assert found.units[0].name == "µrad"
    within_the_floor(found)


@pytest.mark.all_seeds
def test_reversal_of_x_is_half_the_reversal_error(example):
    answer = example("hidden-reversal-x")
    nothing_else(answer)
    (found,) = answer.missing
    assert found.effect == "EXX:reversal"
    assert abs(abs(found.amplitude) - 4e-3) < 3 * found.u
    assert "backlash" in found.description.cause
    within_the_floor(found)


@pytest.mark.slow
def test_a_loose_ball_is_no_law_of_physics(example):
    answer = example("hidden-loose-ball")
    assert answer.missing == ()
    assert answer.suspect == ()
    assert answer.steps == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED
    (move,) = answer.moves
    assert (move.target, move.run) == ("2", 3)
    # Four touches an indexation: the ball's touches before and after the moment are this far apart.
    assert 33 <= move.sequence <= 36
    assert np.array(move.shift) * 1e3 == pytest.approx([-3.4, -8.5, 0.5], abs=1.2)


def test_a_step_of_the_zero_of_b_is_told_as_a_step(example):
    answer = example("five-days")
    assert answer.missing == ()
    assert answer.moves == ()
    assert answer.comparison.verdict is Verdict.EXPLAINED
    (step,) = answer.steps
    assert (step.parameter, step.target, step.run) == ("EB0C", None, 13)
    assert step.size == pytest.approx(15e-6, abs=3e-6)
    assert step.p_value < 0.01


def test_blind_spots_name_the_ten_that_leave_nothing(example):
    """The prototype of the design: ten effects of first order that the base parameters or balls take up."""
    nothing_left = {
        "EYX:poly1", "EZX:poly1", "EAY:poly1", "EBY:poly1", "ECY:poly1",
        "EXY:poly1", "EZY:poly1", "EBZ:poly1", "EXZ:poly1", "EYZ:poly1",
    }  # fmt: skip
    blind = set(example("nothing-hidden").blind)
    assert nothing_left <= blind
    assert blind.isdisjoint({"EXX:poly2", "EXX:reversal", "EBB:harmonic2", "EZC1:const@warmup", "EAX:poly1"})
