"""A source shared by a day beside the scatter of selected runs: the days of these count, not those of the campaign."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.readers import read_campaign
from monitor.records import Campaign
from monitor.reporting.budget import HoldsFor
from monitor.sources import Quantity, Sharing, Source
from monitor.store import Database, import_campaign
from monitor.workflow.uncertainty.evaluation import uncertainty
from monitor.workflow.uncertainty.request import UncertaintyRequest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def _with_runs(campaign: Campaign, name: str, numbers: list[int]) -> Campaign:
    """Some runs of a campaign under another name."""
    keep = np.isin(campaign.probings.run, numbers)
    runs = tuple(run for run in campaign.runs if run.run in numbers)
    return replace(campaign, name=name, runs=runs, probings=campaign.probings.rows(keep))


@pytest.fixture(scope="module")
def whole() -> Campaign:
    campaign = read_campaign(EXAMPLES / "five-days")
    assert isinstance(campaign, Campaign)
    return campaign


def _two_of_every_day(campaign: Campaign, first: int) -> list[int]:
    """The numbers of two runs of each of five days, from the ``first`` of the day."""
    by_day: dict[int, list[int]] = {}
    for run in campaign.runs:
        by_day.setdefault(run.day, []).append(run.run)
    ten = [number for numbers in by_day.values() for number in numbers[first : first + 2]]
    assert (len(by_day), len(ten)) == (5, 10)
    return ten


def test_a_run_alone_takes_the_days_of_the_runs_that_are_selected(whole: Campaign, tmp_path: Path) -> None:
    """Ten runs on five days show 8/9 of the variance of a value a day: a ninth is left to a run of one day."""
    with Database(tmp_path / "shop.duckdb", threads=1) as db:
        import_campaign(db, _with_runs(whole, "alone", [whole.runs[0].run]))
        import_campaign(db, _with_runs(whole, "ten", _two_of_every_day(whole, 1)))

        def variances(*sources: Source) -> np.ndarray:
            request = UncertaintyRequest(
                "alone", method="guf", select="ten", model_uncertainty=False, sources=sources
            )
            return np.array(list(uncertainty(db, request).guf.u.values())) ** 2

        source = Source(name="air", quantity=Quantity.DRIFT, size=5e-3)
        none = variances()
        always, a_day = (
            variances(replace(source, shared_by=shared)) - none for shared in (Sharing.ALL_RUNS, Sharing.DAY)
        )
        assert np.max(always) > 0.0
        np.testing.assert_allclose(a_day, always / 9.0, rtol=1e-6, atol=1e-9 * float(np.max(always)))


def test_the_scatter_of_selected_runs_holds_for_their_days(whole: Campaign, tmp_path: Path) -> None:
    """Was: for those of the run's own campaign, so that of a run alone it was said to hold within a day."""
    with Database(tmp_path / "shop.duckdb", threads=1) as db:
        import_campaign(db, _with_runs(whole, "alone", [whole.runs[0].run]))
        import_campaign(db, _with_runs(whole, "ten", _two_of_every_day(whole, 0)))
        request = UncertaintyRequest("alone", method="guf", select="ten", model_uncertainty=False)
        assert uncertainty(db, request).holds_for is HoldsFor.CAMPAIGN
