"""What a run without a setup says of what that setup reads: nothing, for itself and for the other runs."""

from __future__ import annotations

import numpy as np
import pytest

from monitor.methods import campaign_method
from monitor.methods.chain.problem import solve_problem
from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.sources import Quantity, Source
from monitor.uncertainty.runs.row_run import measured_run
from monitor.uncertainty.type_b import source_columns
from tests.simulator import horizontal_centre as centre


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Campaign:
    """Run 1 is measured by lasers alone, run 2 by all instruments of a horizontal centre."""
    rng = np.random.default_rng(9)
    folder = centre.campaign(tmp_path_factory.mktemp("absent") / "shop", rng, centre.truth_of(rng))
    header, *rows = (folder / "probings.csv").read_text(encoding="utf-8").splitlines()
    lasers = [row for row in rows if ",laser" in row]
    again = ["2" + row[1:] for row in rows]
    (folder / "probings.csv").write_text("\n".join([header, *lasers, *again, ""]), encoding="utf-8")
    header, first, *_ = (folder / "runs.csv").read_text(encoding="utf-8").splitlines()
    second = first.replace("1,2026-03-02T20", "2,2026-03-02T22", 1)
    assert second != first
    (folder / "runs.csv").write_text("\n".join([header, first, second, ""]), encoding="utf-8")
    read = read_campaign(folder)
    assert isinstance(read, Campaign)
    return read


def test_a_source_does_the_same_to_a_run_behind_one_without_the_setup(campaign: Campaign) -> None:
    problem = campaign_method(campaign).problem_of(campaign)
    solution = solve_problem(problem)
    source = Source(name="B readout", quantity=Quantity.ROTARY_READOUT, size=5e-6, axis="B")

    def moved(*order: int) -> np.ndarray:
        fixed, coefficients = problem.resolved(solution.common)
        runs = {number: measured_run(fixed, number, coefficients) for number in (1, 2)}
        columns = {
            number: source_columns(runs[number], solution.local[number - 1], campaign, number, (source,))
            for number in order
        }
        return columns[2][0].columns

    alone = moved(2)
    # The R-test stands at 25 angles of B; lasers alone see one value.
    assert alone.shape[1] == 25
    np.testing.assert_allclose(moved(1, 2), alone)
