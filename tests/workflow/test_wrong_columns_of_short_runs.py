"""A wrong column of one run is named, and its plan is not blamed; a plan is blamed where the columns are right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from by_path import load

from monitor.exceptions import DataError
from monitor.methods.chain.problem import solve_problem
from monitor.methods.samba.method import problem_of
from monitor.records import Campaign
from monitor.workflow.identify.mistaken_columns import with_mistake

virtual = load("virtual_campaigns", Path(__file__).resolve().parents[1] / "discovery/virtual.py")


def refusal(axis: str, factor: float, shift_to: float | None, rows_of_run_2: int | None) -> DataError:
    """Of three runs of five days' plan the second has an axis in another unit, or standing still, or is cut."""
    last = np.inf if rows_of_run_2 is None else rows_of_run_2
    campaign: Campaign = virtual.virtual(
        5, [], days=1, runs_per_day=3, keep=lambda told: (told["run"] != 2) | (told["sequence"] <= last)
    )[0]
    readings = {name: values.copy() for name, values in campaign.probings.readings.items()}
    of_run = campaign.probings.run == 2
    values = readings[axis][of_run]
    readings[axis][of_run] = factor * values if shift_to is None else shift_to
    mistaken = replace(campaign, probings=replace(campaign.probings, readings=readings))
    with (
        pytest.raises(DataError, match=r"no error of a machine|did not converge") as refused,
        np.errstate(all="ignore"),
    ):
        solve_problem(problem_of(mistaken))
    return with_mistake(refused.value, mistaken, problem_of)


@pytest.mark.slow
def test_an_axis_in_inches_is_named_in_a_run_that_was_cut_short() -> None:
    """Was: the readings of run 2 leave unknowns open, measure the rest of the poses."""
    said = str(refusal("X", 1.0 / 25.4, None, 20))
    assert "run 2: EXX comes out" in said
    assert "in inches" in said
    assert "leave" not in said


@pytest.mark.slow
@pytest.mark.parametrize("rows_of_run_2", [None, 61])
def test_a_column_that_stands_still_in_one_whole_run_is_named(rows_of_run_2: int | None) -> None:
    """Was: run 2 leaves unknowns open, though it has every pose of the others, or all but its last of 62 rows."""
    said = str(refusal("B", 1.0, 0.0, rows_of_run_2))
    assert "in run 2 b stands still at all readings and moves in the other runs" in said.lower()
    assert "measure the rest" not in said
