"""The runs of a campaign before a moment: with an offset, or by the clock of the shop."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from monitor.exceptions import DataError, InputError
from monitor.readers import read_campaign
from monitor.workflow.campaign_parts import method_of, runs_before
from monitor.workflow.plan.request import PlanRequest
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize(
    "moment",
    [datetime(2026, 2, 17, 10, 5, 27), datetime(2026, 2, 17, 15, 5, 27, tzinfo=UTC)],
    ids=["by the clock of the shop, five hours behind UTC", "with an offset"],
)
def test_runs_before_a_moment_with_or_without_an_offset(moment: datetime) -> None:
    campaign = read_campaign(EXAMPLES / "cold-cold")
    assert [run.run for run in runs_before(campaign, moment).runs] == [1, 2]
    with pytest.raises(DataError, match="cold-cold has no run before 2001-01-01 00:00"):
        runs_before(campaign, moment.replace(2001, 1, 1, 0, 0))


def test_a_result_says_whose_clock_decided_its_runs() -> None:
    moment = datetime(2026, 2, 17, 10, 5)
    assert method_of("guf", moment) == "guf, runs before 2026-02-17 10:05"
    assert method_of("guf", moment.replace(tzinfo=UTC)) == "guf, runs before 2026-02-17 10:05+0000"


@pytest.mark.parametrize("p", [1e-320, 0.4, 0.99999, 1.0])
def test_a_probability_that_no_region_is_stated_for_is_refused(p: float) -> None:
    with pytest.raises(InputError, match=r"a coverage probability lies between 0\.5 and 0\.9999"):
        UncertaintyRequest("five-days", p=p)
    with pytest.raises(InputError, match=r"a coverage probability lies between 0\.5 and 0\.9999"):
        PlanRequest("five-days", p=p)
