"""Added effects in one run as a measurement: what drives them is told by all runs, whichever run is looked at.

With the added effects held where the campaign has them, a run's own least-squares point is that of the campaign: both
are zeros of the same derivatives.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.discovery import fit
from monitor.effects import parse_effect
from monitor.methods import campaign_method
from monitor.methods.model import Model
from monitor.readers import read_campaign
from monitor.uncertainty import measured_run, sensitivity_of

EXAMPLES = Path(__file__).parents[2] / "examples"
RUN = 2
EFFECTS = (
    "EXX:reversal@each_run",
    "EXX:step(275)@each_run",
    "EXX:step(10)",
    "EXX:reversal@run_time",
    "EXX:reversal@run_time(2)",
    "EYY:poly1@run_time(3)",
    "EXX:reversal@stepped(run 2, sequence 80)",
    "EXX:reversal@warmup45min",
    pytest.param("EZZ:poly1@warmup", marks=pytest.mark.slow),
    "EXX:reversal@settling10min",
    "EXX:reversal@sequence",
    "EYC:const@ambient_degC",
    "EYC:const@lagged60min_ambient_degC",
    "EYC:const@probe_travel_mm",
    "EAC:const@gravity",
    "EXX:table5",
    "artefact:moved(run 2, sequence 30)",
    "ball:4:moved(run 2, sequence 30)",
)
BY_ROWS = (
    "EXX:step(-10)@each_run",
    "EXX:reversal@run_time(2)",
    "EXX:reversal@settling10min",
)


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_run_alone_is_the_run_of_its_campaign(campaign, effect):
    problem = campaign("five-days")
    columns = problem.context.columns
    # A channel that is no temperature counts from its mean over the campaign, which no single run knows.
    travel = {"probe_travel_mm": np.asarray(problem.context.run + np.sin(np.arange(len(problem.context))))}
    problem = replace(
        problem,
        context=replace(problem.context, columns={**columns, **travel}),
        added=(parse_effect(effect, problem.context.chain),),
    )
    _same_alone(problem)


@pytest.mark.parametrize("effect", BY_ROWS)
def test_a_run_of_rows_alone_is_the_run_of_its_campaign(effect):
    campaign = read_campaign(EXAMPLES / "tilting-table")
    _same_alone(campaign_method(campaign).problem_of(campaign, Model("driven", added=(effect,))))


def _same_alone(problem):
    """Compare the run by itself with that of the campaign."""
    fitted = fit(problem)
    run = measured_run(fitted.problem, RUN, fitted.solution.common)
    assert run.problem.added_names == fitted.problem.added_names
    assert len(run.common) == len(run.problem.added_names)
    alone = sensitivity_of(run)
    index = int(np.flatnonzero(fitted.problem.runs == RUN)[0])
    determined = alone.determined
    assert determined.any()
    np.testing.assert_allclose(
        alone.unknowns[determined], fitted.solution.local[index][determined], rtol=0.0, atol=2e-8
    )
